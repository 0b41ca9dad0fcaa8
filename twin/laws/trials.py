"""How a law is tried: along which motions, with which values, by itself or as a simulation does."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache, partial

import numpy as np

from twin.core.compiled import law_address
from twin.core.walks import walk
from twin.effect import (
    DRY,
    DT,
    HOLD,
    INDEX,
    IO_SIZE,
    LOAD,
    MASS,
    PRESSURE,
    READING,
    SPEEDS,
    STATIC,
    TEMPERATURE,
    TIME,
    V_OTHER,
    VISCOUS,
    WHEN,
    X_OTHER,
    Effect,
    Kind,
    Parameter,
    U,
    V,
    X,
)
from twin.effects import load_catalogue
from twin.model.machine import AxisModel, Fitted, axis_table
from twin.model.units import Scale, has_size
from twin.signals import Array, rate


@dataclass(frozen=True, eq=False)
class TrialMotion:
    """A motion of one axis: x m, v m/s, u N (n,) every ``dt`` s."""

    dt: float
    x: Array
    v: Array
    u: Array

    def __len__(self) -> int:
        return len(self.x)

    @classmethod
    def cycles(cls, amplitude: float = 0.1, cycles: int = 2, samples: int = 4000) -> TrialMotion:
        """Closed cycles of 1 s over +-amplitude (m), faster and slower, other speeds out than back.

        samples: in a cycle.
        """
        dt = 1.0 / samples
        phase = 2.0 * np.pi * dt * np.arange(cycles * samples)
        bent = phase + 0.4 * np.sin(2.0 * phase + 0.5)
        v = 2.0 * np.pi * amplitude * np.cos(bent) * (1.0 + 0.8 * np.cos(2.0 * phase + 0.5))
        return cls(dt, amplitude * np.sin(bent), v, rate(v, dt))

    @classmethod
    def random(cls, rng: np.random.Generator, samples: int = 400, dt: float = 1e-4) -> TrialMotion:
        """Unrelated random numbers, with some samples at rest and many changes of direction."""
        v = rng.normal(0.0, 0.1, samples) * 10.0 ** rng.uniform(-6.0, 0.0, samples)
        v[rng.random(samples) < 0.1] = 0.0
        return cls(dt, rng.uniform(-0.2, 0.2, samples), v, rng.normal(0.0, 2.0, samples))


Values = Mapping[str, float]


def forces(effects: Sequence[Fitted], motion: TrialMotion) -> dict[str, Array]:
    """Force of each effect along a measured motion, (n,) N; of an actuation what it changed."""
    table = axis_table({"x": AxisModel(1.0, effects=tuple(effects))})
    rows = np.zeros((len(table.entries), len(motion)))
    states = np.zeros(table.n_states + 1)  # a law on trial may write behind its own
    first, last, state, _, _ = table.axes[0]
    signals = np.stack([motion.x, motion.v, motion.u, motion.u, motion.v])  # load, another joint
    other = np.stack([-motion.x, -motion.v, motion.u])  # axis, which moves against this one
    walk(
        table.entries, first, last, table.parameters, states, state, signals,
        np.vstack([other, channels(len(motion))]), motion.dt, 0, rows, 1.0, 0.0,
    )  # fmt: skip
    return {name: rows[i] for i, (_, name) in enumerate(table.labels)}


def channels(count: int) -> Array:
    """What is logged beside a motion (3, count): it stays, whatever the axis does."""
    return np.repeat([[0.7], [-0.4], [0.9]], count, axis=1)


def sampled(motion: TrialMotion) -> Array:
    """What a simulation fills io with before a law, (n, IO_SIZE)."""
    io = np.zeros((len(motion), IO_SIZE))
    index = np.arange(len(motion))
    io[:, INDEX], io[:, TIME], io[:, DT], io[:, MASS] = index, index * motion.dt, motion.dt, 1.0
    io[:, X], io[:, V], io[:, U] = motion.x, motion.v, motion.u
    io[:, X_OTHER], io[:, V_OTHER] = 0.5 * motion.x, -0.5 * motion.v
    io[:, [DRY, STATIC, VISCOUS]] = 1.0
    io[:, HOLD] = motion.v / motion.dt + motion.u
    io[:, READING] = motion.x
    io[:, LOAD], io[:, SPEEDS] = motion.u, motion.v
    io[:, PRESSURE : TEMPERATURE + 1] = channels(len(motion)).T
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


def compiled(effect: Effect, *arrays: Array) -> Callable[[], object]:
    """The effect's native law on these arrays of parameters, states and io."""
    pointer = ctypes.POINTER(ctypes.c_double)
    native = ctypes.CFUNCTYPE(None, pointer, pointer, pointer)(law_address(effect))
    return partial(native, *(a.ctypes.data_as(pointer) for a in arrays))


def trace(
    effect: Effect, values: Values, motion: TrialMotion, law: Callable | None = None
) -> Trace:
    """Step the compiled law, or the one given, over a motion."""
    mark = 0.123456789  # in the memory behind a law's own parameters and states
    given = np.array([*(values[p.name] for p in effect.parameters), mark])
    p, own = given.copy(), len(effect.states)
    s = np.concatenate([np.zeros(own), [mark]])
    io = np.zeros(IO_SIZE)
    step = partial(law, p, s, io) if law else compiled(effect, p, s, io)
    before = sampled(motion)
    after, states = np.empty_like(before), np.empty((len(motion), own))
    for k, row in enumerate(before):
        io[:] = row
        step()
        after[k], states[k] = io, s[:own]
    return Trace(before, after, states, s[own] != mark, not np.array_equal(p, given))


TRIED = Scale(1.0, 0.1, 1.0)  # N, m, s: about the motion of ``action``


@cache
def of_kind(kind: Kind) -> tuple[Effect, ...]:
    """The effects of this package's catalogue of one kind: company for the effect that is tried."""
    return tuple(e for e in load_catalogue().values() if e.kind is kind)


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


def extremes(effect: Effect, rng: np.random.Generator) -> Iterator[dict[str, float]]:
    """Values at and near the bounds: all at once, one at a time, and drawn over all decades."""
    start = effect.starts()
    choices = {
        p.name: (p.lower, p.upper, float(np.clip(1e-300, p.lower, p.upper)), p.start)
        for p in effect.parameters
    }
    for which in range(4):
        yield legal(effect, {name: c[which] for name, c in choices.items()})
    for name, choice in choices.items():
        for value in choice:
            yield legal(effect, {**start, name: value})
    for _ in range(20):
        sizes = 10.0 ** rng.uniform(-12.0, 9.0, len(start)) * rng.choice([-1.0, 1.0], len(start))
        yield legal(effect, dict(zip(start, sizes, strict=True)))


def companion(friction: Effect) -> Fitted:
    """A friction for modifiers to act on, every part of it present."""
    values = {p.name: p.start or 0.3 if p.strength else p.start for p in friction.parameters}
    return Fitted.at_start(friction, legal(friction, values))


def _span(p: Parameter) -> tuple[float, float]:
    """Bounds of a strength, or what is enormous along the motion of ``action``."""
    far = 10.0 * TRIED.size(p.unit) if has_size(p.unit) else np.inf  # times what is usual there
    return max(p.lower, -far), min(p.upper, far)


def moderate(effect: Effect, rng: np.random.Generator, wanted: float = 0.3) -> dict[str, float]:
    """Drawn values with which the effect's action is about ``wanted`` N rms, or its most."""
    share = dict(zip(effect.starts(), rng.random(len(effect.parameters)), strict=True))

    def values(factor: float) -> dict[str, float]:
        drawn = {}
        for p in effect.parameters:
            if p.strength:
                least, most = _span(p)
                drawn[p.name] = factor * (least + share[p.name] * (most - least))
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


def action(effect: Effect, values: Values) -> float:
    """RMS of what the effect does along closed cycles: N, or um of a reading."""
    most = max(float(np.mean(row**2)) for row in acted(effect, values, _cycles()))
    return float((1e6 if effect.kind is Kind.SENSING else 1.0) * np.sqrt(most))


def acted(effect: Effect, values: Values, motion: TrialMotion) -> list[Array]:
    """What the effect does along a motion, (n,) each: for a modifier, to each friction."""
    own = Fitted.at_start(effect, values)
    if effect.kind is Kind.SENSING:
        seen = trace(effect, values, motion)
        return [(seen.after - seen.before)[:, READING]]
    if effect.kind is not Kind.MODIFIER:
        return [forces([own], motion)[effect.name]]
    return [
        forces([companion(friction), own], motion)[friction.name] - _unmodified(friction, motion)
        for friction in of_kind(Kind.FRICTION)
    ]


@cache
def _cycles() -> TrialMotion:
    """The motion of ``action``."""
    return TrialMotion.cycles(samples=1000)


@lru_cache(maxsize=32)  # along the motion of ``action`` it is asked for again and again
def _unmodified(friction: Effect, motion: TrialMotion) -> Array:
    """The force of a friction by itself, (n,) N."""
    return forces([companion(friction)], motion)[friction.name]
