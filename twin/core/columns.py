"""Columns of a law that is linear in its strengths, averaged by test functions, in one walk.

A free curve has some eighty strengths, of which four act at any one sample: a walk for each of them
would cost twenty times as much.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from twin.core.calling import address_of, call_law
from twin.core.compiled import compiled
from twin.effect import COLUMNS, DT, INDEX, IO_SIZE, TIME, WHEN, Effect, U, V, X

Array = NDArray[np.float64]


def averaged_columns(
    effect: Effect, values: Sequence[float], motion: Array, period: float, time_origin: float,
    weights: Array, stride: int,
) -> Array:  # fmt: skip
    """Force per unit of each strength, (n_strengths, n_test_functions), along a measured motion.

    values: (n_parameters,) of the effect, which has ``columns``. motion (3, n): position m,
    velocity m/s, command N, means over blocks of ``period`` s. time_origin: s, when block 0 was.
    weights (w,): of a test function over blocks; stride: blocks from one to the next.
    """
    assert effect.columns is not None
    means = np.zeros(
        (max((motion.shape[1] - len(weights)) // stride + 1, 0), len(effect.strengths))
    )
    states = np.zeros(len(effect.states) + 1)
    io = np.zeros(IO_SIZE + 1 + 2 * len(effect.strengths))
    _walk(
        address_of(effect.columns), np.array([*values, 0.0]), states, motion, period, time_origin,
        weights, stride, means, io,
    )  # fmt: skip
    return means.T


@compiled(nogil=True)
def _walk(law, parameters, states, motion, dt, time_origin, weights, stride, means, io):
    count = means.shape[0]
    p, s, w = parameters.ctypes.data, states.ctypes.data, io.ctypes.data
    length = weights.shape[0]
    io[DT] = dt
    io[WHEN] = 0.5
    for k in range(motion.shape[1]):
        io[INDEX] = k
        io[TIME] = time_origin + k * dt
        io[X] = motion[0, k]
        io[V] = motion[1, k]
        io[U] = motion[2, k]
        call_law(law, p, s, w)
        first = max((k - length + stride) // stride, 0)
        for i in range(first, min(k // stride + 1, count)):
            weight = weights[k - i * stride]
            for j in range(int(io[COLUMNS])):
                at = COLUMNS + 1 + 2 * j
                means[i, int(io[at])] += weight * io[at + 1]
