"""Log and model -> unexplained force in newtons on the measured motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identify.motion import Motion
from identify.weak import Window
from twin.effect import Kind
from twin.model import AxisModel, Coordinate, axis_table, read, write
from twin.native import walk

Array = NDArray[np.float64]

REST_SPEED = 1e-3  # of the highest speed; below it a friction that sticks can be anything


@dataclass(frozen=True, eq=False)
class Windowed:
    """One log's motion of an axis with its weak form; measured (n,) N and acceleration (n,) m/s^2
    are windowed means, kept (n,) says which windows carry information."""

    motion: Motion
    window: Window
    command: Array
    acceleration: Array

    @classmethod
    def of(cls, motion: Motion, length: float) -> Windowed:
        """Weak form with windows of that length (s)."""
        window = Window.of_length(length, motion.period)
        fine = window.refined(round(motion.period / motion.sample_period))
        velocity, command = motion.raw
        return cls(motion, window, fine.mean(command), fine.acceleration(velocity))

    @property
    def time(self) -> Array:
        """(n,) s, middle of each window."""
        return self.window.mean(self.motion.time)

    def __len__(self) -> int:
        return len(self.command)


def forces(axis: AxisModel, motion: Motion) -> dict[str, Array]:
    """Force of each effect on the axis along the measured motion: name -> (n,) N.

    A modifier acts through the friction and has none of its own.
    """
    table = axis_table({motion.axis: axis})
    rows = np.zeros((len(table.entries), motion.signals.shape[1]))
    first, last, state, _, _ = table.axes[0]
    walk(
        table.entries, first, last, table.parameters, np.zeros(table.n_states), state,
        motion.signals, motion.others, motion.period, 0, rows, table.masses[0],
    )  # fmt: skip
    return {name: rows[i] for i, (_, name) in enumerate(table.labels)}


def total_force(axis: AxisModel, motion: Motion) -> Array:
    """Sum of the effects' forces along the measured motion, (n,) N, without the command."""
    if not axis.effects:
        return np.zeros(motion.signals.shape[1])
    return np.sum(list(forces(axis, motion).values()), axis=0)


def residual(axis: AxisModel, logs: Sequence[Windowed]) -> Array:
    """Unexplained force (n,) N: windowed command + effects - mass x acceleration, log after log."""
    return np.concatenate(
        [
            log.command + log.window.mean(total_force(axis, log.motion))
            - axis.mass * log.acceleration
            for log in logs
        ]
    )  # fmt: skip


def group_of(axis: AxisModel, effect: str) -> AxisModel:
    """The part of the axis whose force can change when a parameter of that effect does.

    Friction and its modifiers act together; any other effect acts by itself.
    """
    joint = (Kind.FRICTION, Kind.MODIFIER)
    if axis[effect].effect.kind in joint:
        kept = tuple(f for f in axis.effects if f.effect.kind in joint)
    else:
        kept = (axis[effect],)
    return replace(axis, effects=kept)


def jacobian(axis: AxisModel, logs: Sequence[Windowed], where: Sequence[Coordinate]) -> Array:
    """Derivative of the residual by those coordinates, (n, n_coordinates), N per unit."""
    columns = np.empty((sum(map(len, logs)), len(where)))
    bases: dict[str, tuple[AxisModel, list[Array]]] = {}
    for j, c in enumerate(where):
        if not c.effect:
            columns[:, j] = _by_mass(axis, logs)
            continue
        if c.effect not in bases:
            group = group_of(axis, c.effect)
            bases[c.effect] = group, [total_force(group, log.motion) for log in logs]
        group, base = bases[c.effect]
        value = read(group, [c])[0]
        step = difference_step(c, value)
        moved = write(group, [c], [value + step])
        columns[:, j] = np.concatenate(
            [
                log.window.mean(total_force(moved, log.motion) - force) / step
                for log, force in zip(logs, base, strict=True)
            ]
        )
    return columns


def _by_mass(axis: AxisModel, logs: Sequence[Windowed]) -> Array:
    """Derivative by the moved mass, to which the forces of structure are in proportion."""
    attached = replace(
        axis, effects=tuple(f for f in axis.effects if f.effect.kind is Kind.STRUCTURE)
    )
    return np.concatenate(
        [
            log.window.mean(total_force(attached, log.motion)) / axis.mass - log.acceleration
            for log in logs
        ]
    )


def difference_step(c: Coordinate, value: float) -> float:
    """A step inside the bounds, small against the value or against the parameter's range."""
    p = c.parameter
    size = 1e-5 * max(abs(value), abs(p.start), 1e-6 * min(p.upper - p.lower, 1e3))
    return size if value + size <= p.upper else -size


def moving(logs: Sequence[Windowed], sticks: bool) -> NDArray[np.bool_]:
    """Which windows carry information: for a friction that sticks, those without standstill."""
    masks = []
    for log in logs:
        speed = np.abs(log.motion.velocity)
        still = (speed < REST_SPEED * speed.max()).astype(float)
        masks.append(log.window.mean(still) < 0.02 if sticks else np.ones(len(log), bool))
    return np.concatenate(masks)
