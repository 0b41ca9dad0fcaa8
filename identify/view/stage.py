"""The machine as it is shown: its MuJoCo model, posed as a replay says."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import mujoco
import numpy as np

from identify.view.replay import Replay
from twin.model.bodies import mechanism_in
from twin.model.machine import MachineModel
from twin.mujoco.reading import read_bodies, read_spec
from twin.signals import Array
from twin.simulation.spec import machine_spec

GHOST = (0.20, 0.55, 1.00, 0.40)  # of the modelled machine, red green blue alpha
MARK = (1.00, 0.45, 0.05, 1.0)  # of the setpoint
BEHIND = 0.998  # of its size, at which a ghost that is where the machine is lies hidden in it
BALL = 0.012  # of the machine: the radius of a mark
SHAPES = {
    mujoco.mjtGeom.mjGEOM_PLANE: "plane",
    mujoco.mjtGeom.mjGEOM_SPHERE: "ellipsoid",
    mujoco.mjtGeom.mjGEOM_ELLIPSOID: "ellipsoid",
    mujoco.mjtGeom.mjGEOM_CAPSULE: "capsule",
    mujoco.mjtGeom.mjGEOM_CYLINDER: "cylinder",
    mujoco.mjtGeom.mjGEOM_BOX: "box",
    mujoco.mjtGeom.mjGEOM_MESH: "mesh",
}


@dataclass(frozen=True, eq=False)
class Stage:
    """A compiled model. marks: by axis a body and a place in it.

    moves: by joint the ratios of the axes of which its position is a sum, and what is added.
    data: the machine as measured; ghost: as modelled; aim: as commanded.
    """

    model: mujoco.MjModel
    moves: Mapping[int, tuple[Mapping[str, float], float]]
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
        machine = replay.machine
        joints, moves = _joints(machine, model)
        others = (mujoco.MjData(model) for _ in range(2))
        marks = {axis: _mark(model, data, joints[axis]) for axis in replay.axes}
        return cls(model, moves, marks, data, *others)

    def pose(self, replay: Replay, frame: int, gain: float) -> None:
        """Stand as in a frame, with the differences to the measured machine enlarged."""
        shown = (self.data, self.ghost, self.aim)
        places: dict[str, Array] = {}
        for axis, own in replay.axes.items():
            measured = own.measured[frame]
            off = np.array([0.0, own.modelled[frame] - measured, own.setpoint[frame] - measured])
            # Nothing is drawn where nothing is known: see ``drawn``.
            places[axis] = measured + gain * np.nan_to_num(off)
        for joint, (ratios, begin) in self.moves.items():
            at = begin + np.sum([ratio * places[axis] for axis, ratio in ratios.items()], axis=0)
            for data, position in zip(shown, at, strict=True):
                data.qpos[self.model.jnt_qposadr[joint]] = position
        for data in shown:
            mujoco.mj_kinematics(self.model, data)

    def mark(self, axis: str) -> Array:
        """Where the mark of the setpoint of an axis is in this pose, (3,) m."""
        body, place = self.marks[axis]
        return np.array(self.aim.xpos[body] + self.aim.xmat[body].reshape(3, 3) @ place)

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
        size = BALL * self.model.stat.extent
        for axis in self.marks:
            if np.isfinite(replay.axes[axis].setpoint[frame]) and scene.ngeom < scene.maxgeom:
                mujoco.mjv_initGeom(
                    scene.geoms[scene.ngeom], mujoco.mjtGeom.mjGEOM_SPHERE, np.full(3, size),
                    self.mark(axis), np.eye(3).ravel(), np.array(MARK, dtype=np.float32),
                )  # fmt: skip
                scene.ngeom += 1


def _joints(
    machine: MachineModel, model: mujoco.MjModel
) -> tuple[dict[str, str], dict[int, tuple[dict[str, float], float]]]:
    """The joint at which each axis is marked, and how the joints move with the axes."""
    if not machine.joints:
        own = {axis: axis for axis in machine.axes}
        return own, {int(model.joint(axis).id): ({axis: 1.0}, 0.0) for axis in own}
    found = mechanism_in(machine)
    rows = zip(found.transmission.by.tolist(), found.transmission.offset.tolist(), strict=True)
    return dict(zip(found.axes, found.joints, strict=True)), {
        joint: ({a: r for a, r in zip(found.axes, row, strict=True) if r}, begin)
        for joint, (row, begin) in enumerate(rows)
    }


def _spec(replay: Replay) -> mujoco.MjSpec:
    """The machine without what effects attach, which no log tells the motion of."""
    largest = 1280  # pixels of a picture
    machine = replay.machine
    if machine.joints:
        spec = joints_spec(machine)
    else:
        # Where a motion is imposed there is no mass, but a body has one.
        axes = machine.axes.items()
        bare = {name: replace(a, effects=(), mass=a.mass or 1.0) for name, a in axes}
        spec = machine_spec(replace(machine, axes=bare))
        if not machine.mjcf:
            dress(spec, replay)
    looks = spec.visual
    looks.global_.offwidth = max(looks.global_.offwidth, largest)
    looks.global_.offheight = max(looks.global_.offheight, largest)
    shadow = 1024  # pixels of its map: what a display without a graphics card draws in time
    looks.quality.shadowsize = min(looks.quality.shadowsize, shadow)
    return spec


def _mark(model: mujoco.MjModel, data: mujoco.MjData, joint: str) -> tuple[int, Array]:
    """The body that a joint moves, and the place in it above an end of its largest shape."""
    body = int(model.joint(joint).bodyid[0])
    own = [i for i in range(model.ngeom) if model.geom_bodyid[i] == body]
    place, top, centres = np.array(data.xpos[body]), -np.inf, []
    for i in sorted(own, key=lambda i: model.geom_aabb[i][3:].prod()):
        centre, half = model.geom_aabb[i].reshape(2, 3)
        turned = data.geom_xmat[i].reshape(3, 3)
        place, reach = data.geom_xpos[i] + turned @ centre, np.abs(turned) @ half
        top = max(top, place[2] + reach[2])
        centres.append(place.copy())
        along = int(np.argmax(reach[:2]))
        # at the end where the other shapes are, as the hand of a disc; of those alike at the first
        side = np.sign(np.mean(centres, axis=0)[along] - place[along] - 1e-9 * reach[along])
        place[along] += 0.9 * side * reach[along]  # of half its length: where its mark stands
    above = 0.04  # of the machine, by which a mark stands above its axis
    place[2] = max(top, place[2]) + above * model.stat.extent
    return body, data.xmat[body].reshape(3, 3).T @ (place - data.xpos[body])


def shapes(model: mujoco.MjModel) -> Iterator[tuple[int, str, Array]]:
    """The geoms that are seen: number, shape, and red, green, blue, alpha."""
    for i in range(model.ngeom):
        shape, rgba = SHAPES.get(mujoco.mjtGeom(model.geom_type[i])), _colour(model, i)
        visible = 3  # groups of geoms that MuJoCo shows by default
        clear = 0.05  # alpha below which a shape is not drawn
        if shape and rgba[3] >= clear and model.geom_group[i] < visible:
            yield i, shape, rgba


def camera(model: mujoco.MjModel, data: mujoco.MjData) -> tuple[Array, float]:
    """Where the first camera of the model stands, or MuJoCo's, and degrees from top to bottom."""
    if model.ncam:
        return np.array(data.cam_xpos[0]), float(model.cam_fovy[0])
    away = 1.5 * model.stat.extent * np.array([0.5, -0.7, 0.5])
    return np.array(model.stat.center + away), 45.0


def _colour(model: mujoco.MjModel, geom: int) -> Array:
    """Red, green, blue, alpha of a geom: of its material with the mean of its texture."""
    material = int(model.geom_matid[geom])
    if material < 0:
        return np.asarray(model.geom_rgba[geom], dtype=float)
    rgba = np.array(model.mat_rgba[material], dtype=float)
    texture = int(model.mat_texid[material, mujoco.mjtTextureRole.mjTEXROLE_RGB])
    if texture >= 0:
        channels, begin = int(model.tex_nchannel[texture]), int(model.tex_adr[texture])
        end = begin + channels * int(model.tex_width[texture]) * int(model.tex_height[texture])
        mean = model.tex_data[begin:end].reshape(-1, channels).mean(axis=0) / 255.0
        rgba[:3] *= mean[:3] if channels >= 3 else mean[0]
    return rgba


# --- what a machine looks like whose file draws nothing -------------------------------------------

GREY, DARK, BLUE = (0.70, 0.72, 0.75, 1), (0.25, 0.27, 0.30, 1), (0.25, 0.42, 0.60, 1)


def joints_spec(machine: MachineModel) -> mujoco.MjSpec:
    """The user's own file; where its shapes cannot be had, a rod from each joint to the next.

    Raises InputError where it cannot be read.
    """
    text, name = machine.mjcf or "", machine.mjcf_name or ""
    spec = read_spec(text, name)
    try:
        drawn = bool(spec.compile().ngeom)
    except ValueError:  # a mesh that is not there
        drawn = False
    if not drawn:
        spec = read_bodies(text, name)
        _rods(spec)
    if not spec.lights:
        _light(spec, spec.compile().stat.extent)
    return spec


def _rods(spec: mujoco.MjSpec) -> None:
    """Draw each body as rods from its joint to those that it carries, or beyond its centre."""
    bodies = [
        (body, [np.array(child.pos) for child in body.bodies] or [2.0 * np.array(body.ipos)])
        for body in spec.bodies[1:]
    ]
    links = [end for body, ends in bodies if body.joints or not body.bodies for end in ends]
    lengths = [float(np.linalg.norm(end)) for end in links if end.any()]
    thick = 0.09 * float(np.mean(lengths or [1.0]))  # of the mean length of links, that of a link
    capsule, cylinder = mujoco.mjtGeom.mjGEOM_CAPSULE, mujoco.mjtGeom.mjGEOM_CYLINDER
    for body, ends in bodies:
        for end in ends:
            if np.linalg.norm(end) > thick:
                rod = body.add_geom(type=capsule, rgba=GREY, fromto=[0, 0, 0, *end], mass=0.0)
                rod.size[0] = 0.5 * thick
        for joint in body.joints:
            along = thick * np.array(joint.axis) / np.linalg.norm(joint.axis)
            fromto = [*(joint.pos - along), *(joint.pos + along)]
            axle = body.add_geom(type=cylinder, rgba=BLUE, fromto=fromto, mass=0.0)
            axle.size[0] = thick


def _light(spec: mujoco.MjSpec, size: float) -> None:
    """A light from above, and a bright sky."""
    spec.worldbody.add_light(pos=[0, 0, 3 * size], dir=[0.2, 0.3, -1], type=1)
    spec.add_texture(
        name="sky", type=mujoco.mjtTexture.mjTEXTURE_SKYBOX, width=64, height=384,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT, rgb1=[0.5, 0.56, 0.63],
        rgb2=[0.8, 0.82, 0.85],
    )  # fmt: skip


def dress(spec: mujoco.MjSpec, replay: Replay) -> None:
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
    spec.stat.center = centre
    spec.stat.extent = size * max(1.2 if slides else 0.6, 0.6 * len(spans))
    _light(spec, size)
    away = spec.stat.extent * np.array([0.4, -1.5, 1.03])
    spec.worldbody.add_camera(
        name="overview", fovy=36, pos=centre + away, xyaxes=[0.967, 0.254, 0, -0.14, 0.534, 0.834]
    )


def _spans(replay: Replay) -> Iterator[tuple[str, tuple[float, float]]]:
    """Lowest and highest position of each axis: of its travel, or where that is not known, seen."""
    for name, axis in replay.machine.axes.items():
        seen = replay.axes[name].measured if name in replay.axes else np.array([0.0, 1.0])
        low, high = axis.hardware.travel or (seen.min(), seen.max())
        yield name, (float(low), float(max(high, low + 1e-6)))
