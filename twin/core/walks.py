"""The laws along a measured motion: forces of a table's effects, and readings of an encoder.

What compiled code needs for its work is made here and lent to it: machine code that makes an array
takes as long to load as all of numba's compiler for arrays.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from twin.core.compiled import ADDRESS, KIND, P_AT, S_AT, address_of, borrow, call_at, compiled
from twin.core.native import along, axis_force, sense, slopes_of, stands, steps_of
from twin.effect import (
    A_OTHER,
    COLUMNS,
    DRY,
    DT,
    FRICTION,
    HOLD,
    INDEX,
    IO_SIZE,
    LOAD,
    MASS,
    MOVED,
    OUT,
    PRESSURE,
    READING,
    SPEEDS,
    STATIC,
    TIME,
    V_OTHER,
    VISCOUS,
    WHEN,
    X_OTHER,
    Effect,
    Kind,
    U,
    V,
    X,
)

Array = NDArray[np.float64]
Entries = NDArray[np.int64]

LOAD_ROW = 3  # of a joint's motion; the velocities of all joints follow
CHANNEL_ROW = 3  # of what is beside a motion; what else was logged, by the slots of io

_FORCE = Kind.FORCE.value
_FRICTION = Kind.FRICTION.value
_STRUCTURE = Kind.STRUCTURE.value


def walk(
    entries: Entries, first: int, last: int, parameters: Array, states: Array, at: int,
    motion: Array, others: Array, dt: float, begin: int, rows: Array, mass: float = 1.0,
    time_origin: float = 0.0,
) -> None:  # fmt: skip
    """Forces along a measured motion: the laws stepped over every sample from ``begin`` on.

    motion (3, n): position m, velocity m/s, command N; of a joint also its load N and the
    velocities of all joints (4 + n_axes, n). others (3, n): position, velocity, acceleration of
    the other axis, and channels that were logged (6, n); mass: moved mass, kg; time_origin: s, when
    sample 0 was.
    The mass that friction acts on is infinite, so that friction slides wherever v != 0: the force
    that holds a measured axis at rest is not determined.
    rows (n_entries, n): N.
    """
    structure = structure_of(entries, first, last)
    _walk(
        entries, first, structure, last, parameters, states, at, motion, others, dt, begin, rows,
        time_origin, lent_io(dt, mass), steps_of(entries, structure, last, len(states), dt),
        np.zeros((2, len(entries))),
    )  # fmt: skip


def walk_sets(
    entries: Entries, first: int, last: int, sets: Array, states_needed: int, motion: Array,
    others: Array, dt: float, begin: int, totals: Array, mass: float, time_origin: float,
    remembers: NDArray[np.bool_], path: Array,
) -> None:  # fmt: skip
    """Force of all effects together along a measured motion, for several sets of parameters.

    As ``walk``, from fresh states, less the force of each effect by itself, which costs a third of
    a walk. sets (m, n_p); totals (m, n): N. path (n,): velocity m/s that those laws follow which
    remember it, by remembers (n_entries,); all others follow that of the motion.
    """
    structure = structure_of(entries, first, last)
    laws = np.ascontiguousarray(entries[first:structure].T)
    follow = remembers[first:structure]
    _walk_sets(
        entries, laws, structure, last, sets, np.zeros((len(sets), states_needed)), motion, others,
        dt, begin, totals, time_origin, lent_io(dt, mass),
        steps_of(entries, structure, last, states_needed, dt), np.zeros((2, len(entries))), follow,
        path,
    )  # fmt: skip


def walk_sensing(
    entries: Entries, first: int, last: int, parameters: Array, states: Array, motion: Array,
    dt: float, readings: Array,
) -> None:  # fmt: skip
    """Encoder readings (n,) m along a motion (2 or more, n): position m, velocity m/s."""
    _walk_sensing(entries, first, last, parameters, states, motion, dt, readings, lent_io(dt, 0.0))


def structure_of(entries: Entries, first: int, last: int) -> int:
    """The first entry of those of structure effects, which are the last."""
    return int(last) - int(np.count_nonzero(entries[first:last, KIND] == _STRUCTURE))


def lent_io(dt: float, mass: float) -> Array:
    """io (IO_SIZE,) with what no sample changes."""
    io = np.zeros(IO_SIZE)
    io[[DT, WHEN, MASS, MOVED]] = dt, 0.5, 1e300, mass
    return io


@compiled(inline=True)
def arrive(io, motion, others, k, begin, dt, time_origin):
    """What sample k of a motion brings into io."""
    io[INDEX] = begin + k
    io[TIME] = time_origin + (begin + k) * dt
    io[X] = motion[0, k]
    io[V] = motion[1, k]
    io[U] = motion[2, k]
    io[X_OTHER] = others[0, k]
    io[V_OTHER] = others[1, k]
    io[A_OTHER] = others[2, k]
    for j in range(others.shape[0] - CHANNEL_ROW):
        io[PRESSURE + j] = others[CHANNEL_ROW + j, k]
    if motion.shape[0] > LOAD_ROW:
        io[LOAD] = motion[LOAD_ROW, k]
        for j in range(motion.shape[0] - LOAD_ROW - 1):
            io[SPEEDS + j] = motion[LOAD_ROW + 1 + j, k]


@compiled(nogil=True)
def _walk(
    entries, first, structure, last, parameters, states, at, motion, others, dt, begin, rows,
    time_origin, io, steps, row,
):  # fmt: skip
    entries, parameters, states = borrow((entries, parameters, states))
    p, s = parameters.ctypes.data, states.ctypes.data
    standing = structure < last and stands(entries, structure, last, p, s, borrow(io))
    slopes = slopes_of(motion[1], dt) if structure < last else motion[1]
    for k in range(motion.shape[1]):
        arrive(io, motion, others, k, begin, dt, time_origin)
        lent = borrow(row)
        axis_force(entries, first, structure, parameters, states, at, borrow(io), lent, 0)
        if structure < last:
            along(entries, structure, last, p, s, borrow(io), slopes, k, standing, steps, lent)
        for i in range(first, last):
            rows[i, k] = row[0, i]


@compiled(nogil=True)
def _walk_sets(
    entries, laws, structure, last, sets, states, motion, others, dt, begin, totals, time_origin,
    io, steps, row, remembers, path,
):  # fmt: skip
    addresses, kinds, p_at, s_at = laws[ADDRESS], laws[KIND], 8 * laws[P_AT], 8 * laws[S_AT]
    w, last_law = io.ctypes.data, laws.shape[1]
    first_p, next_p = sets.ctypes.data, sets.strides[0]
    first_s, next_s = states.ctypes.data, states.strides[0]
    stiff = 1e300 / dt
    slopes = slopes_of(motion[1], dt) if structure < last else motion[1]
    frictions = np.zeros(sets.shape[0])
    standing = np.zeros(sets.shape[0], dtype=np.bool_)
    for j in range(sets.shape[0] if structure < last else 0):
        p, s = first_p + j * next_p, first_s + j * next_s
        standing[j] = stands(entries, structure, last, p, s, borrow(io))
    for k in range(motion.shape[1]):
        arrive(io, motion, others, k, begin, dt, time_origin)
        velocity, command, followed = motion[1, k], motion[2, k], path[k]
        stop = stiff * velocity
        for j in range(sets.shape[0]):
            p, s = first_p + j * next_p, first_s + j * next_s
            friction = frictions[j]
            io[U] = command
            io[DRY] = 1.0
            io[STATIC] = 1.0
            io[VISCOUS] = 1.0
            io[FRICTION] = friction
            total = 0.0
            for i in range(last_law):
                io[HOLD] = stop + io[U] + total
                io[OUT] = 0.0
                io[V] = followed if remembers[i] else velocity
                call_at(addresses[i], (p + p_at[i], s + s_at[i], w))
                if kinds[i] == _FORCE:
                    total += io[OUT]
                elif kinds[i] == _FRICTION:
                    friction = io[OUT]
            frictions[j] = friction
            total = total - friction + (io[U] - command)
            if structure < last:
                lent, own_io = borrow(row), borrow(io)
                io[V] = velocity
                along(entries, structure, last, p, s, own_io, slopes, k, standing[j], steps, lent)
                for i in range(structure, last):
                    total += row[0, i]
            totals[j, k] = total


@compiled(nogil=True)
def _walk_sensing(entries, first, last, parameters, states, motion, dt, readings, io):
    for k in range(motion.shape[1]):
        io[INDEX] = k
        io[TIME] = k * dt
        io[X] = motion[0, k]
        io[V] = motion[1, k]
        readings[k] = sense(entries, first, last, parameters, states, io, motion[0, k])


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
    io = np.zeros(IO_SIZE + 1 + 2 * len(effect.strengths))
    io[[DT, WHEN]] = period, 0.5
    states, law = np.zeros(len(effect.states) + 1), address_of(effect.columns)
    count = max((motion.shape[1] - len(weights)) // stride + 1, 0)
    means = np.zeros((count, len(effect.strengths)))
    _averaged(
        law, np.array([*values, 0.0]), states, io, motion, period, time_origin, weights, stride,
        means,
    )  # fmt: skip
    return means.T


def reading_columns(effect: Effect, values: Sequence[float], motion: Array, period: float) -> Array:
    """Error of the reading per unit of each strength of a sensing effect, (n_strengths, n).

    values: (n_parameters,) of the effect, which has ``columns``. motion (2, n): position m and
    velocity m/s, a sample each ``period`` s.
    """
    rows = np.vstack([motion, np.zeros(motion.shape[1])])  # no sensing effect reads a command
    errors = averaged_columns(effect, values, rows, period, 0.0, np.ones(1), 1)
    return np.ascontiguousarray(errors)


@compiled(nogil=True)
def _averaged(law, parameters, states, io, motion, dt, time_origin, weights, stride, means):
    count = means.shape[0]
    p, s, w = parameters.ctypes.data, states.ctypes.data, io.ctypes.data
    length = weights.shape[0]
    for k in range(motion.shape[1]):
        io[INDEX] = k
        io[TIME] = time_origin + k * dt
        io[X] = motion[0, k]
        io[V] = motion[1, k]
        io[U] = motion[2, k]
        io[READING] = motion[0, k]
        call_at(law, (p, s, w))
        first = max((k - length + stride) // stride, 0)
        for i in range(first, min(k // stride + 1, count)):
            weight = weights[k - i * stride]
            for j in range(int(io[COLUMNS])):
                at = COLUMNS + 1 + 2 * j
                means[i, int(io[at])] += weight * io[at + 1]
