"""The MuJoCo model of a machine: its masses set and the bodies of structure effects attached."""

from __future__ import annotations

import mujoco
import numpy as np

from twin.errors import InputError
from twin.model.machine import AxisModel, MachineModel
from twin.mujoco.bodies import Mount

# By whether the axis is rotary.
JOINTS = {False: mujoco.mjtJoint.mjJNT_SLIDE, True: mujoco.mjtJoint.mjJNT_HINGE}
DIRECTIONS = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0])  # of plain axes, in turn


def machine_spec(model: MachineModel) -> mujoco.MjSpec:
    """The MuJoCo spec of a machine with its moved masses set and its structure effects attached.

    A machine without MJCF becomes plain slides and hinges. Where one axis carries the other, it
    moves both masses. Raises InputError where the file lacks a joint or motor of an axis, where a
    joint is of the other kind, and where a mass leaves nothing for a body.
    """
    spec = _read_mjcf(model) if model.mjcf else _plain_joints(model)
    spec.option.timestep = model.period
    # Higher-order integrators evaluate the forces within a sample, where states do not advance.
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_EULER
    carried: dict[str, float] = {}
    for name in reversed(list(model.axes)):
        joint = spec.joint(name)
        if joint is None or spec.actuator(f"motor_{name}") is None:
            raise InputError(
                f"{model.mjcf_name}: has no joint '{name}' with a motor 'motor_{name}'; "
                "an axis needs both"
            )
        _require_bare(model, name, joint, spec.actuator(f"motor_{name}"))
        if model.axes[name].rotary:
            carried[name] = _set_inertia(model, spec, name)
            continue
        inside = sum(m for other, m in carried.items() if _carries(joint.parent, other))
        moved = model.axes[name].mass + _added_mass(model.axes[name])
        if moved - inside <= 0:
            raise InputError(
                f"axis {name}: mass {moved:g} kg is not above the {inside:g} kg of "
                "the axis that it carries; give the whole moved mass"
            )
        joint.parent.mass = carried[name] = moved - inside
    for name, axis in model.axes.items():
        for f in axis.effects:
            if f.effect.attach is not None and f.effect.is_present(f.values):
                joint_name = attached_joint(name, f.effect.name)
                f.effect.attach(Mount(spec, name, joint_name, axis.mass, axis.rotary), f.values)
    return spec


def attached_joint(axis: str, effect: str) -> str:
    """Name of the joint that a structure effect builds for an axis."""
    return f"{effect}_{axis}"


def _added_mass(axis: AxisModel) -> float:
    """What the effects add to the moved mass, kg."""
    parts = [f.effect.added_mass(f.values) for f in axis.effects if f.effect.added_mass]
    return axis.mass * sum(parts)


def _set_inertia(model: MachineModel, spec: mujoco.MjSpec, name: str) -> float:
    """Give the body of a rotary axis its moment of inertia about the hinge; its mass, kg.

    Raises InputError where the hinge carries another axis.
    """
    axis, joint = model.axes[name], spec.joint(name)
    for other in model.axes:
        if _carries(joint.parent, other):
            raise InputError(
                f"{model.mjcf_name}: the rotary axis {name} carries axis {other}, which is not "
                "modelled; put the rotary axis on top of the other"
            )
    mass = float(spec.compile().body(joint.parent.name).mass[0]) if model.mjcf else 1.0
    body = joint.parent
    body.mass, body.ipos, body.explicitinertial = mass, joint.pos, True
    body.inertia = [axis.mass + _added_mass(axis)] * 3
    return mass


def _read_mjcf(model: MachineModel) -> mujoco.MjSpec:
    try:
        return mujoco.MjSpec.from_string(model.mjcf)
    except ValueError as error:
        raise InputError(
            f"{model.mjcf_name}: is not an MJCF file that MuJoCo reads: {error}"
        ) from error


def _require_bare(
    model: MachineModel, axis: str, joint: mujoco.MjsJoint, motor: mujoco.MjsActuator
) -> None:
    """Friction, damping and springs belong in the machine model, where both simulations see them.

    The joint must be of the axis' kind.
    """
    units = model.axes[axis].units
    if joint.type != JOINTS[units.rotary]:
        wanted = "hinge" if units.rotary else "slide"
        raise InputError(
            f"{model.mjcf_name}: joint '{axis}' is not a {wanted}, but the axis is {units.kind} "
            f"({units.mass_name} in {units.mass}); change one of them"
        )
    own = {
        "damping": np.any(joint.damping),
        "stiffness": np.any(joint.stiffness),
        "frictionloss": np.any(joint.frictionloss),
        "armature": np.any(joint.armature),
    }
    for name, present in own.items():
        if present:
            raise InputError(
                f"{model.mjcf_name}: joint '{axis}' has {name} of its own; remove it and give the "
                "axis an effect instead"
            )
    if motor.gear[0] != 1.0:
        raise InputError(
            f"{model.mjcf_name}: motor_{axis} has gear {motor.gear[0]:g}; the command is "
            f"in {units.force}, give gear 1"
        )
    motor.ctrllimited = mujoco.mjtLimited.mjLIMITED_FALSE  # the control loop limits the force


def _carries(body: mujoco.MjsBody, joint: str) -> bool:
    return any(j.name == joint for child in body.bodies for j in child.joints) or any(
        _carries(child, joint) for child in body.bodies
    )


def _plain_joints(model: MachineModel) -> mujoco.MjSpec:
    """A slide or a hinge for each axis, beside each other, on frames of their own; no gravity."""
    spec = mujoco.MjSpec()
    spec.option.gravity = [0.0, 0.0, 0.0]
    for i, (name, axis) in enumerate(model.axes.items()):
        frame = spec.worldbody.add_body(name=f"frame_{name}")
        frame.inertia, frame.explicitinertial = [1.0, 1.0, 1.0], True
        body = frame.add_body(name=name)
        body.add_joint(name=name, type=JOINTS[axis.rotary], axis=DIRECTIONS[i % len(DIRECTIONS)])
        body.mass, body.inertia, body.explicitinertial = 1.0, [1.0, 1.0, 1.0], True
        motor = spec.add_actuator(
            name=f"motor_{name}", target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT
        )
        motor.gear[0] = 1.0
    return spec
