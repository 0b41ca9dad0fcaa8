"""Parameter values with which a law is tried: absent, moderate, at the bounds."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache

import numpy as np

from twin.dimension import Scale, has_size
from twin.effect import READING, Effect, Kind, Parameter
from twin.effects import load_catalogue
from twin.laws.motion import Array, Motion
from twin.laws.stepping import Values, forces, trace
from twin.model.machine import Fitted

TRIED = Scale(1.0, 0.1, 1.0)  # N, m, s: about the motion of ``action``
ENORMOUS = 10.0  # times what is usual there


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
    far = ENORMOUS * TRIED.size(p.unit) if has_size(p.unit) else np.inf
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
    motion = Motion.cycles(samples=1000)
    own = Fitted.at_start(effect, values)
    if effect.kind is Kind.SENSING:
        seen = trace(effect, values, motion)
        return float(1e6 * np.sqrt(np.mean((seen.after - seen.before)[:, READING] ** 2)))
    if effect.kind is not Kind.MODIFIER:
        return float(np.sqrt(np.mean(forces([own], motion)[effect.name] ** 2)))
    changes = []
    for friction in of_kind(Kind.FRICTION):
        changed = forces([companion(friction), own], motion)[friction.name]
        changes.append(np.mean((changed - _unmodified(friction)) ** 2))
    return float(np.sqrt(max(changes)))


@cache
def _unmodified(friction: Effect) -> Array:
    """The force of a friction by itself along the motion of ``action``, (n,) N."""
    return forces([companion(friction)], Motion.cycles(samples=1000))[friction.name]
