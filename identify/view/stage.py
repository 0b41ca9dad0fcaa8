"""What the machine looks like: its MuJoCo model, posed as a replay says; shapes of plain axes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import mujoco
import numpy as np

from identify.view.replay import Replay
from twin.errors import InputError
from twin.mujoco.mjcf import machine_spec
from twin.signals import Array

LARGEST = 1280  # pixels of a picture
GHOST = (0.20, 0.55, 1.00, 0.40)  # of the modelled machine, red green blue alpha
MARK = (1.00, 0.45, 0.05, 1.0)  # of the setpoint
GREY, DARK, BLUE = (0.70, 0.72, 0.75, 1), (0.25, 0.27, 0.30, 1), (0.25, 0.42, 0.60, 1)
BEHIND = 0.998  # of its size, at which a ghost that is where the machine is lies hidden in it
SHADOW = 1024  # pixels of its map: what a display without a graphics card draws in time
ABOVE = 0.04  # of the machine, by which a mark stands above its axis
END = 0.9  # of half the length of a shape: where its mark stands


@dataclass(frozen=True, eq=False)
class Stage:
    """A compiled model. at: address of each axis in qpos; marks: by axis a body and a place in it.

    data: the machine as measured; ghost: as modelled; aim: as commanded.
    """

    model: mujoco.MjModel
    at: Mapping[str, int]
    marks: Mapping[str, tuple[int, Array]]
    data: mujoco.MjData
    ghost: mujoco.MjData
    aim: mujoco.MjData

    @classmethod
    def of(cls, replay: Replay) -> Stage:
        """The machine of a replay, at rest. Raises InputError where its MJCF file does not fit."""
        model = _spec(replay).compile()
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        at = {a: int(model.joint(a).qposadr[0]) for a in replay.machine.axes}
        others = (mujoco.MjData(model) for _ in range(2))
        return cls(model, at, {a: _mark(model, data, a) for a in replay.axes}, data, *others)

    def pose(self, replay: Replay, frame: int, gain: float) -> None:
        """Stand as in a frame, with the differences to the measured machine enlarged."""
        for axis, own in replay.axes.items():
            measured = own.measured[frame]
            self.data.qpos[self.at[axis]] = measured
            for data, other in ((self.ghost, own.modelled), (self.aim, own.setpoint)):
                # Nothing is drawn where nothing is known: see ``drawn``.
                data.qpos[self.at[axis]] = measured + gain * np.nan_to_num(other[frame] - measured)
        for data in (self.data, self.ghost, self.aim):
            mujoco.mj_kinematics(self.model, data)

    def draw_others(
        self, replay: Replay, frame: int, scene: mujoco.MjvScene, ghost: bool = True
    ) -> None:
        """Add the modelled machine, where it is to be seen, and the setpoints' marks to a scene."""
        if ghost and any(np.isfinite(own.modelled[frame]) for own in replay.axes.values()):
            first = scene.ngeom
            mujoco.mjv_addGeoms(
                self.model, self.ghost, mujoco.MjvOption(), mujoco.MjvPerturb(),
                mujoco.mjtCatBit.mjCAT_DYNAMIC, scene,
            )  # fmt: skip
            for geom in (scene.geoms[i] for i in range(first, scene.ngeom)):
                geom.rgba[:], geom.matid, geom.transparent = GHOST, -1, 1
                geom.size[:] = BEHIND * np.asarray(geom.size)
        size = 0.012 * self.model.stat.extent
        for axis, (body, place) in self.marks.items():
            if np.isfinite(replay.axes[axis].setpoint[frame]) and scene.ngeom < scene.maxgeom:
                at = self.aim.xpos[body] + self.aim.xmat[body].reshape(3, 3) @ place
                mujoco.mjv_initGeom(
                    scene.geoms[scene.ngeom], mujoco.mjtGeom.mjGEOM_SPHERE, np.full(3, size), at,
                    np.eye(3).ravel(), np.array(MARK, dtype=np.float32),
                )  # fmt: skip
                scene.ngeom += 1


def _spec(replay: Replay) -> mujoco.MjSpec:
    """The machine without what effects attach, which no log tells the motion of."""
    machine = replay.machine
    bare = {name: replace(axis, effects=()) for name, axis in machine.axes.items()}
    # Where a motion is imposed there is no mass, but a body has one.
    bare = {name: replace(a, mass=a.mass or 1.0) for name, a in bare.items()}
    if machine.joints:
        raise InputError(
            f"{machine.name}: its axes are joints of {machine.mjcf_name}, which is not shown with "
            "motions beside each other; see that file in MuJoCo's own viewer, and `twin compare`"
        )
    spec = machine_spec(replace(machine, axes=bare))
    if not machine.mjcf:
        _dress(spec, replay)
    looks = spec.visual
    looks.global_.offwidth = max(looks.global_.offwidth, LARGEST)
    looks.global_.offheight = max(looks.global_.offheight, LARGEST)
    looks.quality.shadowsize = min(looks.quality.shadowsize, SHADOW)
    return spec


def _dress(spec: mujoco.MjSpec, replay: Replay) -> None:
    """Give plain axes their shapes: a rail with a carriage, or a disc with a hand."""
    spans = dict(_spans(replay))
    slides = [high - low for a, (low, high) in spans.items() if not replay.machine.axes[a].rotary]
    size = max(slides, default=1.0)
    box, cylinder = mujoco.mjtGeom.mjGEOM_BOX, mujoco.mjtGeom.mjGEOM_CYLINDER

    def add(body: mujoco.MjsBody, kind: mujoco.mjtGeom, half: list, at: list, rgba: tuple) -> None:
        shape = body.add_geom(type=kind, rgba=rgba, pos=size * np.array(at), mass=0.0)
        shape.size[: len(half)] = size * np.array(half)

    for i, (name, (low, high)) in enumerate(spans.items()):
        frame, body, joint = spec.body(f"frame_{name}"), spec.body(name), spec.joint(name)
        frame.pos = [0.0, -0.5 * size * i, 0.0]
        if replay.machine.axes[name].rotary:
            joint.axis = [0.0, 0.0, 1.0]
            add(frame, cylinder, [0.10, 0.03], [0, 0, 0.03], DARK)
            add(body, cylinder, [0.20, 0.02], [0, 0, 0.09], GREY)
            add(body, box, [0.09, 0.015, 0.012], [0.1, 0, 0.12], BLUE)
            continue
        joint.axis = [1.0, 0.0, 0.0]
        frame.pos[0] = -0.5 * (low + high)
        middle, half = 0.5 * (low + high) / size, 0.5 * (high - low) / size
        add(frame, box, [half + 0.16, 0.05, 0.02], [middle, 0, 0.02], DARK)
        add(body, box, [0.12, 0.09, 0.03], [0, 0, 0.07], GREY)
        add(body, box, [0.09, 0.06, 0.015], [0, 0, 0.115], BLUE)
    centre = np.array([0.0, -0.25 * size * (len(spans) - 1), 0.05 * size])
    spec.stat.center, spec.stat.extent = (
        centre,
        size * max(1.2 if slides else 0.6, 0.6 * len(spans)),
    )
    spec.worldbody.add_light(pos=[0, 0, 3 * size], dir=[0.2, 0.3, -1], type=1)
    away = spec.stat.extent * np.array([0.4, -1.5, 1.03])
    spec.worldbody.add_camera(
        name="overview", fovy=36, pos=centre + away, xyaxes=[0.967, 0.254, 0, -0.14, 0.534, 0.834]
    )
    spec.add_texture(
        name="sky", type=mujoco.mjtTexture.mjTEXTURE_SKYBOX, width=64, height=384,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT, rgb1=[0.5, 0.56, 0.63],
        rgb2=[0.8, 0.82, 0.85],
    )  # fmt: skip


def _spans(replay: Replay) -> Iterator[tuple[str, tuple[float, float]]]:
    """Lowest and highest position of each axis: of its travel, or where that is not known, seen."""
    for name, axis in replay.machine.axes.items():
        seen = replay.axes[name].measured if name in replay.axes else np.array([0.0, 1.0])
        low, high = axis.hardware.travel or (seen.min(), seen.max())
        yield name, (float(low), float(max(high, low + 1e-6)))


def _mark(model: mujoco.MjModel, data: mujoco.MjData, axis: str) -> tuple[int, Array]:
    """The body that an axis moves, and the place in it above an end of its largest shape."""
    body = int(model.joint(axis).bodyid[0])
    own = [i for i in range(model.ngeom) if model.geom_bodyid[i] == body]
    place, top = np.array(data.xpos[body]), -np.inf
    for i in sorted(own, key=lambda i: model.geom_aabb[i][3:].prod()):
        centre, half = model.geom_aabb[i].reshape(2, 3)
        turned = data.geom_xmat[i].reshape(3, 3)
        place, reach = data.geom_xpos[i] + turned @ centre, np.abs(turned) @ half
        top = max(top, place[2] + reach[2])
        along = int(np.argmax(reach[:2]))
        place[along] -= END * reach[along]
    place[2] = max(top, place[2]) + ABOVE * model.stat.extent
    return body, data.xmat[body].reshape(3, 3).T @ (place - data.xpos[body])
