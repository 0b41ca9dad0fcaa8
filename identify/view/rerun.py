"""A replay as a recording of Rerun: the machine, and below it every signal, on the log's time."""

from __future__ import annotations

import hashlib
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from identify.view.replay import AxisReplay, Replay
from identify.view.stage import BALL, BEHIND, GHOST, MARK, Stage, camera, shapes
from twin.errors import InputError
from twin.files import write_atomically
from twin.installed import pip_install
from twin.signals import Array

try:
    import rerun as rr
    import rerun.blueprint as rrb
except ImportError as error:
    raise InputError(
        f"--rerun needs rerun-sdk, which is not here; {pip_install('rerun')}, or give --html"
    ) from error

TIME = "time"  # s, of the log
MACHINE, CURVES = "machine", "signals"  # first parts of the names of what is recorded
MEASURED, MODELLED, SETPOINT = "measured", "modelled", "setpoint"
COLOURS = {MODELLED: GHOST[:3], SETPOINT: MARK[:3]}  # of curves, as of what moves
XYZW = [1, 2, 3, 0]  # a quaternion of Rerun, in one of MuJoCo


def write_recording(path: Path, replay: Replay, gain: float, speed: float) -> None:
    """Write the replay as .rrd; gain: of the differences drawn; speed: 1 is real time."""
    drawn = "at true size" if gain == 1.0 else f"differences drawn {gain:g} times as large"
    # The viewer keeps one layout by this name, so that each log and gain has one of its own.
    known = hashlib.sha256(f"{replay.title} {drawn}".encode()).hexdigest()[:8]
    stage, recording = Stage.of(replay), rr.RecordingStream(f"twin-{known}")
    times = [rr.TimeColumn(TIME, duration=replay.start + np.arange(len(replay)) / replay.rate)]
    with tempfile.TemporaryDirectory() as folder:
        made = Path(folder) / "made.rrd"
        recording.save(made, _layout(stage, replay, drawn, speed))
        recording.send_recording_name(replay.title)
        for name, looks in _shapes(stage, replay):
            recording.log(name, *looks, static=True)
        for name, columns in _motion(stage, replay, gain):
            recording.send_columns(name, times, columns)
        for axis, own in replay.axes.items():
            for of, curves in _curves(own).items():
                for curve, values in curves.items():
                    name = _name(CURVES, axis, of, curve)
                    if curve in COLOURS:
                        recording.log(name, rr.SeriesLines(colors=COLOURS[curve]), static=True)
                    recording.send_columns(name, times, rr.Scalars.columns(scalars=values))
        recording.disconnect()
        write_atomically(path, made.read_bytes())


def _layout(stage: Stage, replay: Replay, drawn: str, speed: float) -> Any:
    """The machine, named as it is drawn; below it, by tabs, the signals of each axis."""
    linked = rrb.archetypes.TimeAxis(link="LinkToGlobal")
    tabs = [
        rrb.Grid(
            *[rrb.TimeSeriesView(origin=_name(CURVES, axis, of), name=of, axis_x=linked)
              for of in _curves(own)],
            name=axis, grid_columns=2,
        )
        for axis, own in replay.axes.items()
    ]  # fmt: skip
    centre, (seen_from, fovy) = stage.model.stat.center, camera(stage.model, stage.data)
    # degrees that Rerun shows from top to bottom
    nearer = np.tan(np.radians(0.5 * fovy)) / np.tan(np.radians(0.5 * 55.0))
    look = rrb.EyeControls3D(
        position=centre + nearer * (seen_from - centre), look_target=centre, eye_up=(0.0, 0.0, 1.0)
    )
    sky = (205, 212, 219)  # behind the machine
    machine = rrb.Spatial3DView(
        origin=MACHINE, name=drawn, background=sky, line_grid=False, eye_controls=look
    )
    shares = (3, 2)  # of the height: of the machine, of its signals
    return rrb.Blueprint(
        rrb.Vertical(machine, rrb.Tabs(*tabs), row_shares=shares),
        rrb.TimePanel(timeline=TIME, playback_speed=speed, play_state="paused", state="collapsed"),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
    )


def _name(*parts: str) -> str:
    return str(rr.new_entity_path(list(parts)))


def _body(stage: Stage, machine: str, body: int) -> str:
    return _name(MACHINE, machine, stage.model.body(body).name or f"body {body}")


def _shapes(stage: Stage, replay: Replay) -> Iterator[tuple[str, list[Any]]]:
    """Each shape and its place in its body; those that a model moves once more, as its ghost."""
    model, data = stage.model, stage.data
    for body in np.flatnonzero(model.body_weldid == 0).tolist():
        stands = rr.Transform3D(translation=data.xpos[body], quaternion=data.xquat[body, XYZW])
        yield _body(stage, MEASURED, body), [stands]
    for i, shape, rgba in shapes(model):
        body, at, turned = int(model.geom_bodyid[i]), model.geom_pos[i], model.geom_quat[i, XYZW]
        looks = [(MEASURED, rgba, 1.0), (MODELLED, GHOST, BEHIND)]
        moves = replay.horizon and model.body_weldid[body]
        for machine, colour, scale in looks if moves else looks[:1]:
            place = rr.Transform3D(translation=at, quaternion=turned, scale=scale)
            yield f"{_body(stage, machine, body)}/{i}", [place, _drawn(model, i, shape, colour)]
    for axis in replay.axes:
        ball = rr.Points3D.from_fields(colors=MARK, radii=BALL * model.stat.extent)
        yield _name(MACHINE, SETPOINT, axis), [ball]


def _drawn(model: mujoco.MjModel, geom: int, shape: str, rgba: Any) -> Any:
    """A geom in its own frame."""
    size, colour = model.geom_size[geom], np.rint(255 * np.array(rgba)).astype(np.uint8)
    if shape == "mesh":
        mesh = int(model.geom_dataid[geom])
        faces = slice(model.mesh_faceadr[mesh], model.mesh_faceadr[mesh] + model.mesh_facenum[mesh])
        corners = model.mesh_vertadr[mesh] + model.mesh_face[faces].ravel()
        normals = model.mesh_normaladr[mesh] + model.mesh_facenormal[faces].ravel()
        places, upright = model.mesh_vert[corners], model.mesh_normal[normals]
        return rr.Mesh3D(vertex_positions=places, vertex_normals=upright, albedo_factor=colour)
    solid = {"colors": colour, "fill_mode": "solid"}
    if shape == "capsule":
        lower = [[0.0, 0.0, -size[1]]]
        return rr.Capsules3D(radii=size[0], lengths=2.0 * size[1], translations=lower, **solid)
    if shape == "cylinder":
        return rr.Cylinders3D(radii=size[0], lengths=2.0 * size[1], **solid)
    if shape == "ellipsoid":  # a sphere has one size
        return rr.Ellipsoids3D(half_sizes=[np.where(size, size, size[0])], **solid)
    if shape == "plane":  # without end where it has no size
        plane = 4.0  # of the machine: half the size of a plane without end
        size = np.array([*np.where(size[:2], size[:2], plane * model.stat.extent), 0.0])
    return rr.Boxes3D(half_sizes=[size], **solid)


def _motion(stage: Stage, replay: Replay, gain: float) -> Iterator[tuple[str, Any]]:
    """Where each body is in each frame, and each setpoint, where there is one."""
    machines = {MEASURED: stage.data, MODELLED: stage.ghost}
    poses = np.empty((len(machines), len(replay), stage.model.nbody, 7))
    marks = np.empty((len(replay.axes), len(replay), 3))
    for frame in range(len(replay)):
        stage.pose(replay, frame, gain)
        for i, data in enumerate(machines.values()):
            poses[i, frame] = np.hstack([data.xpos, data.xquat[:, XYZW]])
        for i, axis in enumerate(replay.axes):
            marks[i, frame] = stage.mark(axis)
    for i, machine in enumerate(machines if replay.horizon else [MEASURED]):
        for body in np.flatnonzero(stage.model.body_weldid).tolist():
            at, turned = np.split(poses[i, :, body], [3], axis=1)
            columns = rr.Transform3D.columns(translation=at, quaternion=turned)
            yield _body(stage, machine, body), columns
    for places, (axis, own) in zip(marks, replay.axes.items(), strict=True):
        known = np.isfinite(own.setpoint)
        points = rr.Points3D.columns(positions=places[known])
        yield _name(MACHINE, SETPOINT, axis), points.partition(known)


def _curves(axis: AxisReplay) -> dict[str, Mapping[str, Array]]:
    """The signals that an axis has, by what is drawn together with its unit."""
    units = axis.units
    every: dict[str, Mapping[str, Array]] = {
        f"{units.words('position')} ({units.position})": {
            MEASURED: axis.measured, MODELLED: axis.modelled, SETPOINT: axis.setpoint,
        },
        f"{units.words('force')} of each effect ({units.force})": axis.forces,
    }  # fmt: skip
    for strip in axis.strips:
        low, high = strip.range
        every[f"{strip.label} ({strip.unit})"] = {"lowest": low, "highest": high}
    known = {
        of: {name: curve for name, curve in curves.items() if np.isfinite(curve).any()}
        for of, curves in every.items()
    }
    return {of: curves for of, curves in known.items() if curves}
