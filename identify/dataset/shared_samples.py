"""Whether two logs hold a stretch of one recording, be it at another place in each.

Of distinct runs not even the same program and a coarse encoder give the same readings and commands
for long while an axis moves. At rest they may, so that windows with motion are compared.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from twin.checks import moves
from twin.logs import AxisLog, Log
from twin.signals import Array

WINDOWS = 8  # of the shorter log, evenly spaced, that are sought in the longer one
LEAST_PART = 1.0 / WINDOWS  # of the shorter log, that a window lasts at least,
LEAST = 1.0  # s, and this too, but no more than half of the log
CELLS = 1000.0  # into which the range of positions is divided
CROSSED = 32  # of which so many are entered within a window
COMPARED = 16  # samples of a window that are compared before all are


def share_samples(one: Log, other: Log) -> bool:
    """Whether a stretch of one log, in which an axis moves, is in the other sample by sample.

    A log of an axis at rest, with the noise of its encoder, is not used for that axis.
    """
    shorter, longer = sorted((one, other), key=len)
    shared = [axis for axis in shorter.axes if axis in longer.axes]
    least = round(max(LEAST_PART * len(shorter), min(LEAST / shorter.period, 0.5 * len(shorter))))
    return any(
        _share(shorter.axes[axis], longer.axes[axis], least) and moves(shorter, axis)
        for axis in shared
    )


def _share(shorter: AxisLog, longer: AxisLog, least: int) -> bool:
    """The same of one axis, for a stretch of at least so many samples."""
    both = shorter.columns.keys() & longer.columns.keys()
    command = next((name for name in ("force", "current") if name in both), None)
    if command is None:
        return False
    sought, given = ((signals.position, signals.columns[command]) for signals in (shorter, longer))
    return any(
        _is_in((sought[0][window], sought[1][window]), moving - window.start, given)
        for window, moving in _with_motion(shorter.position, least)
    )


def _with_motion(position: Array, least: int) -> Iterator[tuple[slice, int]]:
    """Windows of positions (n,) m in which the axis moves, and a sample of each at which it does.

    They are as long as the motion asks for, but have at least ``least`` samples.
    """
    span = float(np.ptp(position))
    if not 0.0 < span < np.inf:
        return
    entered = np.flatnonzero(np.diff(np.floor(position * (CELLS / span)))) + 1
    starts = np.linspace(0, len(position) - least, WINDOWS).astype(int)
    ends = np.searchsorted(entered, starts) + CROSSED - 1
    for start, end in zip(starts, ends, strict=True):
        if end < len(entered):
            moving = int(entered[end])
            yield slice(int(start), max(int(start) + least, moving + 1)), moving


def _is_in(window: tuple[Array, Array], moving: int, signals: tuple[Array, Array]) -> bool:
    """Whether position and command of a window are somewhere in longer signals.

    moving: number of a sample at which it moves, which so is at few places of the signals.
    """
    n = len(window[0])
    begins = np.flatnonzero(signals[0] == window[0][moving]) - moving
    begins = begins[(begins >= 0) & (begins + n <= len(signals[0]))]
    for k in (moving, *np.linspace(0, n - 1, COMPARED).astype(int)):
        for values, wanted in zip(signals, window, strict=True):
            begins = begins[values[begins + k] == wanted[k]]
    return any(
        all(np.array_equal(s[b : b + n], w) for s, w in zip(signals, window, strict=True))
        for b in begins
    )
