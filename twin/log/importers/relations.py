"""What the numbers of columns say of each other: which is the rate of which, which is the force."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from twin.log.log import Array
from twin.signals import between, rate

_SPAN = 0.01  # s over which a rate is taken
_RATE = 0.9  # correlation of a column with the rate of another from which it is called that
_FORCE = 0.3  # of the variance of a command that motion explains


def rate_of_another(
    columns: Mapping[str, Array], names: Sequence[str], step: float
) -> tuple[str, str, float] | None:
    """A column, the one that is its rate, and their correlation; None where no two are so."""
    found = [
        (abs(_correlation(_rate(columns[x], step), _mean(columns[v], step))), x, v)
        for x in names
        for v in names
        if x != v
    ]
    best = max(found, default=(0.0, "", ""))
    return (best[1], best[2], best[0]) if best[0] > _RATE else None


def ratio_of_rates(position: Array, velocity: Array, step: float) -> float:
    """How many of the position's unit a second one of the velocity's is."""
    rate, given = _rate(position, step), _mean(velocity, step)
    return float(rate @ given / (given @ given))


def moved_by(
    columns: Mapping[str, Array], names: Sequence[str], position: Array, step: float
) -> tuple[str, float] | None:
    """The column that the motion explains best as a force, and the share of its variance."""
    width = _width(step)
    velocity = _rate(position, step)
    middle = _mean(position, step)
    rows = np.column_stack(
        [
            rate(velocity, width * step), velocity, np.sign(velocity), middle,
            np.ones_like(middle),
        ]
    )  # fmt: skip
    rows /= np.abs(rows).max(axis=0) + np.finfo(float).tiny
    found = []
    for name in names:
        force = _mean(columns[name], step)
        left = force - rows @ np.linalg.lstsq(rows, force, rcond=1e-10)[0]
        found.append((1.0 - float(np.var(left) / np.var(force)), name))
    best = max(found, default=(0.0, ""))
    return (best[1], best[0]) if best[0] > _FORCE else None


def _width(step: float) -> int:
    return max(round(_SPAN / step), 1)


def _rate(column: Array, step: float) -> Array:
    """(k,) rate over each span of 0.01 s, a second."""
    return between(column[:: _width(step)], _width(step) * step)


def _mean(column: Array, step: float) -> Array:
    """(k,) mean over each such span."""
    width = _width(step)
    count = (len(column) - 1) // width
    return np.asarray(column[: count * width].reshape(count, width).mean(axis=1))


def _correlation(a: Array, b: Array) -> float:
    n = min(len(a), len(b))
    a, b = a[:n] - a[:n].mean(), b[:n] - b[:n].mean()
    size = np.sqrt(float(a @ a) * float(b @ b))
    return float(a @ b) / size if size > 0.0 else 0.0
