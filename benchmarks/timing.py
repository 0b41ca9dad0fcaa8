"""Time several jobs in turn, so that other load of the machine affects all of them alike."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def interleaved(
    jobs: Sequence[Callable[[], object]], rounds: int, clock: Callable[[], float] = perf_counter
) -> Array:
    """Seconds of every job in every round, (rounds, n_jobs), after one round that is not counted.

    clock: perf_counter, or time.thread_time for compiled work that runs in this thread alone.
    """
    seconds = np.empty((rounds + 1, len(jobs)))
    for row in seconds:
        for i, job in enumerate(jobs):
            begun = clock()
            job()
            row[i] = clock() - begun
    return seconds[1:]


def ratio(numerator: Array, denominator: Array) -> float:
    """Median over the rounds of one job's time over another's, both (rounds,)."""
    return float(np.median(numerator / denominator))
