"""Laws stepped along a motion: one by itself, or several as a simulation calls them."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from twin.core.native import law_address, walk
from twin.effect import (
    DRY,
    DT,
    HOLD,
    INDEX,
    IO_SIZE,
    MASS,
    READING,
    STATIC,
    TIME,
    V_OTHER,
    VISCOUS,
    WHEN,
    X_OTHER,
    Effect,
    U,
    V,
    X,
)
from twin.laws.motion import Array, Motion
from twin.model.machine import AxisModel, Fitted, axis_table

Values = Mapping[str, float]


def forces(effects: Sequence[Fitted], motion: Motion) -> dict[str, Array]:
    """Force of each effect along a measured motion, (n,) N; of an actuation what it changed."""
    table = axis_table({"x": AxisModel(1.0, effects=tuple(effects))})
    rows = np.zeros((len(table.entries), len(motion)))
    first, last, state, _, _ = table.axes[0]
    signals = np.stack([motion.x, motion.v, motion.u])
    walk(
        table.entries, first, last, table.parameters, np.zeros(table.n_states), state, signals,
        signals, motion.dt, 0, rows, 1.0, 0.0,
    )  # fmt: skip
    return {name: rows[i] for i, (_, name) in enumerate(table.labels)}


def sampled(io: Array, k: int, motion: Motion) -> None:
    """Fill io as a simulation does before a law."""
    io[:] = 0.0
    io[INDEX], io[TIME], io[DT], io[MASS] = k, k * motion.dt, motion.dt, 1.0
    io[X], io[V], io[U] = motion.x[k], motion.v[k], motion.u[k]
    io[X_OTHER], io[V_OTHER] = 0.5 * io[X], -0.5 * io[V]
    io[DRY] = io[STATIC] = io[VISCOUS] = 1.0
    io[HOLD] = io[V] / motion.dt + io[U]
    io[READING] = io[X]
    io[WHEN] = 1.0


@dataclass(frozen=True, eq=False)
class Trace:
    """One law stepped by itself as in a simulation.

    before, after: io (n, IO_SIZE) around each sample; states (n, n_states) after each sample;
    spilled: it wrote behind its own states; p_changed: it wrote its parameters.
    """

    before: Array
    after: Array
    states: Array
    spilled: bool
    p_changed: bool


_MARK = 0.123456789  # in the memory behind a law's own parameters and states


def compiled(effect: Effect) -> Callable[[Array, Array, Array], None]:
    """The effect's native law as a function of three arrays."""
    pointer = ctypes.POINTER(ctypes.c_double)
    native = ctypes.CFUNCTYPE(None, pointer, pointer, pointer)(law_address(effect))
    return lambda p, s, io: native(*(a.ctypes.data_as(pointer) for a in (p, s, io)))


def trace(effect: Effect, values: Values, motion: Motion, law: Callable | None = None) -> Trace:
    """Step the compiled law, or the one given, over a motion."""
    step = law or compiled(effect)
    given = np.array([values[p.name] for p in effect.parameters] + [_MARK])
    p, own = given.copy(), len(effect.states)
    s = np.concatenate([np.zeros(own), [_MARK]])
    io = np.zeros(IO_SIZE)
    before, after = np.empty((2, len(motion), IO_SIZE))
    states = np.empty((len(motion), own))
    for k in range(len(motion)):
        sampled(io, k, motion)
        before[k] = io
        step(p, s, io)
        after[k], states[k] = io, s[:own]
    return Trace(before, after, states, s[own] != _MARK, not np.array_equal(p, given))
