"""Counters that begin again: 2^16 counts of an encoder, 2^32 us of a clock, a day, an hour."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from twin.logs.log import Array

SIZES = (*(float(1 << bits) for bits in range(8, 33)), 360.0, 3600.0)  # of counters in use
_LONG = 20.0  # usual steps, over which two rows do not follow each other


@dataclass(frozen=True)
class Wraps:
    """Jumps of a counter or a clock by ``size``, in rows ``rows`` (k,), of which the first is 1."""

    size: float
    rows: NDArray[np.intp]

    def described(self, column: str) -> str:
        """What is wrong with a column of that name."""
        row = int(self.rows[0])
        more = and_more(len(self.rows))
        return (
            f"column '{column}' jumps by {self.size:g} between rows {row - 1} and {row}{more}: its "
            f"counter begins again after {self.size:g}"
        )


def and_more(count: int) -> str:
    """What is added to the first of so many."""
    return {1: "", 2: ", and once more"}.get(count, f", and {count - 1} more times")


def find_wraps(column: Array) -> Wraps | None:
    """Where a column (n,) jumps by the size of a counter; None where it does not.

    It uses all of the counter's range, up to its own steps, and less the jumps its steps are small.
    """
    if len(column) < 3 or not np.isfinite(column).all():
        return None
    steps, reach = np.diff(column), float(np.ptp(column))
    for size in SIZES:
        if not 0.5 * size < reach < size:
            continue
        jumps = np.abs(steps) > 0.5 * size
        if not jumps.any() or jumps.all():
            continue
        usual = 2.0 * np.abs(steps[~jumps]).max() + 1.0  # what the counter may do in a step
        rest = np.abs(np.abs(steps[jumps]) - size).max()
        if max(rest, size - reach) <= usual < 0.5 * size:
            return Wraps(size, np.flatnonzero(jumps) + 2)
    return None


def unwrapped(column: Array, size: float) -> Array:
    """A column (n,) without the jumps of a counter of that size, the first row near 0.

    So a small negative number that was read without its sign is a small negative number again.
    """
    plain = np.unwrap(column, period=size)
    return np.asarray(plain - size * np.rint(plain[:1] / size))


def stamp_jumps(times: Array, sizes: tuple[float, ...]) -> Wraps | None:
    """Where times (n,) jump by one of these sizes, back or on, and would be even but for it.

    None where no jump is by any of them to within the usual steps.
    """
    steps = np.diff(times)
    rising = steps[steps > 0.0]
    if len(rising) < 3:
        return None
    usual = float(np.median(rising))
    odd = np.flatnonzero((steps < -_LONG * usual) | (steps > _LONG * usual))
    for size in sizes:
        if not len(odd) or size < 2.0 * _LONG * usual:
            continue
        rest = steps[odd] - np.sign(steps[odd]) * size
        if ((rest > -0.5 * usual) & (rest < _LONG * usual)).all():
            return Wraps(size, odd + 2)
    return None


def without_jumps(times: Array, jumps: Wraps) -> Array:
    """The times (n,) less the jumps."""
    at = jumps.rows - 1
    added = np.zeros(len(times))
    added[at] = np.sign(times[at] - times[at - 1]) * jumps.size
    return np.asarray(times - np.cumsum(added))
