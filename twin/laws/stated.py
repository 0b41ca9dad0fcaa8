"""What an effect says of itself: its units, its equation and the sign of what it takes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from twin.dimension import dimension
from twin.effect import DRY, OUT, READING, STATIC, TIME, VISCOUS, Effect, U, V, X
from twin.laws.checks import RESULTS, LawBroken, with_values
from twin.laws.formula import NoFormula, formula
from twin.laws.motion import Motion
from twin.laws.stepping import forces, trace
from twin.laws.values import moderate
from twin.model.machine import Fitted
from twin.model.units import LINEAR

# Other units of force, length and time, each in N, m, s of before. The unit of mass stays the same,
# as it is that of the moved mass of 1 kg with which a law is tried.
OTHER_UNITS = ((1.0, 4.0, 2.0), (4.0, 1.0, 0.5))
ROUNDING = 1e-6  # of the largest result
HELD = 0.05  # of it: a force of time is that of an instant, or its mean over the sample
WORK = f"{LINEAR.force} {LINEAR.position}"
_RESULT_UNITS = {OUT: "N", U: "N", READING: "m", DRY: "1", STATIC: "1", VISCOUS: "1"}


def check_units(effect: Effect) -> None:
    """The law is the same in other units, if each value is converted as its unit says.

    Where it is not, a parameter is in another unit than stated, or the law holds a number that has
    a unit of its own.
    """
    values, motion = moderate(effect, np.random.default_rng(23)), _quiet()
    found = trace(effect, values, motion).after
    turning = effect.suits is not None and not effect.suits([], False)
    for units in OTHER_UNITS[turning:]:  # on a rotary axis alone x is an angle, without a unit
        converted = {p.name: values[p.name] * _factor(p.unit, units) for p in effect.parameters}
        other = trace(effect, converted, _in_units(motion, units)).after
        for slot in RESULTS[effect.kind]:
            wanted = found[:, slot] * _factor(_RESULT_UNITS[slot], units)
            off, size = np.abs(other[:, slot] - wanted).max(), np.abs(wanted).max()
            if not off <= ROUNDING * size:
                told = ", ".join(f"{p.name} in {p.unit}" for p in effect.parameters[:6])
                raise LawBroken(
                    "in other units of force, length and time its result is another "
                    f"({off / size:.2g} of it apart): check the units of its parameters ({told}), "
                    "and numbers in the law that have a unit of their own"
                )


def _quiet() -> Motion:
    """Random motion without the tiniest speeds, at which a guard against zero may act."""
    motion = Motion.random(np.random.default_rng(24))
    return replace(motion, v=np.where(np.abs(motion.v) < 1e-5, 0.0, motion.v))


def _factor(unit: str, units: tuple[float, float, float]) -> float:
    return float(np.prod([u**k for u, k in zip(units, dimension(unit), strict=True)]))


def _in_units(motion: Motion, units: tuple[float, float, float]) -> Motion:
    force, length, time = units
    return Motion(motion.dt * time, motion.x * length, motion.v * length / time, motion.u * force)


def check_equation(effect: Effect) -> None:
    """The force is that of the equation, where this is a formula and the effect has no memory."""
    if effect.states:
        return
    try:
        computed = formula(effect.equation, [p.name for p in effect.parameters])
        values = moderate(effect, np.random.default_rng(25))
        found = trace(effect, values, Motion.random(np.random.default_rng(26)))
        x, v, t = (found.before[:, slot] for slot in (X, V, TIME))
        wanted = computed({"x": x, "v": v, "t": t, **{n: np.array(o) for n, o in values.items()}})
    except NoFormula:
        return
    got = found.after[:, OUT]
    off = np.abs(got - wanted)
    allowed = HELD if effect.reads("TIME") else ROUNDING
    if not off.max() <= allowed * max(np.abs(wanted).max(), np.abs(got).max()):
        k = int(np.argmax(off))
        turned = np.allclose(got, -wanted, rtol=ROUNDING, atol=ROUNDING * np.abs(got).max())
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
    values, motion = moderate(effect, np.random.default_rng(27)), Motion.cycles(0.15)
    power = forces([Fitted.at_start(effect, values)], motion)[effect.name] * motion.v
    given, size = np.sum(power) * motion.dt, np.sum(np.abs(power)) * motion.dt
    if not given <= 1e-3 * size:
        raise LawBroken(
            f"it gives {given:.3g} {WORK} in closed cycles of +-0.15 {LINEAR.position}, "
            f"{with_values(effect, values)}; a force against the motion has the sign of -v"
        )
