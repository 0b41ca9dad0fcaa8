"""What the numbers of columns say of each other: which is the rate of which, which is the force."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from twin.log.log import Array
from twin.signals import between, rate

_SPAN = 0.01  # s over which a rate is taken
_RATE = 0.9  # correlation of a column with the rate of another from which it is called that
_FORCE = 0.3  # of the variance of a command that motion explains
_FOLLOWS = 0.95  # correlation of a signal and its setpoint, at the lag of the loop
_LOOP = 0.25  # s, largest lag of a loop that is followed at all


def rate_of_another(
    columns: Mapping[str, Array], names: Sequence[str], step: float
) -> tuple[str, str, float] | None:
    """A column, the one that is its rate, and their correlation; None where no two are so."""
    found = [
        (abs(_correlation(rates(columns[x], step), means(columns[v], step))), x, v)
        for x in names
        for v in names
        if x != v
    ]
    best = max(found, default=(0.0, "", ""))
    return (best[1], best[2], best[0]) if best[0] > _RATE else None


@dataclass(frozen=True)
class Leader:
    """A column of the same course as a signal: its setpoint, or a second reading of it.

    ahead: s, by which it is ahead of the signal. slope: how much of it is one of the signal.
    """

    name: str
    likeness: float
    ahead: float
    slope: float


def leaders(
    columns: Mapping[str, Array], names: Sequence[str], signal: Array, step: float
) -> list[Leader]:
    """Columns that have the course of a signal (k,), as of ``means``, the likest first.

    At some lag of a loop. The force that moves a mass does not: it goes with the acceleration and,
    by friction, with the sign of the velocity. That of a spring does, but in another size.
    """
    span = _width(step) * step
    reach = min(round(_LOOP / span), len(signal) // 4)
    found = []
    for name in names:
        other = means(columns[name], step)
        count = min(len(signal), len(other)) - reach
        shifts = [
            (_correlation(signal[reach:count], other[reach - k : count - k]), k)
            for k in range(-reach, reach + 1)
        ]
        likeness, ahead = max(shifts)
        if likeness > _FOLLOWS:
            slope = float(np.std(other) / np.std(signal))
            found.append(Leader(name, likeness, ahead * span, slope))
    return sorted(found, key=lambda leader: -leader.likeness)


def ratio_of_rates(position: Array, velocity: Array, step: float) -> float:
    """How many of the position's unit a second one of the velocity's is."""
    rate, given = rates(position, step), means(velocity, step)
    return float(rate @ given / (given @ given))


def moved_by(
    columns: Mapping[str, Array], names: Sequence[str], position: Array, step: float
) -> tuple[str, float] | None:
    """The column that the motion explains best as a force, and the share of its variance."""
    width = _width(step)
    velocity = rates(position, step)
    middle = means(position, step)
    rows = np.column_stack(
        [
            rate(velocity, width * step), velocity, np.sign(velocity), middle,
            np.ones_like(middle),
        ]
    )  # fmt: skip
    rows /= np.abs(rows).max(axis=0) + np.finfo(float).tiny
    found = []
    for name in names:
        force = means(columns[name], step)
        left = force - rows @ np.linalg.lstsq(rows, force, rcond=1e-10)[0]
        found.append((1.0 - float(np.var(left) / np.var(force)), name))
    best = max(found, default=(0.0, ""))
    return (best[1], best[0]) if best[0] > _FORCE else None


def _width(step: float) -> int:
    return max(round(_SPAN / step), 1)


def rates(column: Array, step: float) -> Array:
    """(k,) rate over each span of 0.01 s, a second."""
    return between(column[:: _width(step)], _width(step) * step)


def means(column: Array, step: float) -> Array:
    """(k,) mean over each such span."""
    width = _width(step)
    count = (len(column) - 1) // width
    return np.asarray(column[: count * width].reshape(count, width).mean(axis=1))


def _correlation(a: Array, b: Array) -> float:
    n = min(len(a), len(b))
    a, b = a[:n] - a[:n].mean(), b[:n] - b[:n].mean()
    size = np.sqrt(float(a @ a) * float(b @ b))
    return float(a @ b) / size if size > 0.0 else 0.0
