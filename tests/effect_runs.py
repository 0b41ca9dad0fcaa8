"""Drawn parameter values, motions and single laws stepped, for tests that name no effect."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

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
    Kind,
    U,
    V,
    X,
)
from twin.effects import load_catalogue
from twin.model.machine import AxisModel, Fitted, MachineModel, axis_table

Array = NDArray[np.float64]
Values = Mapping[str, float]

CATALOGUE = load_catalogue()
FRICTIONS = tuple(e for e in CATALOGUE.values() if e.kind is Kind.FRICTION)
MODIFIERS = tuple(e for e in CATALOGUE.values() if e.kind is Kind.MODIFIER)

GUARD = 0.123456789  # marks the memory behind a law's own states


@dataclass(frozen=True, eq=False)
class Motion:
    """A motion of one axis: x m, v m/s, u N (n,), and the same motion of the other axis."""

    dt: float
    x: Array
    v: Array
    u: Array

    def __len__(self) -> int:
        return len(self.x)

    @classmethod
    def cycles(cls, amplitude: float = 0.1, cycles: int = 2, samples: int = 4000) -> Motion:
        """Closed cycles of 1 s over +-amplitude, faster and slower, other speeds out than back."""
        dt = 1.0 / samples
        phase = 2.0 * np.pi * dt * np.arange(cycles * samples)
        bent = phase + 0.4 * np.sin(2.0 * phase + 0.5)
        v = 2.0 * np.pi * amplitude * np.cos(bent) * (1.0 + 0.8 * np.cos(2.0 * phase + 0.5))
        return cls(dt, amplitude * np.sin(bent), v, np.gradient(v, dt))

    @classmethod
    def random(cls, rng: np.random.Generator, samples: int = 400, dt: float = 1e-4) -> Motion:
        """Unrelated random numbers, with some samples at rest and many changes of direction."""
        v = rng.normal(0.0, 0.1, samples) * 10.0 ** rng.uniform(-6.0, 0.0, samples)
        v[rng.random(samples) < 0.1] = 0.0
        return cls(dt, rng.uniform(-0.2, 0.2, samples), v, rng.normal(0.0, 2.0, samples))


# --- parameter values ---------------------------------------------------------------------------


def legal(effect: Effect, values: Values) -> dict[str, float]:
    """The values, moved into their bounds and above the parameters they may not fall below."""
    bounded = {p.name: float(np.clip(values[p.name], p.lower, p.upper)) for p in effect.parameters}
    for p in effect.parameters:
        if p.at_least is not None:
            bounded[p.name] = max(bounded[p.name], bounded[p.at_least])
    return bounded


def absent(effect: Effect) -> dict[str, float]:
    """Start values with every strength zero."""
    return {p.name: 0.0 if p.strength else p.start for p in effect.parameters}


def companion(friction: Effect) -> Fitted:
    """A friction for modifiers to act on, every part of it present."""
    values = {p.name: p.start or 0.3 if p.strength else p.start for p in friction.parameters}
    return Fitted.at_start(friction, legal(friction, values))


def moderate(effect: Effect, rng: np.random.Generator, wanted: float = 0.3) -> dict[str, float]:
    """Drawn values with which the effect's action is about ``wanted`` N rms, or its most."""
    share = dict(zip(effect.starts(), rng.random(len(effect.parameters)), strict=True))

    def values(factor: float) -> dict[str, float]:
        drawn = {}
        for p in effect.parameters:
            if p.strength:
                drawn[p.name] = factor * (p.lower + share[p.name] * (p.upper - p.lower))
            else:
                drawn[p.name] = p.start * (0.8 + 0.4 * share[p.name])
        return legal(effect, drawn)

    low, high = -15.0, 0.0  # decades of the factor on the strengths
    at, seen = high, action(effect, values(1.0))
    for tries in range(60):
        if (at == 0.0 and seen < wanted) or high - low < 0.004:
            break
        off = np.log10(seen / wanted) if seen > 0.0 else np.inf
        if abs(off) < 0.004:  # to a hundredth
            break
        low, high = (at, high) if off < 0.0 else (low, at)
        at = at - off  # most actions are in proportion to the strengths
        if not low < at < high or tries % 4 == 3:
            at = 0.5 * (low + high)
        seen = action(effect, values(10.0**at))
    return values(10.0**at)


# --- running laws -------------------------------------------------------------------------------


def forces(effects: Sequence[Fitted], motion: Motion) -> dict[str, Array]:
    """Force of each effect along a measured motion, N."""
    table = axis_table({"x": AxisModel(1.0, effects=tuple(effects))})
    rows = np.zeros((len(table.entries), len(motion)))
    first, last, state, _, _ = table.axes[0]
    walk(
        table.entries, first, last, table.parameters, np.zeros(table.n_states), state,
        np.stack([motion.x, motion.v, motion.u]), np.stack([motion.x, motion.v, motion.u]),
        motion.dt, 0, rows, 1.0, 0.0,
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


def compiled(effect: Effect) -> Callable[[Array, Array, Array], None]:
    """The effect's native law as a function of three arrays."""
    pointer = ctypes.POINTER(ctypes.c_double)
    native = ctypes.CFUNCTYPE(None, pointer, pointer, pointer)(law_address(effect))
    return lambda p, s, io: native(*(a.ctypes.data_as(pointer) for a in (p, s, io)))


def trace(effect: Effect, values: Values, motion: Motion, law: Callable | None = None) -> Trace:
    """Step the compiled law, or the one given, over a motion."""
    step = law or compiled(effect)
    given = np.array([values[p.name] for p in effect.parameters] + [GUARD])
    p, own = given.copy(), len(effect.states)
    s = np.concatenate([np.zeros(own), [GUARD]])
    io = np.zeros(IO_SIZE)
    before, after = np.empty((2, len(motion), IO_SIZE))
    states = np.empty((len(motion), own))
    for k in range(len(motion)):
        sampled(io, k, motion)
        before[k] = io
        step(p, s, io)
        after[k], states[k] = io, s[:own]
    return Trace(before, after, states, s[own] != GUARD, not np.array_equal(p, given))


def action(effect: Effect, values: Values) -> float:
    """RMS of what the effect does along closed cycles: N, or um of a reading."""
    motion = Motion.cycles(samples=1000)
    own = Fitted.at_start(effect, values)
    if effect.kind is Kind.SENSING:
        seen = trace(effect, values, motion)
        return float(1e6 * np.sqrt(np.mean((seen.after - seen.before)[:, READING] ** 2)))
    if effect.kind is not Kind.MODIFIER:
        return float(np.sqrt(np.mean(forces([own], motion)[effect.name] ** 2)))
    changes = []
    for friction in FRICTIONS:
        changed = forces([companion(friction), own], motion)[friction.name]
        changes.append(np.mean((changed - _unmodified(friction.name)) ** 2))
    return float(np.sqrt(max(changes)))


@cache
def _unmodified(friction: str) -> Array:
    """The force of a friction of the catalogue by itself along the motion of ``action``, N."""
    plain = companion(CATALOGUE[friction])
    return forces([plain], Motion.cycles(samples=1000))[friction]


def with_all(model: MachineModel, rng: np.random.Generator) -> MachineModel:
    """The stage with every effect of the catalogue on every axis, save that it keeps its friction.

    Each acts with about 0.1 N.
    """
    for name, axis in model.axes.items():
        for effect in CATALOGUE.values():
            if effect.kind is not Kind.FRICTION:
                axis = axis.with_effect(Fitted.at_start(effect, moderate(effect, rng, 0.1)))
        model = model.with_axis(name, axis)
    return model
