"""The compiled core: laws as native functions, walked as a table of addresses.

Each law compiles by itself, once, and is cached on disk; a model is plain arrays of addresses,
offsets, parameters and states, so composing a model compiles nothing. The MuJoCo callback and the
reduced stepper walk the same table through ``axis_force``, so the two agree to rounding.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numba
import numpy as np
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic
from numpy.typing import NDArray

from twin.effect import (
    A_OTHER,
    DRY,
    DT,
    FRICTION,
    HOLD,
    INDEX,
    IO_SIZE,
    MASS,
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
    Law,
    U,
    V,
    X,
)
from twin.errors import InputError

DOUBLES = types.CPointer(types.float64)
LAW_SIGNATURE = types.void(DOUBLES, DOUBLES, DOUBLES)

# Columns of the entry table, one row an effect.
ADDRESS, KIND, P_AT, S_AT = range(4)
# States every axis has before those of its effects.
LAST_FRICTION, LAST_VELOCITY, LAST_ACCELERATION = range(3)
AXIS_STATES = 3

_FORCE = Kind.FORCE.value
_FRICTION = Kind.FRICTION.value
_ACTUATION = Kind.ACTUATION.value


@cache
def law_address(effect: Effect) -> int:
    """Address of the effect's compiled law; compiles at the first use on this machine.

    Raises InputError where the law cannot be compiled.
    """
    try:
        return _compile(effect.law).address
    except numba.core.errors.NumbaError as error:
        reason = next((line for line in str(error).splitlines()[1:] if line.strip()), "")
        raise InputError(
            f"effect '{effect.name}': its law cannot be compiled: {reason.strip()}; use only "
            "numbers, math functions and the arrays p, s, io"
        ) from error


@cache  # the native code must live as long as its address
def _compile(law: Law) -> Any:
    return numba.cfunc(LAW_SIGNATURE, cache=True, error_model="numpy")(law)


@intrinsic
def call_law(typingctx, address, p, s, io):
    """Call the law at ``address`` with three addresses of doubles."""

    def codegen(context, builder, signature, args):
        double_p = context.get_value_type(types.float64).as_pointer()
        void = context.get_value_type(types.void)
        fnty = cgutils.ir.FunctionType(void, [double_p] * 3)
        fn = builder.inttoptr(args[0], fnty.as_pointer())
        builder.call(fn, [builder.inttoptr(a, double_p) for a in args[1:]])
        return context.get_dummy_value()

    return types.void(types.int64, types.int64, types.int64, types.int64), codegen


@intrinsic
def doubles_at(typingctx, address):
    """Pointer to doubles at an address."""

    def codegen(context, builder, signature, args):
        return builder.inttoptr(args[0], context.get_value_type(DOUBLES))

    return DOUBLES(types.int64), codegen


@intrinsic
def borrow(typingctx, arrays):
    """Arrays, alone or in a tuple, without their reference counts; their owner must keep them.

    In a loop over samples, counting the references to every row costs as much as the laws.
    """

    def codegen(context, builder, signature, args):
        return _lend(context, builder, signature.return_type, args[0])

    return arrays(arrays), codegen


def _lend(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    if isinstance(kind, types.BaseTuple):
        items = zip(kind, cgutils.unpack_tuple(builder, value), strict=True)
        return context.make_tuple(builder, kind, [_lend(context, builder, *i) for i in items])
    lent = context.make_array(kind)(context, builder, value=value)
    lent.meminfo = cgutils.get_null_value(lent.meminfo.type)
    lent.parent = cgutils.get_null_value(lent.parent.type)
    return lent._getvalue()


@numba.njit(cache=True, inline="always", error_model="numpy")
def axis_force(entries, first, last, parameters, states, at, io, rows, k):
    """Force on one axis in N, actuator included; states advance one sample.

    entries (n, 4); parameters, states, io: flat doubles; at: where this axis' states begin.
    io holds INDEX, TIME, DT, X, V, U, MASS and the other axis on entry. rows[k, i] receives the
    force that entry i puts on the axis.
    """
    rate = 1.0 / io[DT]
    stopping = io[MASS] * io[V] * rate
    io[DRY] = 1.0
    io[STATIC] = 1.0
    io[VISCOUS] = 1.0
    io[FRICTION] = states[at + LAST_FRICTION]
    p = parameters.ctypes.data
    s = states.ctypes.data
    w = io.ctypes.data
    total = 0.0
    friction = 0.0
    for i in range(first, last):
        kind = entries[i, KIND]
        before = io[U]
        io[HOLD] = stopping + before + total
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
    states[at + LAST_FRICTION] = friction
    states[at + LAST_ACCELERATION] = (io[V] - states[at + LAST_VELOCITY]) * rate
    states[at + LAST_VELOCITY] = io[V]
    return total - friction + io[U]


@numba.njit(cache=True, error_model="numpy", nogil=True)
def walk(entries, first, last, parameters, states, at, motion, others, dt, begin, rows):
    """Forces along a measured motion: the laws stepped over every sample from ``begin`` on.

    motion (3, n): position m, velocity m/s, command N; others (3, n): position, velocity,
    acceleration of the other axis. Friction slides wherever v != 0, by an infinite mass: what holds
    a measured axis at rest cannot be told. rows (n_entries, n): N.
    """
    entries, parameters, states = borrow((entries, parameters, states))
    io = np.zeros(IO_SIZE)
    row = np.zeros((1, entries.shape[0]))
    io[DT] = dt
    io[WHEN] = 0.5
    io[MASS] = 1e300
    for k in range(motion.shape[1]):
        io[INDEX] = begin + k
        io[TIME] = (begin + k) * dt
        io[X] = motion[0, k]
        io[V] = motion[1, k]
        io[U] = motion[2, k]
        io[X_OTHER] = others[0, k]
        io[V_OTHER] = others[1, k]
        io[A_OTHER] = others[2, k]
        axis_force(entries, first, last, parameters, states, at, borrow(io), borrow(row), 0)
        for i in range(first, last):
            rows[i, k] = row[0, i]


@numba.njit(cache=True, inline="always", error_model="numpy")
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
