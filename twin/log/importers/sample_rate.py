"""The sample rate of a column of times, which must be even."""

from __future__ import annotations

import numpy as np

from twin.errors import InputError
from twin.log.instants import instant
from twin.log.log import Array

JITTER = 0.01  # of a period: how far a time may be off the even grid


def rate_of(time: Array) -> float:
    """Sample rate in Hz of times (n,) in s.

    It is the nearest whole number where the times allow that. Raises InputError that names row and
    time where they do not increase, have a gap, or are off the even grid by more than 1 %.
    """
    if not np.isfinite(time).all():
        k = int(np.argmin(np.isfinite(time)))
        raise InputError(f"the time in row {k + 1} is {time[k]}; give every row a time")
    elapsed = time - time[0]
    steps = np.diff(elapsed)
    period = float(np.median(steps))
    back = steps <= 0.0
    if back.any():
        k = int(np.argmax(back))
        raise _uneven("does not increase", time, k + 1, period)
    gap = steps > 1.5 * period
    if gap.any():
        raise _uneven("has a gap", time, int(np.argmax(gap)) + 1, period)
    rate = len(steps) / float(elapsed[-1])
    if abs(round(rate) / rate - 1.0) * len(steps) < JITTER:
        rate = float(round(rate))
    off = np.abs(elapsed * rate - np.arange(len(time)))
    if off.max() > JITTER:
        raise _uneven(
            f"is off the even grid by up to {100.0 * off.max():.3g} % of a sample",
            time, int(np.argmax(off > JITTER)), period,
        )  # fmt: skip
    return rate


def _uneven(fault: str, time: Array, row: int, period: float) -> InputError:
    rate = 1.0 / max(period, 1e-9)
    return InputError(
        f"the time {fault}: {instant(time[row - 1])} is followed by {instant(time[row])} in row "
        f"{row + 1}, usual are {period:.6g} s a sample; give resample = {rate:.6g} "
        "(Hz) in the map, or sample_rate in place of time where only the printed times are inexact"
    )
