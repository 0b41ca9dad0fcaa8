"""What physics, sampling and its own declaration ask of a law.

Work, the same force at another sample rate and in other units, the equation that it states.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np

from twin.effect import DRY, OUT, READING, STATIC, TIME, VISCOUS, Effect, Kind, U, V, X
from twin.laws.checks import RESULTS, LawBroken, with_values
from twin.laws.formula import NoFormula, formula
from twin.laws.trials import TrialMotion, Values, acted, forces, moderate, of_kind, trace
from twin.model.machine import Fitted
from twin.model.units import LINEAR, dimension

WORK = f"{LINEAR.force} {LINEAR.position}"
ROUNDING = 1e-9  # of the work that went to and fro


def check_sample_rate(effect: Effect) -> None:
    """The same motion sampled four times as often leaves about the same force, or reading."""
    rates = (2500.0, 10_000.0)  # Hz, the second a multiple of the first
    values = moderate(effect, np.random.default_rng(17))
    slow, fast = (acted(effect, values, TrialMotion.cycles(samples=round(rate))) for rate in rates)
    every = round(rates[1] / rates[0])
    for one, all_of_other in zip(slow, fast, strict=True):
        other = all_of_other[::every]
        apart, size = (float(np.sqrt(np.mean(r**2))) for r in (one - other, other))
        # of the result, RMS: what is integrated coarsely stays below 0.1,
        # a sum over samples without the sample period is off by 0.75
        rates_apart = 0.3
        if not apart <= rates_apart * size:
            unit = LINEAR.position if effect.kind is Kind.SENSING else LINEAR.force
            raise LawBroken(
                f"sampled at {rates[0]:g} Hz and at {rates[1]:g} Hz its results are {apart:.3g} "
                f"{unit} rms apart, of {size:.3g} {unit}; what grows with each sample must be in "
                "proportion to io[DT], or to the way gone"
            )


def _work(
    effect: Effect, values: Values, motion: TrialMotion, *around: Fitted
) -> tuple[float, float]:
    """What an effect gives along a motion beside others, N m, and what goes to and fro."""
    force = forces([Fitted.at_start(effect, values), *around], motion)[effect.name]
    power = force * motion.v
    return np.sum(power) * motion.dt, np.sum(np.abs(power)) * motion.dt


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
        for amplitude, changed in product((1e-6, 1e-4, 1e-2, 0.15), around):  # m
            given, size = _work(friction, values, TrialMotion.cycles(amplitude), *changed)
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
    motion = TrialMotion.random(np.random.default_rng(16))
    other = TrialMotion(2.0 * motion.dt, motion.x, motion.v[::-1], motion.u[::-1])
    return np.array_equal(
        trace(effect, values, motion).after[:, OUT], trace(effect, values, other).after[:, OUT]
    )


def check_conservative(effect: Effect, values: Values) -> None:
    """No net work around a loop in position, whatever the speeds out and back."""
    left, size = _work(effect, values, TrialMotion.cycles(0.15, cycles=1, samples=20_000))
    if not np.abs(left) <= ROUNDING * size:
        raise LawBroken(f"work of {left:.3g} {WORK} is left around a loop in position")


def check_of_position_alone(effect: Effect) -> None:
    """Where the force depends on position alone, no work is left around a loop."""
    values = moderate(effect, np.random.default_rng(31))
    if depends_on_position_alone(effect, values):
        check_conservative(effect, values)


# Other units of force, length and time, each in N, m, s of before. The unit of mass stays the same,
# as it is that of the moved mass of 1 kg with which a law is tried.
OTHER_UNITS = ((1.0, 4.0, 2.0), (4.0, 1.0, 0.5))
ALIKE = 1e-6  # of the largest result
_RESULT_UNITS = {OUT: "N", U: "N", READING: "m", DRY: "1", STATIC: "1", VISCOUS: "1"}


def check_units(effect: Effect) -> None:
    """The law is the same in other units, if each value is converted as its unit says.

    Where it is not, a parameter is in another unit than stated, or the law holds a number that has
    a unit of its own.
    """
    values = moderate(effect, np.random.default_rng(23))
    motion = TrialMotion.random(np.random.default_rng(24))
    # Without the tiniest speeds, at which a guard against zero may act.
    motion = replace(motion, v=np.where(np.abs(motion.v) < 1e-5, 0.0, motion.v))
    found = trace(effect, values, motion).after
    turning = effect.suits is not None and not effect.suits([], False)
    for units in OTHER_UNITS[turning:]:  # on a rotary axis alone x is an angle, without a unit
        converted = {p.name: values[p.name] * _factor(p.unit, units) for p in effect.parameters}
        force, length, time = units
        scaled = TrialMotion(
            motion.dt * time, motion.x * length, motion.v * length / time, motion.u * force
        )
        other = trace(effect, converted, scaled).after
        for slot in RESULTS[effect.kind]:
            wanted = found[:, slot] * _factor(_RESULT_UNITS[slot], units)
            off, size = np.abs(other[:, slot] - wanted).max(), np.abs(wanted).max()
            if not off <= ALIKE * size:
                told = ", ".join(f"{p.name} in {p.unit}" for p in effect.parameters[:6])
                raise LawBroken(
                    "in other units of force, length and time its result differs, by "
                    f"{off / size:.2g} times what it should be: check the units of its parameters "
                    f"({told}), and numbers in the law that have a unit of their own"
                )


def _factor(unit: str, units: tuple[float, float, float]) -> float:
    return float(np.prod([u**k for u, k in zip(units, dimension(unit), strict=True)]))


def check_equation(effect: Effect) -> None:
    """The force is that of the equation, where this is a formula and the effect has no memory."""
    if effect.states:
        return
    try:
        computed = formula(effect.equation, [p.name for p in effect.parameters])
        values = moderate(effect, np.random.default_rng(25))
        found = trace(effect, values, TrialMotion.random(np.random.default_rng(26)))
        x, v, t = (found.before[:, slot] for slot in (X, V, TIME))
        wanted = computed({"x": x, "v": v, "t": t, **{n: np.array(o) for n, o in values.items()}})
    except NoFormula:
        return
    got = found.after[:, OUT]
    off = np.abs(got - wanted)
    held = 0.05  # of it: a force of time is that of an instant, or its mean over the sample
    allowed = held if effect.reads("TIME") else ALIKE
    if not off.max() <= allowed * max(np.abs(wanted).max(), np.abs(got).max()):
        k = int(np.argmax(off))
        turned = np.allclose(got, -wanted, rtol=ALIKE, atol=ALIKE * np.abs(got).max())
        why = "the sign is the other one" if turned else "correct the law or the equation"
        raise LawBroken(
            f"its law gives {got[k]:.4g} {LINEAR.force}, its equation {effect.equation} gives "
            f"{np.broadcast_to(wanted, got.shape)[k]:.4g} {LINEAR.force} at x = {x[k]:.3g} "
            f"{LINEAR.position}, v = {v[k]:.3g} {LINEAR.velocity}; {why}"
        )


def check_takes_speed(effect: Effect) -> None:
    """A force of speed that has one sign only gives no energy: it acts against the motion.

    Of a force with strengths of either sign nothing is asked, nor of one that time drives.
    """
    strengths = [p for p in effect.parameters if p.strength]
    driven = effect.reads("TIME") or effect.reads("U") or not effect.reads("V")
    if driven or not strengths or any(p.lower < 0.0 for p in strengths):
        return
    values = moderate(effect, np.random.default_rng(27))
    given, size = _work(effect, values, TrialMotion.cycles(0.15))
    if not given <= 1e-3 * size:
        raise LawBroken(
            f"it gives {given:.3g} {WORK} in closed cycles of +-0.15 {LINEAR.position}, "
            f"{with_values(effect, values)}; a force against the motion has the sign of -v"
        )
