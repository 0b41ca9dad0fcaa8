"""The MuJoCo spec of a machine: its masses set, and the bodies of structure effects attached.

Of plain axes (``machine_spec``), and of axes that are joints of a mechanism (``jointed_spec``).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from twin.errors import CannotRun, InputError
from twin.model.bodies import mechanism_in
from twin.model.machine import AxisModel, MachineModel
from twin.model.units import LINEAR, ROTARY, AxisUnits
from twin.mujoco.callback import DrivenAxis
from twin.mujoco.mechanism import strip_passive
from twin.mujoco.reading import read_bodies, read_spec

# A joint of its own: no limits, whatever the defaults of the machine's file.
FREE = {
    "limited": mujoco.mjtLimited.mjLIMITED_FALSE,
    "actfrclimited": mujoco.mjtLimited.mjLIMITED_FALSE,
    "frictionloss": 0.0,
    "margin": 0.0,
}


@dataclass(frozen=True)
class Spring:
    """Spring and damper of an oscillator of unit mass: stiffness 1/s^2, damping 1/s."""

    stiffness: float
    damping: float

    @classmethod
    def of(cls, share: float, frequency: float, ratio: float, period: float) -> Spring:
        """Such that MuJoCo's step of ``period`` s oscillates and decays as the exact motion does.

        A step v += h (-k x - c v)/(1 + h c), x += h v has the poles exp(h (-D +- i w)), D and w the
        decay and frequency at ``frequency`` Hz and damping ``ratio``, for the k and c given here.
        Above a third of the sampling rate, and where with the ``share`` of mass that swings the
        free motion would be as fast, the spring is held where the step is stable.
        """
        angle = min(2.0 * math.pi * frequency * period, 3.0)
        grown = math.expm1(ratio * angle)
        half = math.sin(0.5 * math.sqrt(1.0 - ratio * ratio) * angle)
        stiffness = min(grown * grown + 4.0 * (1.0 + grown) * half * half, 2.0 * (1.0 - share))
        return cls(stiffness / period**2, math.expm1(2.0 * ratio * angle) / period)


@dataclass(frozen=True)
class Mount:
    """One axis of a machine's spec, for one effect.

    axis: name of its joint; joint: name of the joint to build, of the same type; mass: moved mass,
    kg, or moment of inertia, kg m^2, where ``rotary``.
    """

    spec: mujoco.MjSpec
    axis: str
    joint: str
    mass: float
    rotary: bool = False

    @property
    def units(self) -> AxisUnits:
        """Of the axis."""
        return ROTARY if self.rotary else LINEAR

    def hang(self, share: float, frequency: float, ratio: float, play: float = 0.0) -> None:
        """Take a share of the moved mass off the axis' body and hang it on a spring and damper.

        frequency (Hz) and damping ratio are those with the axis held; play (m) is the width within
        which the spring does not pull. Raises InputError where the body is not heavy enough.
        """
        slide = self.spec.joint(self.axis)
        body, load = slide.parent, share * self.mass
        own = body.inertia[0] if self.rotary else body.mass
        if load >= own:
            unit = self.units.mass
            raise InputError(
                f"axis {self.axis}: {self.joint} hangs {load:g} {unit} on a spring, but the axis "
                f"has only {own:g} {unit} of its own; give a smaller share of the moved mass"
            )
        spring = Spring.of(share, frequency, ratio, self.spec.option.timestep)
        hung = body.add_body(name=self.joint, pos=np.nan_to_num(body.ipos))
        hung.mass, hung.explicitinertial = body.mass * (load / own), True
        hung.inertia = np.asarray(body.inertia) * (load / own)
        if self.rotary:
            body.inertia = np.asarray(body.inertia) - hung.inertia
        body.mass -= hung.mass
        joint = hung.add_joint(name=self.joint, axis=slide.axis, type=slide.type, **FREE)
        joint.damping[0] = spring.damping * load
        if play == 0.0:
            joint.stiffness[0] = spring.stiffness * load
            return
        contact = self.spec.add_tendon(name=self.joint, springlength=[-0.5 * play, 0.5 * play])
        contact.wrap_joint(self.joint, 1.0)
        contact.stiffness[0] = spring.stiffness * load

    def stand(self, share: float, frequency: float, ratio: float) -> None:
        """Put what the axis stands on, up to the world, on a spring and damper along the axis.

        share: the moved mass over all that the spring carries; frequency (Hz) and damping ratio
        are those with the axis held. Raises InputError where the axis' guide alone is heavier.
        """
        frame = self.spec.joint(self.axis).parent
        while frame.parent.name != self.spec.worldbody.name:
            frame = frame.parent
        direction, guide = self._seen_from(frame)
        weight = self.mass * (1.0 - share) / share - guide
        if weight <= 0.0:
            unit = self.units.mass
            raise InputError(
                f"axis {self.axis}: {self.joint} leaves {weight + guide:g} {unit} for what the "
                f"axis stands on, of which its guide has {guide:g} {unit}; give a smaller share"
            )
        spring = Spring.of(share, frequency, ratio, self.spec.option.timestep)
        others = list(frame.joints)
        kind = self.spec.joint(self.axis).type
        joint = frame.add_joint(name=self.joint, axis=direction, type=kind, **FREE)
        joint.stiffness[0] = spring.stiffness * self.mass / share
        joint.damping[0] = spring.damping * self.mass / share
        if self.rotary:
            frame.mass, frame.inertia, frame.explicitinertial = 1.0, [weight] * 3, True
            return
        # Where both directions are on springs, the heavier has the difference on its joint alone.
        least = min(weight, frame.mass) if others else weight
        joint.armature = weight - least
        for other in others:
            other.armature += frame.mass - least
        frame.mass = least

    def _seen_from(self, frame: mujoco.MjsBody) -> tuple[NDArray[np.float64], float]:
        """The axis' direction in the frame's coordinates, and the mass between the two, kg."""
        model = self.spec.compile()
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        slide, body = model.joint(self.axis), self.spec.joint(self.axis).parent
        if body.id == frame.id:
            raise InputError(
                f"axis {self.axis}: {self.joint} needs a body that the axis stands on, but its "
                "body stands in the world; put it into another body of the MuJoCo file"
            )
        direction = data.xmat[frame.id].reshape(3, 3).T @ data.xaxis[slide.id]
        carried = model.body_subtreemass[frame.id] - model.body_subtreemass[body.id]
        if self.rotary:
            if body.parent.id != frame.id:
                raise InputError(
                    f"axis {self.axis}: {self.joint} needs the axis to turn on the body that "
                    "stands in the world; take out the bodies between"
                )
            return direction, 0.0
        return direction, float(carried - model.body_mass[frame.id])


# By whether the axis is rotary.
JOINTS = {False: mujoco.mjtJoint.mjJNT_SLIDE, True: mujoco.mjtJoint.mjJNT_HINGE}
DIRECTIONS = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0])  # of plain axes, in turn


def machine_spec(model: MachineModel) -> mujoco.MjSpec:
    """The MuJoCo spec of a machine with its moved masses set and its structure effects attached.

    A machine without MJCF becomes plain slides and hinges. Where one axis carries the other, it
    moves both masses. Raises InputError where the file lacks a joint or motor of an axis, where a
    joint is of the other kind, and where a mass leaves nothing for a body.
    """
    spec = read_spec(model.mjcf, model.mjcf_name or "") if model.mjcf else _plain_joints(model)
    spec.option.timestep = model.period
    # Higher-order integrators evaluate the forces within a sample, where states do not advance.
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_EULER
    for name in reversed(list(model.axes)):
        joint, motor = spec.joint(name), spec.actuator(f"motor_{name}")
        if joint is None or motor is None:
            raise InputError(
                f"{model.mjcf_name}: has no joint '{name}' with a motor 'motor_{name}'; "
                "an axis needs both"
            )
        _require_bare(model, name, joint, motor)
        if model.axes[name].rotary:
            _set_inertia(model, spec, name)
        else:
            _set_mass(model, spec, name)
    for name, axis in model.axes.items():
        for f in axis.effects:
            if f.effect.attach is not None and f.effect.is_present(f.values):
                joint_name = attached_joint(name, f.effect.name)
                f.effect.attach(Mount(spec, name, joint_name, axis.mass, axis.rotary), f.values)
    return spec


def add_motor(spec: mujoco.MjSpec, axis: str, joint: str) -> None:
    """Add the motor of an axis: its command is the force on the joint, or on the tendon."""
    kind = mujoco.mjtTrn.mjTRN_JOINT if spec.joint(joint) else mujoco.mjtTrn.mjTRN_TENDON
    spec.add_actuator(name=f"motor_{axis}", target=joint, trntype=kind).gear[0] = 1.0


def attached_joint(axis: str, effect: str) -> str:
    """Name of the joint that a structure effect builds for an axis."""
    return f"{effect}_{axis}"


def _set_mass(model: MachineModel, spec: mujoco.MjSpec, name: str) -> None:
    """Give the body of a linear axis what is left of the moved mass beside all that it carries."""
    body, moved = spec.joint(name).parent, model.axes[name].weighed.mass
    bodies = [joint.parent for joint in map(spec.joint, model.axes) if joint is not None]
    for bare in (b for b in bodies if not b.explicitinertial and not b.geoms):
        bare.mass, bare.inertia, bare.explicitinertial = 1.0, [1.0, 1.0, 1.0], True
    made = spec.compile()
    own = made.body(body.id)
    inside = float(made.body_subtreemass[body.id] - own.mass[0])
    if moved - inside <= 0:
        raise InputError(
            f"axis {name}: mass {moved:g} kg is not above the {inside:g} kg of what it carries; "
            "give the whole moved mass"
        )
    if not body.explicitinertial:  # a mass of geoms would be made of them anew
        body.ipos, body.iquat, body.inertia = own.ipos, own.iquat, own.inertia
        body.explicitinertial = True
    body.mass = moved - inside


def _set_inertia(model: MachineModel, spec: mujoco.MjSpec, name: str) -> None:
    """Give the body of a rotary axis its moment of inertia about the hinge; it keeps its mass."""
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
    body.inertia = [axis.weighed.mass] * 3


def _require_bare(
    model: MachineModel, axis: str, joint: mujoco.MjsJoint, motor: mujoco.MjsActuator
) -> None:
    """Require a joint of the axis' kind, without what belongs in the machine model, and gear 1."""
    units = model.axes[axis].units
    if joint.type != JOINTS[units.rotary]:
        wanted = "hinge" if units.rotary else "slide"
        raise InputError(
            f"{model.mjcf_name}: joint '{axis}' is not a {wanted}, but the axis is {units.kind} "
            f"({units.mass_name} in {units.mass}); change one of them"
        )
    for name in ("damping", "stiffness", "frictionloss", "armature"):
        if np.any(getattr(joint, name)):
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
        add_motor(spec, name, name)
    return spec


def plain(model: MachineModel, spec: mujoco.MjSpec) -> list[DrivenAxis]:
    """The axes of such a spec."""
    return [
        DrivenAxis(name, f"motor_{name}", axis.mass, base=_base(spec, name, axis))
        for name, axis in model.axes.items()
    ]


def _base(spec: mujoco.MjSpec, name: str, axis: AxisModel) -> str:
    built = [spec.joint(attached_joint(name, f.effect.name)) for f in axis.effects]
    return next((j.name for j in built if j and _carries(j.parent, name)), "")


def jointed_spec(model: MachineModel) -> mujoco.MjSpec:
    """The spec of a machine whose axes are joints: its bodies, a motor each, and the rotors.

    The file's own motors, sensors and limits are not there: the machine model has its own. Raises
    CannotRun for an effect that hangs bodies on a joint.
    """
    name = model.mjcf_name or ""
    spec = read_bodies(model.mjcf or "", name)
    for part in (*spec.actuators, *spec.sensors, *spec.keys):
        spec.delete(part)
    spec.option.timestep = model.period
    for part in strip_passive(spec, model.joints.values()):
        part.limited = mujoco.mjtLimited.mjLIMITED_FALSE
    for tie in spec.equalities:
        tie.solref[:] = 2.0 * model.period, 1.0  # as stiff as can be: its give is not identified
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_EULER
    for axis, own in model.axes.items():
        for f in own.effects:
            if f.effect.attach is not None and f.effect.is_present(f.values):
                raise CannotRun(
                    f"axis {axis}: {f.effect.name} hangs bodies on a joint of {name}, which is not "
                    "simulated; put the body and its spring into that file"
                )
        part = spec.joint(own.joint) or spec.tendon(own.joint)
        part.armature = own.weighed.mass - own.mass
        add_motor(spec, axis, own.joint or axis)
    return spec


def driven(model: MachineModel) -> list[DrivenAxis]:
    """The axes of such a spec.

    Friction stops a joint by the least inertia that it may have: more than it has would throw it
    back and forth, less stops it a little later.
    """
    found = mechanism_in(model)
    return [
        DrivenAxis(axis.joint or name, f"motor_{name}", float(least), axis.weighed.mass - axis.mass)
        for (name, axis), least in zip(model.axes.items(), found.freed, strict=True)
    ]
