"""MJCF: the machine's own MuJoCo file with what its joints can hold of the model.

Friction, damping, springs and rotor inertia are attributes of a joint or a tendon; each effect says
which of them hold it (``Effect.joint_attributes``). The text of the file stays as it is, but for
those of them that the model has at another value than the file, each of which is told, and for
those of joints that are no axes, whose forces are among the axes'. A value within the interval of
the model's is none other; what no effect of the model holds stays, and is told as well. What they
lose of an effect is told along logs: the force that it makes in the model less that of

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
from twin.mujoco.reading import read_spec
from twin.mujoco.stated import stated
from twin.mujoco.written import in_mjcf, with_joint, with_motor
from twin.signals import Array, between

ROUNDED = 1e-9  # relative, to which a value is written
UNITS = {
    "armature": "kg", "damping": "N s/m", "frictionloss": "N", "stiffness": "N/m", "springref": "m",
}  # fmt: skip
UNKNOWN = "a joint of MuJoCo holds no such effect; how large it is, no position alone tells"


def export(model: MachineModel, logs: Mapping[str, Log]) -> Exported:
    """The MJCF file with the joints' attributes; of a URDF file the MJCF file that it makes."""
    if model.mjcf is None:
        raise InputError(
            f"{model.name}: has no MuJoCo file to write back; give the model mujoco = 'robot.xml', "
            "or make the first model of an MJCF file (`twin new`)"
        )
    name = model.mjcf_name or "model.xml"
    text = in_mjcf(model.mjcf, name)
    spec = read_spec(text, name)
    at_motor = {a: _at_motor(own, _gear(spec, own.joint or a)) for a, own in model.axes.items()}
    has = stated(model.mjcf, name, {a: own.joint or a for a, own in model.axes.items()})
    written = list[Remark]()
    for axis, own in model.axes.items():
        known = model.intervals.get(axis)
        near = _as_stated(own, has[axis], known.ends if known else {})
        wanted = _wanted(near, bool(at_motor[axis]))
        text = _with_attributes(text, name, spec, axis, own, wanted, at_motor[axis])
        written += _remarks(axis, own, has[axis], wanted)
    if model.joints:
        for moved in (j for j in spec.joints if j.name not in model.joints.values()):
            text = with_joint(text, moved.name, _changed(moved, dict.fromkeys(PASSIVE, 0.0)))
    held = {axis: _judged(model, axis, logs, bool(at_motor[axis])) for axis in model.axes}
    return Exported({f"{Path(name).stem}.xml": text}, held, tuple(written))


def attributes_of(axis: AxisModel) -> dict[str, float]:
    """The attributes of the joint that hold the effects of an axis."""
    found: dict[str, float] = {}
    for f in axis.effects:
        if f.effect.joint_attributes is not None:
            for key, value in f.effect.joint_attributes(f.values).items():
                found[key] = found.get(key, 0.0) + value
    return found


def _as_stated(
    axis: AxisModel, has: Mapping[str, float], ends: Mapping[str, tuple[float, float]]
) -> AxisModel:
    """An axis with the values of the file where these lie within the intervals of its own.

    has: attributes of the file's joint. ends: of the intervals, by label.
    """
    for f in axis.effects:
        filed = f.effect.of_joint(has) if f.effect.of_joint else {}
        within = {n: ends.get(f"{f.effect.name}.{n}", (np.inf, -np.inf)) for n in filed}
        kept = {n: v for n, v in filed.items() if within[n][0] <= v <= within[n][1]}
        axis = axis.with_effect(replace(f, values={**f.values, **kept}))
    return axis


def _wanted(axis: AxisModel, by_motor: bool) -> dict[str, float]:
    """The attributes that a joint is to have, of those that an effect of the axis holds.

    by_motor: whether its motor holds its friction.
    """
    return attributes_of(axis) | ({"frictionloss": 0.0} if by_motor else {})


def _remarks(
    axis: str, own: AxisModel, has: Mapping[str, float], wanted: Mapping[str, float]
) -> Iterator[Remark]:
    """What is another in the file than it was, and what stays that no effect of the axis holds."""
    for key, before in has.items():
        unit = own.units(UNITS[key])
        if key not in wanted:
            if before and key in PASSIVE:
                why = "which no effect of the model holds, stays"
                yield Remark(axis, key, f"{before:.6g} {unit}, {why}")
        elif not np.isclose(wanted[key], before, rtol=ROUNDED, atol=0.0):
            yield Remark(axis, key, f"{before:.6g} {unit} becomes {wanted[key]:.6g} {unit}")


def _with_attributes(
    text: str, name: str, spec: Any, axis: str, own: AxisModel, attributes: Mapping[str, float],
    at_motor: Mapping[str, str],
) -> str:  # fmt: skip
    """The text with these attributes of one axis.

    spec: of the file. at_motor: the attributes of the joint's motor that hold its friction.
    """
    joint, wanted = own.joint or axis, dict(attributes)
    if at_motor:
        text = with_motor(text, joint, at_motor)
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
    """The attributes of a joint or a tendon that differ from those wanted."""
    given = {key: np.ravel(getattr(there, key)) for key in wanted}
    return {
        key: value
        for key, value in wanted.items()
        if not np.isclose(given[key][0], value, rtol=ROUNDED, atol=0.0) or np.any(given[key][1:])
    }


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
