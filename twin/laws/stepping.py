"""Laws stepped along a motion: one by itself, or several as a simulation calls them."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from twin.core.native import law_address
from twin.core.walks import walk
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


def sampled(motion: Motion) -> Array:
    """What a simulation fills io with before a law, (n, IO_SIZE)."""
    io = np.zeros((len(motion), IO_SIZE))
    index = np.arange(len(motion))
    io[:, INDEX], io[:, TIME], io[:, DT], io[:, MASS] = index, index * motion.dt, motion.dt, 1.0
    io[:, X], io[:, V], io[:, U] = motion.x, motion.v, motion.u
    io[:, X_OTHER], io[:, V_OTHER] = 0.5 * motion.x, -0.5 * motion.v
    io[:, [DRY, STATIC, VISCOUS]] = 1.0
    io[:, HOLD] = motion.v / motion.dt + motion.u
    io[:, READING] = motion.x
    io[:, WHEN] = 1.0
    return io


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


def compiled(effect: Effect, *arrays: Array) -> Callable[[], object]:
    """The effect's native law on these arrays of parameters, states and io."""
    pointer = ctypes.POINTER(ctypes.c_double)
    native = ctypes.CFUNCTYPE(None, pointer, pointer, pointer)(law_address(effect))
    return partial(native, *(a.ctypes.data_as(pointer) for a in arrays))


def trace(effect: Effect, values: Values, motion: Motion, law: Callable | None = None) -> Trace:
    """Step the compiled law, or the one given, over a motion."""
    given = np.array([values[p.name] for p in effect.parameters] + [_MARK])
    p, own = given.copy(), len(effect.states)
    s = np.concatenate([np.zeros(own), [_MARK]])
    io = np.zeros(IO_SIZE)
    step = partial(law, p, s, io) if law else compiled(effect, p, s, io)
    before = sampled(motion)
    after, states = np.empty_like(before), np.empty((len(motion), own))
    for k, row in enumerate(before):
        io[:] = row
        step()
        after[k], states[k] = io, s[:own]
    return Trace(before, after, states, s[own] != _MARK, not np.array_equal(p, given))
