"""Feedforward: the force with which an axis follows its setpoint, by its model.

The equation of motion read backwards: the setpoint's motion is imposed, and the laws say what force
it takes. Friction with memory runs on the setpoint. What depends on the command itself, or on the
reading, cannot be told from the setpoint of one instant, and is named as lost.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from twin.core.walks import walk
from twin.effect import DT, INDEX, IO_SIZE, TIME, Kind, Law, U, V, X
from twin.model.machine import AxisModel, Fitted, axis_table
from twin.signals import Array

# N, tried to see whether an actuation is a straight line of the command
FORCES = tuple(sign * 10.0**k for k in range(-6, 7) for sign in (1.0, -1.0))


@dataclass(frozen=True)
class Followed:
    """What a feedforward keeps of the model of an axis."""

    axis: AxisModel
    """The axis with the effects that are kept."""
    approximated: Mapping[str, str]
    """By effect, what is kept nearly: in which respect."""
    lost: Mapping[str, str]
    """By effect, what is not: why."""
    late: float
    """By how much the drive's force is late, s: the setpoint has to be given as much earlier."""

    def ahead(self, period: float) -> float:
        """By how much the setpoint has to come early, s: a command is held over a period (s)."""
        return 0.5 * period + self.late


def followed(axis: AxisModel) -> Followed:
    """What a feedforward keeps of an axis."""
    approximated, lost, late = {}, {}, 0.0
    for f in axis.effects:
        if not f.effect.is_present(f.values):
            continue
        if f.effect.kind is Kind.SENSING:
            lost[f.effect.name] = "it changes the reading, not the force"
        elif f.effect.kind is Kind.ACTUATION and not _can_be_undone(f):
            by = _late_by(f.effect.law, tuple(f.vector()), len(f.effect.states))
            late += by or 0.0
            if by is None:
                lost[f.effect.name] = "the force is no straight line of the command of this instant"
            else:
                approximated[f.effect.name] = (
                    f"it makes the force {by:.3g} s late: give it the setpoint of as much later"
                )
        elif f.effect.kind is Kind.MODIFIER and f.effect.reads("U"):
            approximated[f.effect.name] = (
                "it depends on the force that it is part of: the friction in that is the one of "
                "the sample before"
            )
        elif f.effect.reads("TIME"):
            approximated[f.effect.name] = "its time begins at the first call, its phase with it"
    kept = tuple(
        f for f in axis.effects
        if f.effect.name not in lost and (f.effect.kind is not Kind.ACTUATION or _can_be_undone(f))
    )  # fmt: skip
    return Followed(replace(axis, effects=kept), approximated, lost, late)


def _can_be_undone(fitted: Fitted) -> bool:
    """Whether the force is a straight line of the command, so that one follows from the other."""
    if fitted.effect.states:
        return False

    def force(command: float) -> float:
        io = [0.0] * IO_SIZE
        io[X], io[V], io[U] = 0.123 * np.pi, 0.1, command
        fitted.effect.law(fitted.vector(), [], io)
        return io[U]

    zero, slope = force(0.0), force(1.0) - force(0.0)
    straight = (abs(force(u) - zero - slope * u) <= 1e-9 * abs(u) + abs(zero) for u in FORCES)
    return abs(slope) > 0.0 and all(straight)


@lru_cache(maxsize=256)
def _late_by(law: Law, values: tuple[float, ...], n_states: int) -> float | None:
    """By how much a force is late that follows every command in the end, s; None where none does.

    From ramps of commands: one that is late trails them by its time, whatever their slope.
    """
    ramp_period, ramp_samples = 1e-3, 2000  # s: over the longest lag of the catalogue ten times
    trailing = []
    for slope in (0.1, 100.0):  # N/s, slopes of commands that tell how late a force is
        states, io = [0.0] * n_states, [0.0] * IO_SIZE
        io[DT] = ramp_period
        for k in range(ramp_samples):
            io[INDEX], io[TIME], io[X], io[U] = k, k * io[DT], 0.1, slope * k * io[DT]
            law(values, states, io)
            if k in (ramp_samples // 2, ramp_samples - 1):
                trailing.append(k * io[DT] - io[U] / slope)
    same = np.ptp(trailing) <= 0.01 * abs(trailing[0])
    return trailing[-1] if same and trailing[0] > 0.0 else None


def feedforward(axis: AxisModel, motion: Array, others: Array, period: float) -> Array:
    """Command (n,) N that moves an axis along a motion, as far as its model tells.

    motion (3, n): position m, velocity m/s, acceleration m/s^2, a sample each ``period`` s; others:
    those of the other axis of two.
    """
    kept = followed(axis).axis
    acting = _having(kept, lambda kind: kind is Kind.ACTUATION)
    moving = _having(kept, lambda kind: kind is not Kind.ACTUATION)
    inertia = axis.mass * motion[2]

    def force(of: AxisModel, command: Array) -> Array:
        return imposed(of, np.stack([*motion[:2], command]), others, period)

    # What friction has to hold at rest is the command less the forces, so these come first.
    needed = inertia - force(_having(kept, lambda kind: kind is Kind.FORCE), inertia)
    command = needed
    # of a friction that depends on the force it is part of, by that of the sample before
    rounds = 12
    for _ in range(rounds if any(f.effect.reads("U") for f in moving.effects) else 0):
        drag = needed - inertia + force(moving, command)
        command = needed - np.concatenate([[0.0], drag[:-1]])
    wanted = inertia - force(moving, command)
    if not acting.effects:
        return wanted
    at_zero, at_one = (u + force(acting, u) for u in (np.zeros_like(wanted), np.ones_like(wanted)))
    return np.asarray((wanted - at_zero) / (at_one - at_zero))


def _having(axis: AxisModel, wanted: Callable[[Kind], bool]) -> AxisModel:
    """The axis with its effects of some kinds."""
    return replace(axis, effects=tuple(f for f in axis.effects if wanted(f.effect.kind)))


def imposed(axis: AxisModel, motion: Array, others: Array, period: float) -> Array:
    """Force of all effects along an imposed motion, (n,) N; motion (3, n): m, m/s, command N."""
    table = axis_table({"axis": axis})
    first, last, at, _, _ = table.axes[0]
    rows = np.zeros((len(table.entries), motion.shape[1]))
    walk(
        table.entries, first, last, table.parameters, np.zeros(table.n_states), at,
        np.ascontiguousarray(motion), np.ascontiguousarray(others), period, 0, rows, axis.mass,
    )  # fmt: skip
    return np.asarray(rows.sum(axis=0))
