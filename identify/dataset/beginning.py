"""The beginning of a log in which the axis has not begun to move freely.

An axis that hangs in its cogging or its stiction while the controller builds up force, or that is
still held by a brake, obeys no law of motion. One such moment may hold most of the squared error of
a log, and every parameter would serve it. It is left out, and that is said.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from identify.dataset.motion import Motion
from identify.dataset.time_scale import regressors
from twin.signals import Array

LOOK = 0.1  # s, of the test functions that tell it; longer where samples are slow
LONGEST = 1.0  # s, that a beginning may last
LONGEST_PART = 0.1  # of a log
SHORTEST = 0.2  # s, below which it is no matter
FOREIGN = 10.0  # times the RMS of what is left of the force later on
HELD = 0.1  # of the force itself


def beginnings(motions: Sequence[Motion]) -> Mapping[str, float]:
    """Logs with a beginning that the later motion does not explain, and its end in each, s.

    The later motion of all logs tells a mass, a friction and a constant.
    """
    columns, forces, test_functions = regressors(motions, LOOK)
    times = [w.mean(m.time) for m, w in zip(motions, test_functions, strict=True)]
    logs = np.repeat(np.arange(len(motions)), [len(t) for t in times])
    ends = [min(LONGEST, LONGEST_PART * float(m.time[-1])) for m in motions]
    late = np.concatenate([t > end for t, end in zip(times, ends, strict=True)])
    gains = np.linalg.lstsq(columns[:, late].T, forces[late], rcond=None)[0]
    usual = float(np.sqrt(np.mean((forces[late] - columns[:, late].T @ gains) ** 2)))
    left = np.abs(forces - columns.T @ gains)
    left[left < HELD * np.abs(forces)] = 0.0
    found = {
        m.name: _first_usual(left[logs == k], times[k], usual, 2.0 * test_functions[k].length)
        for k, m in enumerate(motions)
    }
    return {
        m.name: found[m.name]
        for m, end in zip(motions, ends, strict=True)
        if SHORTEST <= found[m.name] <= end
    }


def _first_usual(left: Array, time: Array, usual: float, about: float) -> float:
    """Time s from which the force left (n,) N is usual; 0 where it is from the start.

    about: s, within which no force may be foreign.
    """
    step = float(time[1] - time[0]) if len(time) > 1 else 1.0
    width = max(round(about / step), 1)
    padded = np.pad(left, (width // 2, (width - 1) // 2), mode="symmetric")
    largest = sliding_window_view(padded, width).max(axis=1)
    ordinary = np.flatnonzero(largest <= FOREIGN * usual)
    if not len(ordinary):
        return 0.0
    return 0.0 if ordinary[0] == 0 else float(time[ordinary[0]])
