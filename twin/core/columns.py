"""Columns of a law that is linear in its strengths, in one walk.

A free curve has some eighty strengths, of which four act at any one sample: a walk for each of them
would cost twenty times as much.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from twin.core.calling import address_of, call_law
from twin.core.compiled import compiled
from twin.effect import COLUMNS, DT, INDEX, IO_SIZE, READING, TIME, WHEN, Effect, U, V, X

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
    means = np.zeros(
        (max((motion.shape[1] - len(weights)) // stride + 1, 0), len(effect.strengths))
    )
    _walk(*_lent(effect, values), motion, period, time_origin, weights, stride, means)
    return means.T


def reading_columns(effect: Effect, values: Sequence[float], motion: Array, period: float) -> Array:
    """Error of the reading per unit of each strength of a sensing effect, (n_strengths, n).

    values: (n_parameters,) of the effect, which has ``columns``. motion (2, n): position m and
    velocity m/s, a sample each ``period`` s.
    """
    errors = np.zeros((len(effect.strengths), motion.shape[1]))
    _walk_sensing(*_lent(effect, values), motion, period, errors)
    return errors


def _lent(effect: Effect, values: Sequence[float]) -> tuple[int, Array, Array, Array]:
    """Address of an effect's columns, its parameters, states and ``io``."""
    assert effect.columns is not None
    io = np.zeros(IO_SIZE + 1 + 2 * len(effect.strengths))
    io[WHEN] = 0.5
    states = np.zeros(len(effect.states) + 1)
    return address_of(effect.columns), np.array([*values, 0.0]), states, io


@compiled(nogil=True)
def _walk(law, parameters, states, io, motion, dt, time_origin, weights, stride, means):
    count = means.shape[0]
    p, s, w = parameters.ctypes.data, states.ctypes.data, io.ctypes.data
    length = weights.shape[0]
    io[DT] = dt
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


@compiled(nogil=True)
def _walk_sensing(law, parameters, states, io, motion, dt, errors):
    p, s, w = parameters.ctypes.data, states.ctypes.data, io.ctypes.data
    io[DT] = dt
    for k in range(motion.shape[1]):
        io[INDEX] = k
        io[TIME] = k * dt
        io[X] = motion[0, k]
        io[V] = motion[1, k]
        io[READING] = motion[0, k]
        call_law(law, p, s, w)
        for j in range(int(io[COLUMNS])):
            at = COLUMNS + 1 + 2 * j
            errors[int(io[at]), k] = io[at + 1]
