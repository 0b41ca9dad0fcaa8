"""The compiled core: laws as native functions, walked as a table of addresses.

Each law compiles by itself, once, and is cached on disk; a model is plain arrays of addresses,
offsets, parameters and states, so composing a model compiles nothing. The MuJoCo callback and the
reduced stepper walk the same table through ``axis_force``, so the two agree to rounding.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from twin.core.attached_masses import along, answers, settle, stands
from twin.core.calling import ADDRESS, KIND, P_AT, S_AT, borrow, call_law, doubles_at, law_address
from twin.core.compiled import compiled
from twin.effect import (
    A_OTHER,
    DRY,
    DT,
    FRICTION,
    HOLD,
    INDEX,
    IO_SIZE,
    MASS,
    MOVED,
    OUT,
    READING,
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

# States every axis has before those of its effects.
LAST_FRICTION, LAST_VELOCITY, LAST_ACCELERATION = range(3)
AXIS_STATES = 3

_FORCE = Kind.FORCE.value
_FRICTION = Kind.FRICTION.value
_STRUCTURE = Kind.STRUCTURE.value


@compiled(inline=True)
def axis_force(entries, first, last, parameters, states, at, io, rows, k):
    """Forces on one axis, N: (of actuator and effects, of its structure); states advance a sample.

    entries (n, 4); parameters, states, io: flat doubles; at: where this axis' states begin.
    io holds INDEX, TIME, DT, X, V, U, MASS, MOVED, WHEN and the other axis on entry.
    rows[k, i] receives the force that entry i puts on the axis.
    """
    rate = 1.0 / io[DT]
    mass = io[MASS]
    stop = mass * io[V] * rate
    io[DRY] = 1.0
    io[STATIC] = 1.0
    io[VISCOUS] = 1.0
    p = parameters.ctypes.data
    s = states.ctypes.data
    w = io.ctypes.data
    own = doubles_at(s + 8 * at)
    io[FRICTION] = own[LAST_FRICTION]
    structure = last
    while structure > first and entries[structure - 1, KIND] == _STRUCTURE:
        structure -= 1
    answered = (0.0, 0.0, 0.0, 0.0)
    if structure < last:
        answered = answers(entries, structure, last, p, s, io)
        share = mass / (mass - answered[1])  # of a force, that moves the nominal mass
        moving = share + answered[3] / io[MOVED]
        stop += share * answered[0] + answered[2]
        stop /= moving
        io[MASS] = mass / moving
    total = 0.0
    friction = 0.0
    for i in range(first, structure):
        kind = entries[i, KIND]
        before = io[U]
        io[HOLD] = stop + before + total
        io[OUT] = 0.0
        call_law(
            int(entries[i, ADDRESS]),
            p + 8 * int(entries[i, P_AT]),
            s + 8 * int(entries[i, S_AT]),
            w,
        )
        if kind == _FORCE:
            rows[k, i] = io[OUT]
            total += io[OUT]
        elif kind == _FRICTION:
            friction = io[OUT]
            rows[k, i] = -friction
        else:
            rows[k, i] = io[U] - before
    io[MASS] = mass
    net = total - friction + io[U]
    added = 0.0
    if structure < last:
        added = settle(entries, structure, last, p, s, io, net, answered, rows, k)
    own[LAST_FRICTION] = friction
    own[LAST_ACCELERATION] = (io[V] - own[LAST_VELOCITY]) * rate
    own[LAST_VELOCITY] = io[V]
    return net, added


@compiled(nogil=True)
def walk(
    entries,
    first,
    last,
    parameters,
    states,
    at,
    motion,
    others,
    dt,
    begin,
    rows,
    mass=1.0,
    time_origin=0.0,
):
    """Forces along a measured motion: the laws stepped over every sample from ``begin`` on.

    motion (3, n): position m, velocity m/s, command N; others (3, n): position, velocity,
    acceleration of the other axis; mass: moved mass, kg; time_origin: s, when sample 0 was.
    The mass that friction acts on is infinite, so that friction slides wherever v != 0: the force
    that holds a measured axis at rest is not determined.
    rows (n_entries, n): N.
    """
    entries, parameters, states = borrow((entries, parameters, states))
    io = np.zeros(IO_SIZE)
    row = np.zeros((2, entries.shape[0]))
    io[DT] = dt
    io[WHEN] = 0.5
    io[MASS] = 1e300
    io[MOVED] = mass
    others_end = last
    while others_end > first and int(entries[others_end - 1, KIND]) == _STRUCTURE:
        others_end -= 1
    p, s = parameters.ctypes.data, states.ctypes.data
    standing = others_end < last and stands(entries, others_end, last, p, s, borrow(io))
    for k in range(motion.shape[1]):
        io[INDEX] = begin + k
        io[TIME] = time_origin + (begin + k) * dt
        io[X] = motion[0, k]
        io[V] = motion[1, k]
        io[U] = motion[2, k]
        io[X_OTHER] = others[0, k]
        io[V_OTHER] = others[1, k]
        io[A_OTHER] = others[2, k]
        lent = borrow(row)
        axis_force(entries, first, others_end, parameters, states, at, borrow(io), lent, 0)
        if others_end < last:
            along(entries, others_end, last, p, s, borrow(io), motion[1], k, standing, lent)
        for i in range(first, last):
            rows[i, k] = row[0, i]


@compiled(nogil=True)
def walk_sets(
    entries, first, last, sets, states_needed, motion, others, dt, begin, totals, mass, time_origin
):
    """Force of all effects together along a measured motion, for several sets of parameters.

    As ``walk``, from fresh states, less the force of each effect by itself, which costs a third of
    a walk. sets (m, n_p); totals (m, n): N.
    """
    io = np.zeros(IO_SIZE)
    w = io.ctypes.data
    structure = last
    while structure > first and int(entries[structure - 1, KIND]) == _STRUCTURE:
        structure -= 1
    laws = structure - first
    addresses, kinds, p_at, s_at = entries[first:structure].astype(np.int64).T.copy()
    row = np.zeros((2, entries.shape[0]))
    io[DT] = dt
    io[WHEN] = 0.5
    io[MASS] = 1e300
    io[MOVED] = mass
    stiff = 1e300 / dt
    for j in range(sets.shape[0]):
        states = np.zeros(states_needed)
        p, s = sets[j].ctypes.data, states.ctypes.data
        own, friction = totals[j], 0.0
        standing = structure < last and stands(entries, structure, last, p, s, borrow(io))
        for k in range(motion.shape[1]):
            io[INDEX] = begin + k
            io[TIME] = time_origin + (begin + k) * dt
            io[X] = motion[0, k]
            io[V] = motion[1, k]
            io[U] = motion[2, k]
            io[X_OTHER] = others[0, k]
            io[V_OTHER] = others[1, k]
            io[A_OTHER] = others[2, k]
            io[DRY] = 1.0
            io[STATIC] = 1.0
            io[VISCOUS] = 1.0
            io[FRICTION] = friction
            stop = stiff * motion[1, k]
            total = 0.0
            for i in range(laws):
                io[HOLD] = stop + io[U] + total
                io[OUT] = 0.0
                call_law(addresses[i], p + 8 * p_at[i], s + 8 * s_at[i], w)
                if kinds[i] == _FORCE:
                    total += io[OUT]
                elif kinds[i] == _FRICTION:
                    friction = io[OUT]
            own[k] = total - friction + (io[U] - motion[2, k])
            if structure < last:
                lent = borrow(row)
                along(entries, structure, last, p, s, borrow(io), motion[1], k, standing, lent)
                for i in range(structure, last):
                    own[k] += row[0, i]


@compiled(inline=True)
def sense(entries, first, last, parameters, states, io, position):
    """Encoder reading of a true position: the sensing effects in order."""
    io[READING] = position
    for i in range(first, last):
        call_law(
            int(entries[i, ADDRESS]),
            parameters.ctypes.data + 8 * int(entries[i, P_AT]),
            states.ctypes.data + 8 * int(entries[i, S_AT]),
            io.ctypes.data,
        )
    return io[READING]


@compiled(nogil=True)
def walk_sensing(entries, first, last, parameters, states, motion, dt, readings):
    """Encoder readings (n,) m along a motion (2 or more, n): position m, velocity m/s."""
    io = np.zeros(IO_SIZE)
    io[DT] = dt
    for k in range(motion.shape[1]):
        io[INDEX] = k
        io[TIME] = k * dt
        io[X] = motion[0, k]
        io[V] = motion[1, k]
        readings[k] = sense(entries, first, last, parameters, states, io, motion[0, k])


@dataclass(frozen=True)
class Table:
    """A model as plain arrays.

    entries (n, 4): law address, kind, first parameter, first state, as doubles, which hold any
    address below 2^53 exactly, so that a table can travel in an mjModel. parameters (n_p,).
    axes: for each axis (first entry, last entry, first state, first sensing entry, last sensing
    entry). labels: (axis name, effect name) of each entry. masses (n_axes,) kg.
    """

    entries: NDArray[np.float64]
    parameters: NDArray[np.float64]
    axes: NDArray[np.int64]
    masses: NDArray[np.float64]
    n_states: int
    labels: tuple[tuple[str, str], ...]


def build_table(
    axes: Mapping[str, Sequence[tuple[Effect, Sequence[float]]]], masses: Sequence[float]
) -> Table:
    """Table of a model: axis name -> its effects with their parameter values in catalogue order."""
    rows: list[tuple[int, int, int, int]] = []
    spans: list[tuple[int, int, int, int, int]] = []
    parameters: list[float] = []
    labels: list[tuple[str, str]] = []
    n_states = 0
    for axis, effects in axes.items():
        state_at = n_states
        n_states += AXIS_STATES
        begin = len(rows)
        sensing = begin
        for effect, values in sorted(effects, key=lambda e: e[0].kind.value):
            rows.append((law_address(effect), effect.kind.value, len(parameters), n_states))
            labels.append((axis, effect.name))
            parameters.extend(values)
            n_states += len(effect.states)
            sensing += effect.kind is Kind.SENSING
        spans.append((sensing, len(rows), state_at, begin, sensing))
    return Table(
        entries=np.array(rows, dtype=float).reshape(-1, 4),
        parameters=np.array([*parameters, 0.0]),
        axes=np.array(spans, dtype=np.int64),
        masses=np.array(masses, dtype=float),
        n_states=n_states,
        labels=tuple(labels),
    )
