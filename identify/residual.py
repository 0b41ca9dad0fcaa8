"""Log and model -> unexplained force in newtons on the measured motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identify.actuation import actual_force, parts_of, true_motion
from identify.motion import Motion
from identify.weak import Window
from twin.effect import Kind
from twin.model import AxisModel, Coordinate, axis_table, read, write
from twin.native import Table, walk

Array = NDArray[np.float64]

REST_SPEED = 1e-3  # of the highest speed; below it a friction that sticks can be anything


@dataclass(frozen=True, eq=False)
class Windowed:
    """One log's motion of an axis with its weak form.

    window, fine: over the motion's blocks, and the same over the log's samples. command (n,) N and
    acceleration (n,) m/s^2 are windowed means.
    """

    motion: Motion
    window: Window
    fine: Window
    command: Array
    acceleration: Array

    @classmethod
    def of(cls, motion: Motion, length: float) -> Windowed:
        """Weak form with windows of that length (s)."""
        window = Window.of_length(length, motion.period)
        samples = round(motion.period / motion.sample_period)
        fine, window = window.refined(samples), window.sharpened(samples)
        velocity, command = motion.raw
        return cls(motion, window, fine, fine.mean(command), fine.acceleration(velocity))

    @property
    def time(self) -> Array:
        """(n,) s, middle of each window."""
        return self.window.mean(self.motion.time)

    def __len__(self) -> int:
        return len(self.command)


def total_force(table: Table, motion: Motion) -> Array:
    """Sum of the forces of a table's first axis along a measured motion, (n,) N, less command."""
    rows = np.zeros((len(table.entries), motion.signals.shape[1]))
    if not len(rows):
        return np.zeros(motion.signals.shape[1])
    first, last, state, _, _ = table.axes[0]
    walk(
        table.entries, first, last, table.parameters, np.zeros(table.n_states), state,
        motion.signals, motion.others, motion.period, 0, rows, table.masses[0],
        motion.clock,
    )  # fmt: skip
    return np.asarray(rows.sum(axis=0))


def on_blocks(axis: AxisModel) -> Table:
    """Table of what acts between actuator and encoder, which blocks of a motion resolve."""
    return axis_table(
        {"": parts_of(axis, Kind.FORCE, Kind.MODIFIER, Kind.FRICTION, Kind.STRUCTURE)}
    )


def windowed_force(axis: AxisModel, logs: Sequence[Windowed]) -> Array:
    """What the axis' effects add to the command, windowed means (n,) N, log after log.

    A sensing effect adds the force that the reading's error pretends, mass x its acceleration, and
    the other effects act along the motion behind the readings.
    """
    fine = _on_samples(axis)
    apart = {Kind.SENSING, *((Kind.ACTUATION,) if fine else ())}
    table = axis_table({"": parts_of(axis, *(set(Kind) - apart))})
    parts = []
    for log in logs:
        motion, error_rate = true_motion(axis, log.motion)
        out = log.window.mean(total_force(table, motion))
        if fine:
            out += log.fine.mean(actual_force(axis, motion)) - log.command
        if motion is not log.motion:
            out += axis.mass * log.fine.acceleration(error_rate)
        parts.append(out)
    return np.concatenate(parts)


def _on_samples(axis: AxisModel) -> bool:
    """Whether the axis has an actuation with memory, which needs the log's own rate."""
    return any(f.effect.kind is Kind.ACTUATION and f.effect.states for f in axis.effects)


def residual(axis: AxisModel, logs: Sequence[Windowed]) -> Array:
    """Unexplained force (n,) N: windowed command + effects - mass x acceleration, log after log."""
    inertia = np.concatenate([log.command - axis.mass * log.acceleration for log in logs])
    return np.asarray(inertia + windowed_force(axis, logs))


def group_of(axis: AxisModel, effect: str) -> AxisModel:
    """The part of the axis whose force can change when a parameter of that effect does.

    Friction and its modifiers act together, and so does what is in a chain; friction may depend on
    the force that a chain without memory gives. Any other effect acts by itself. All act along the
    motion that the sensing effects leave.
    """
    kind = axis[effect].effect.kind
    if kind is Kind.SENSING:
        return axis
    friction, chain = (Kind.FRICTION, Kind.MODIFIER), (Kind.ACTUATION,)
    for joint in (friction, chain) if _on_samples(axis) else ((*friction, *chain),):
        if kind in joint:
            return parts_of(axis, *joint, Kind.SENSING)
    return replace(axis, effects=(axis[effect], *parts_of(axis, Kind.SENSING).effects))


def jacobian(axis: AxisModel, logs: Sequence[Windowed], where: Sequence[Coordinate]) -> Array:
    """Derivative of the residual by those coordinates, (n, n_coordinates), N per unit."""
    columns = np.empty((sum(map(len, logs)), len(where)))
    bases: dict[str, tuple[AxisModel, Array]] = {}
    for j, c in enumerate(where):
        if not c.effect:
            columns[:, j] = _by_mass(axis, logs)
            continue
        if c.effect not in bases:
            group = group_of(axis, c.effect)
            bases[c.effect] = group, windowed_force(group, logs)
        group, base = bases[c.effect]
        value = read(group, [c])[0]
        step = difference_step(c, value)
        moved = write(group, [c], [value + step])
        columns[:, j] = (windowed_force(moved, logs) - base) / step
    return columns


def _by_mass(axis: AxisModel, logs: Sequence[Windowed]) -> Array:
    """Derivative by the moved mass, to which structure and sensing errors are in proportion."""
    attached = parts_of(axis, Kind.STRUCTURE, Kind.SENSING)
    inertia = np.concatenate([log.acceleration for log in logs])
    return np.asarray(windowed_force(attached, logs) / axis.mass - inertia)


def difference_step(c: Coordinate, value: float) -> float:
    """A step inside the bounds, small against the value or against the parameter's range."""
    p = c.parameter
    size = 1e-5 * max(abs(value), abs(p.start), 1e-6 * min(p.upper - p.lower, 1e3))
    return size if value + size <= p.upper else -size


def sticks(axis: AxisModel) -> bool:
    """Whether the axis' friction is a static one, whose force at rest can be anything."""
    return any(f.effect.sticks for f in axis.effects)


def moving(logs: Sequence[Windowed], sticks: bool) -> NDArray[np.bool_]:
    """Which windows carry information: for a friction that sticks, those without standstill."""
    masks = []
    for log in logs:
        speed = np.abs(log.motion.velocity)
        still = (speed < REST_SPEED * speed.max()).astype(float)
        masks.append(log.window.mean(still) < 0.02 if sticks else np.ones(len(log), bool))
    return np.concatenate(masks)
