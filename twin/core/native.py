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

from twin.core.attached_masses import answers, settle
from twin.core.calling import ADDRESS, KIND, P_AT, S_AT, call_law, doubles_at, law_address
from twin.core.compiled import compiled
from twin.effect import (
    DRY,
    DT,
    FRICTION,
    HOLD,
    MASS,
    MOVED,
    OUT,
    READING,
    STATIC,
    VISCOUS,
    Effect,
    Kind,
    U,
    V,
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


@dataclass(frozen=True)
class Table:
    """A model as plain arrays.

    entries (n, 4): law address, kind, first parameter, first state. parameters (n_p,).
    axes: for each axis (first entry, last entry, first state, first sensing entry, last sensing
    entry). labels: (axis name, effect name) of each entry. masses (n_axes,) kg.
    """

    entries: NDArray[np.int64]
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
        entries=np.array(rows, dtype=np.int64).reshape(-1, 4),
        parameters=np.array([*parameters, 0.0]),
        axes=np.array(spans, dtype=np.int64),
        masses=np.array(masses, dtype=float),
        n_states=n_states,
        labels=tuple(labels),
    )
