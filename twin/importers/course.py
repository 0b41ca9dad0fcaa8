"""What columns of numbers say of each other: which is the rate, setpoint or force of which."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import permutations

import numpy as np

from twin.logs.log import Array
from twin.signals import between, rate

_SPAN = 0.01  # s over which a rate is taken
RATE = 0.9  # correlation of a column with the rate of another from which it is called that

Columns = Mapping[str, Array]
Pair = tuple[str, str, float]  # a position, its rate, and their correlation


def rate_of_another(columns: Columns, names: Sequence[str], step: float) -> Pair | None:
    """A column, the one that is its rate, and their correlation; None where no two are so."""
    found = [
        (abs(correlation(rates(columns[x], step), means(columns[v], step))), x, v)
        for x, v in permutations(names, 2)
    ]
    how, position, velocity = max(found, default=(0.0, "", ""))
    return (position, velocity, how) if how > RATE else None


@dataclass(frozen=True)
class Leader:
    """A column of the same course as a signal: its setpoint, or a second reading of it.

    ahead: s, by which it is ahead of the signal. slope: how much of it is one of the signal.
    """

    name: str
    likeness: float
    ahead: float
    slope: float


def leaders(columns: Columns, names: Sequence[str], signal: Array, step: float) -> list[Leader]:
    """Columns that have the course of a signal (k,), as of ``means``, the likest first.

    At some lag of a loop. The force that moves a mass does not: it goes with the acceleration and,
    by friction, with the sign of the velocity. That of a spring does, but in another size.
    """
    span = _width(step) * step
    loop = 0.25  # s, largest lag of a loop that is followed at all
    reach = min(round(loop / span), len(signal) // 4)
    found = []
    for name in names:
        other = means(columns[name], step)
        count = min(len(signal), len(other)) - reach
        own, lags = signal[reach:count], range(-reach, reach + 1)
        shifts = [(correlation(own, other[reach - k : count - k]), k) for k in lags]
        likeness, ahead = max(shifts)
        if likeness > 0.95:  # correlation of a signal and its setpoint, at the lag of the loop
            slope = float(np.std(other) / np.std(signal))
            found.append(Leader(name, likeness, ahead * span, slope))
    return sorted(found, key=lambda leader: -leader.likeness)


def moved_by(
    columns: Columns, names: Sequence[str], position: Array, step: float
) -> tuple[str, float] | None:
    """The column that the motion explains best as a force, and the share of its variance."""
    velocity, middle = rates(position, step), means(position, step)
    acceleration, one = rate(velocity, _width(step) * step), np.ones_like(middle)
    rows = np.column_stack([acceleration, velocity, np.sign(velocity), middle, one])
    rows /= np.abs(rows).max(axis=0) + np.finfo(float).tiny
    found = []
    for name in names:
        force = means(columns[name], step)
        left = force - rows @ np.linalg.lstsq(rows, force, rcond=1e-10)[0]
        found.append((1.0 - float(np.var(left) / np.var(force)), name))
    share, best = max(found, default=(0.0, ""))
    # of the variance of a command that motion explains
    return (best, share) if share > 0.3 else None


def likeness_to_rate(position: Array, velocity: Array, step: float) -> float:
    """Of two columns (n,): how well the one goes with the rate of the other, 0 to 1."""
    # s over which one is compared with a column called so: a filter's lag is less, and so is the
    # share of the noise of a coarse encoder
    long = 0.1
    span = min(long, 0.05 * len(position) * step)  # 20 of a short log
    return abs(correlation(rates(position, step, span), means(velocity, step, span)))


def _width(step: float, span: float = _SPAN) -> int:
    return max(round(span / step), 1)


def rates(column: Array, step: float, span: float = _SPAN) -> Array:
    """(k,) rate over each span in s, a second."""
    return between(column[:: _width(step, span)], _width(step, span) * step)


def means(column: Array, step: float, span: float = _SPAN) -> Array:
    """(k,) mean over each such span."""
    width = _width(step, span)
    count = (len(column) - 1) // width
    return np.asarray(column[: count * width].reshape(count, width).mean(axis=1))


def correlation(a: Array, b: Array) -> float:
    n = min(len(a), len(b))
    a, b = a[:n] - a[:n].mean(), b[:n] - b[:n].mean()
    size = np.sqrt(float(a @ a) * float(b @ b))
    return float(a @ b) / size if size > 0.0 else 0.0
