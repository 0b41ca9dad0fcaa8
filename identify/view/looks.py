"""What a machine looks like whose file draws nothing: plain axes, and the links of an arm."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np

from identify.view.replay import Replay
from twin.model.machine import MachineModel
from twin.mujoco.mechanism import read_bodies
from twin.mujoco.mjcf import read_spec

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
