"""The force balance: log and model -> force residual in newtons on the measured motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from identify.dataset.drive import actual_force, parts_of, true_motion
from identify.dataset.prepared_log import PreparedLog, total_force
from twin.effect import Kind
from twin.model.machine import AxisModel, ParameterReference, axis_table, read, write

Array = NDArray[np.float64]


def averaged_force(axis: AxisModel, logs: Sequence[PreparedLog]) -> Array:
    """The force that the axis' effects add to the command, averaged by test functions (n,) N.

    Log after log. A sensing effect adds an apparent force, mass x acceleration of the reading's
    error, and the other effects act along the true motion, under the actual force.
    """
    # An actuation with memory needs the log's own rate.
    fine = any(f.effect.kind is Kind.ACTUATION and f.effect.states for f in axis.effects)
    apart = {Kind.SENSING, *((Kind.ACTUATION,) if fine else ())}
    table = axis_table({"": parts_of(axis, *(set(Kind) - apart))})
    parts = []
    for log in logs:
        motion, error_rate = true_motion(axis, log.motion)
        driven = motion.with_force(actual_force(axis, motion)) if fine else motion
        out = log.window.mean(total_force(table, driven))
        if fine:
            out += log.fine.mean(driven.raw[1]) - log.command
        if motion is not log.motion:
            out += axis.mass * log.fine.acceleration(error_rate)
        parts.append(out)
    return np.concatenate(parts)


def residual(axis: AxisModel, logs: Sequence[PreparedLog]) -> Array:
    """Force residual (n,) N: averaged command + effects - mass x acceleration, log after log."""
    inertia = np.concatenate([log.command - axis.mass * log.acceleration for log in logs])
    return np.asarray(inertia + averaged_force(axis, logs))


def group_of(axis: AxisModel, effect: str) -> AxisModel:
    """The part of the axis whose force can change when a parameter of that effect does.

    Friction and its modifiers form one group, the actuation effects another; the two are one group
    where a friction depends on the motor's force. Any other effect is a group by itself. Sensing
    effects belong to every group, because they change the motion that all others act along.
    """
    kind = axis[effect].effect.kind
    if kind is Kind.SENSING:
        return axis
    friction, chain = (Kind.FRICTION, Kind.MODIFIER), (Kind.ACTUATION,)
    joined = any(f.effect.kind in friction and f.effect.reads("U") for f in axis.effects)
    for joint in ((*friction, *chain),) if joined else (friction, chain):
        if kind in joint:
            return parts_of(axis, *joint, Kind.SENSING)
    return replace(axis, effects=(axis[effect], *parts_of(axis, Kind.SENSING).effects))


def jacobian(
    axis: AxisModel, logs: Sequence[PreparedLog], where: Sequence[ParameterReference]
) -> Array:
    """Derivative of the residual by these parameters, (n, n_parameters), N per unit."""
    columns = np.empty((sum(map(len, logs)), len(where)))
    bases: dict[str, tuple[AxisModel, Array]] = {}
    for j, c in enumerate(where):
        if not c.effect:
            columns[:, j] = _by_mass(axis, logs)
            continue
        if c.effect not in bases:
            group = group_of(axis, c.effect)
            bases[c.effect] = group, averaged_force(group, logs)
        group, base = bases[c.effect]
        value = read(group, [c])[0]
        step = difference_step(c, value)
        moved = write(group, [c], [value + step])
        columns[:, j] = (averaged_force(moved, logs) - base) / step
    return columns


def _by_mass(axis: AxisModel, logs: Sequence[PreparedLog]) -> Array:
    """Derivative by the moved mass; attached masses and sensing errors are in proportion to it."""
    attached = parts_of(axis, Kind.STRUCTURE, Kind.SENSING)
    inertia = np.concatenate([log.acceleration for log in logs])
    return np.asarray(averaged_force(attached, logs) / axis.mass - inertia)


def difference_step(c: ParameterReference, value: float) -> float:
    """A step within the bounds, small relative to the value or to the parameter's range."""
    p = c.parameter
    size = 1e-5 * max(abs(value), abs(p.start), 1e-6 * min(p.upper - p.lower, 1e3))
    return size if value + size <= p.upper else -size
