"""MJCF: the machine's own MuJoCo file with what its joints can hold of the model.

Friction, damping, springs and rotor inertia are attributes of a joint or a tendon; each effect says
which of them hold it (``Effect.joint_attributes``). The text of the file stays as it is, but for
these, and for those of joints that are no axes, whose forces are among the axes'. What they lose of
an effect is told along logs: the force that it makes in the model less that of

    -frictionloss sgn(v) - damping v - stiffness (q - springref)

Where a DC motor of MuJoCo drives the joint, that motor holds LuGre friction as it is.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from twin.effect import Kind
from twin.errors import InputError
from twin.export import Exported, Exporter, Held, Loss, Remark
from twin.feedforward import imposed
from twin.logs import Log
from twin.model.machine import AxisModel, MachineModel
from twin.mujoco.mechanism import PASSIVE
from twin.mujoco.mjcf import read_spec
from twin.mujoco.written import in_mjcf, with_joint, with_motor
from twin.signals import Array, between

UNKNOWN = "a joint of MuJoCo holds no such effect; how large it is, no position alone tells"


def export(model: MachineModel, logs: Mapping[str, Log]) -> Exported:
    """The MJCF file with the joints' attributes; of a URDF file the MJCF file that it makes."""
    if model.mjcf is None:
        raise InputError(
            f"{model.name}: has no MuJoCo file to write back; give the model mujoco = 'robot.xml', "
            "or begin with `twin new LOG --mjcf robot.xml`"
        )
    name = model.mjcf_name or "model.xml"
    text = in_mjcf(model.mjcf, name)
    spec = read_spec(text, name)
    at_motor = {a: _at_motor(own, _gear(spec, own.joint or a)) for a, own in model.axes.items()}
    for axis, own in model.axes.items():
        text = _with_attributes(text, name, spec, axis, own, at_motor[axis])
    if model.joints:
        for moved in (j for j in spec.joints if j.name not in model.joints.values()):
            text = with_joint(text, moved.name, _changed(moved, {}))
    held = {axis: _judged(model, axis, logs, bool(at_motor[axis])) for axis in model.axes}
    held = {
        axis: replace(found, taken_out=tuple(_taken_out(spec, axis, model.axes[axis])))
        for axis, found in held.items()
    }
    return Exported({f"{Path(name).stem}.xml": text}, held)


def _taken_out(spec: Any, axis: str, own: AxisModel) -> Iterator[Remark]:
    """What the file has of a joint or tendon, and the model has not."""
    joint, wanted = own.joint or axis, attributes_of(own)
    there = spec.joint(joint) or spec.tendon(joint)
    for key in PASSIVE:
        value = float(np.ravel(getattr(there, key))[0])
        if value != 0.0 and not wanted.get(key):
            text = f"{value:g} of the file is taken out, as no effect of the model is it"
            yield Remark(axis, key, text)


def attributes_of(axis: AxisModel) -> dict[str, float]:
    """The attributes of the joint that hold the effects of an axis, those that are not zero."""
    found: dict[str, float] = {}
    for f in axis.effects:
        if f.effect.joint_attributes is not None:
            for key, value in f.effect.joint_attributes(f.values).items():
                found[key] = found.get(key, 0.0) + value
    return found


def _with_attributes(
    text: str, name: str, spec: Any, axis: str, own: AxisModel, at_motor: Mapping[str, str]
) -> str:
    """The text with the attributes of one axis; what was there of friction and springs goes.

    spec: of the file. at_motor: the attributes of the joint's motor that hold its friction.
    """
    joint, wanted = own.joint or axis, attributes_of(own)
    if at_motor:
        text = with_motor(text, joint, at_motor)
        wanted.pop("frictionloss", None)
    rest = wanted.pop("springref", None)
    if (there := spec.joint(joint)) is not None:
        new = _changed(there, wanted)
        if rest is not None:
            in_degrees = spec.compiler.degree and own.rotary
            new["springref"] = np.degrees(rest) if in_degrees else rest
        return with_joint(text, joint, new)
    if (tendon := spec.tendon(joint)) is not None:
        length = {} if rest is None else {"springlength": rest}
        return with_joint(text, joint, _changed(tendon, wanted) | length, "fixed")
    raise InputError(f"{name}: has no joint '{joint}', which is axis {axis}; name them alike")


def _changed(there: Any, wanted: Mapping[str, float]) -> dict[str, float]:
    """The attributes of a joint or a tendon that differ from those wanted; others are to be 0."""
    given = {key: np.ravel(getattr(there, key)) for key in PASSIVE}
    zeroed = {key: wanted.get(key, 0.0) for key in given}
    return {key: v for key, v in zeroed.items() if given[key][0] != v or np.any(given[key][1:])}


def _at_motor(own: AxisModel, gear: float) -> dict[str, str]:
    """Attributes of the motor that drives a joint, which hold its friction as it is."""
    if own.friction is None or not gear:
        return {}
    held = own.friction.effect.motor_attributes(own.friction.values, abs(gear))
    return {key: " ".join(f"{v:.9g}" for v in values) for key, values in held.items()}


def _gear(spec: Any, joint: str) -> float:
    """Of the one DC motor that drives a joint; 0 where there is none."""
    import mujoco

    kind = mujoco.mjtBias.mjBIAS_DCMOTOR
    gears = [a.gear[0] for a in spec.actuators if a.target == joint and a.biastype == kind]
    return float(gears[0]) if len(gears) == 1 else 0.0


def _judged(model: MachineModel, axis: str, logs: Mapping[str, Log], by_motor: bool) -> Held:
    """Which effects of an axis the joint holds, holds nearly, and does not hold.

    by_motor: whether its motor holds its friction.
    """
    own, unit = model.axes[axis], model.axes[axis].units.force
    motions = [_motion(log.axes[axis].position, log.period) for log in logs.values()]
    on = ", ".join(logs) or "a sine over its travel"
    motions = motions or [_swing(own)]
    kept, nearly, lost = list[str](), list[Remark](), list[Remark]()
    for f in own.effects:
        alone = AxisModel(own.mass, effects=(f,), rotary=own.rotary)
        held = f.effect.joint_attributes(f.values) if f.effect.joint_attributes else {}
        inertia = f.effect.kind is Kind.STRUCTURE and held
        if inertia or (by_motor and f is own.friction):  # it is what it is
            kept.append(f.effect.name)
            continue
        loss = _loss(alone, held, motions)
        if held and loss.is_negligible:
            kept.append(f.effect.name)
        else:
            text = loss.on(on, unit) if loss.size else UNKNOWN
            none = loss.is_most or not loss.size
            (lost if none else nearly).append(Remark(axis, f.effect.name, text))
    return Held(tuple(kept), tuple(nearly), tuple(lost))


def _loss(alone: AxisModel, held: Mapping[str, float], motions: list[tuple[Array, float]]) -> Loss:
    """What the attributes lose of one effect while the axis moves."""
    whole, left = [], []
    for motion, period in motions:
        made = imposed(alone, motion, np.zeros_like(motion), period)
        x, v = motion[:2]
        force = -held.get("frictionloss", 0.0) * np.sign(v) - held.get("damping", 0.0) * v
        force -= held.get("stiffness", 0.0) * (x - held.get("springref", 0.0))
        whole.append(made[v != 0.0])
        left.append((made - force)[v != 0.0])
    sizes = (np.concatenate(parts) for parts in (whole, left))
    return Loss(*(float(np.sqrt(np.mean(s**2))) if len(s) else 0.0 for s in sizes))


def _motion(position: Array, period: float) -> tuple[Array, float]:
    """Position, velocity and no force (3, n) between the samples of a log, and its period, s."""
    velocity = between(position, period)
    middle = 0.5 * (position[1:] + position[:-1])
    return np.stack([middle, velocity, np.zeros_like(velocity)]), period


def _swing(axis: AxisModel) -> tuple[Array, float]:
    """A sine over the travel at the fastest move's speed."""
    # s, of the sine over the travel on which losses are told without a log
    swing, sample = 10.0, 1e-3
    low, high = axis.hardware.travel or (-1.0, 1.0)
    reach = 0.5 * (high - low)
    turn = axis.hardware.velocity / reach * np.arange(0.0, swing, sample)
    return _motion(0.5 * (low + high) + reach * np.sin(turn), sample)


EXPORTER = Exporter(
    "the machine's own MuJoCo file with the joints' friction and springs", export, ".xml"
)
