"""What physics and sampling ask of a law: work, and the same force at another sample rate."""

from __future__ import annotations

from itertools import product

import numpy as np

from twin.effect import OUT, READING, Effect, Kind
from twin.laws.checks import LawBroken, with_values
from twin.laws.motion import Array, Motion
from twin.laws.stepping import Values, forces, trace
from twin.laws.values import companion, moderate, of_kind
from twin.model.machine import Fitted
from twin.model.units import LINEAR

WORK = f"{LINEAR.force} {LINEAR.position}"
ROUNDING = 1e-9  # of the work that went to and fro
AMPLITUDES = (1e-6, 1e-4, 1e-2, 0.15)  # m
RATES = (2500.0, 10_000.0)  # Hz, the second a multiple of the first
# RMS of the difference over that of the result. What is integrated coarsely stays below 0.1, a sum
# over samples without the sample period is off by 0.75.
RATES_APART = 0.3


def check_sample_rate(effect: Effect) -> None:
    """The same motion sampled four times as often leaves about the same force, or reading."""
    values = moderate(effect, np.random.default_rng(17))
    slow, fast = (Motion.cycles(samples=round(rate)) for rate in RATES)
    every = round(RATES[1] / RATES[0])
    for one, all_of_other in zip(
        _acted(effect, values, slow), _acted(effect, values, fast), strict=True
    ):
        other = all_of_other[::every]
        apart, size = (float(np.sqrt(np.mean(r**2))) for r in (one - other, other))
        if not apart <= RATES_APART * size:
            unit = LINEAR.position if effect.kind is Kind.SENSING else LINEAR.force
            raise LawBroken(
                f"sampled at {RATES[0]:g} Hz and at {RATES[1]:g} Hz its results are {apart:.3g} "
                f"{unit} rms apart, of {size:.3g} {unit}; what grows with each sample must be in "
                "proportion to io[DT], or to the way gone"
            )


def _acted(effect: Effect, values: Values, motion: Motion) -> list[Array]:
    """What the effect does along a motion, (n,) each: for a modifier, to each friction."""
    own = Fitted.at_start(effect, values)
    if effect.kind is Kind.SENSING:
        seen = trace(effect, values, motion)
        return [(seen.after - seen.before)[:, READING]]
    if effect.kind is not Kind.MODIFIER:
        return [forces([own], motion)[effect.name]]
    rows = []
    for friction in of_kind(Kind.FRICTION):
        alone = companion(friction)
        changed = forces([alone, own], motion)[friction.name]
        rows.append(changed - forces([alone], motion)[friction.name])
    return rows


def check_takes_energy(effect: Effect) -> None:
    """A friction takes energy under every modifier, and a modifier lets every friction do so."""
    if effect.kind is Kind.FRICTION:
        for modifier in (None, *of_kind(Kind.MODIFIER)):
            check_dissipative(effect, modifier)
    else:
        for friction in of_kind(Kind.FRICTION):
            check_dissipative(friction, effect)


def check_dissipative(friction: Effect, modifier: Effect | None = None) -> None:
    """Friction takes work out of every closed cycle, large or within its pre-sliding."""
    rng = np.random.default_rng(15)
    around: list[list[Fitted]] = [[]]
    if modifier:  # with a moderate action, and at its most
        around = [[Fitted.at_start(modifier, moderate(modifier, rng, w))] for w in (0.3, 1e9)]
    for values in (friction.starts(), moderate(friction, rng)):
        for amplitude, changed in product(AMPLITUDES, around):
            motion = Motion.cycles(amplitude)
            force = forces([Fitted.at_start(friction, values), *changed], motion)[friction.name]
            given = np.sum(force * motion.v) * motion.dt
            size = np.sum(np.abs(force * motion.v)) * motion.dt
            if not given <= ROUNDING * size:
                beside = f" under {modifier.name}" if modifier else ""
                raise LawBroken(
                    f"the friction {friction.name}{beside} gives {given:.3g} {WORK} in cycles of "
                    f"+-{amplitude:g} {LINEAR.position}, {with_values(friction, values)}; it may "
                    "only take energy"
                )


def depends_on_position_alone(effect: Effect, values: Values) -> bool:
    """Whether a force effect has no state and the same force at any speed, time and command."""
    if effect.kind is not Kind.FORCE or effect.states:
        return False
    motion = Motion.random(np.random.default_rng(16))
    other = Motion(2.0 * motion.dt, motion.x, motion.v[::-1], motion.u[::-1])
    return np.array_equal(
        trace(effect, values, motion).after[:, OUT], trace(effect, values, other).after[:, OUT]
    )


def check_conservative(effect: Effect, values: Values) -> None:
    """No net work around a loop in position, whatever the speeds out and back."""
    motion = Motion.cycles(0.15, cycles=1, samples=20_000)
    power = forces([Fitted.at_start(effect, values)], motion)[effect.name] * motion.v
    left, size = np.sum(power) * motion.dt, np.sum(np.abs(power)) * motion.dt
    if not np.abs(left) <= ROUNDING * size:
        raise LawBroken(f"work of {left:.3g} {WORK} is left around a loop in position")


def check_of_position_alone(effect: Effect) -> None:
    """Where the force depends on position alone, no work is left around a loop."""
    values = moderate(effect, np.random.default_rng(31))
    if depends_on_position_alone(effect, values):
        check_conservative(effect, values)
