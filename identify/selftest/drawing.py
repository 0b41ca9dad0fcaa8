"""Values of effects drawn without a look at what a diagnosis scans.

Each is drawn over a range in which such a value lies on machines, continuously, and so that the
logs can show it.
"""

from __future__ import annotations

import numpy as np

from twin.effect import Effect, Excitation, Parameter
from twin.model.machine import Fitted

ABOUT = 4.0  # factor to either side of the start of a value
DAMPING = (0.005, 0.2)  # of structures; the damping ratio of a steel frame, and of a rubber mount
ASIDE = 0.1  # of the travel, to either side of the start of a place
LEAST_PITCHES = 3.0  # in the travel


def drawn_values(effect: Effect, seen: Excitation, rng: np.random.Generator) -> dict[str, float]:
    """The values of an effect by name: nonlinear parameters drawn, strengths at their start.

    What a model knows by design (a pitch between rollers) stays; a damping ratio never does.
    """
    out = effect.starts(seen)
    for p in effect.parameters:
        if not p.strength and p.lower < p.upper and (not p.fixed or _is_damping(p)):
            out[p.name] = _drawn(p, out[p.name], seen, rng)
    return out


def other_exponents(fitted: Fitted, rng: np.random.Generator) -> Fitted:
    """The effect with the ratios that a model holds by design drawn anew, such as an exponent.

    Only those whose bounds lie within a factor of ten: they are what a law leaves open.
    """
    open_to = [
        p
        for p in fitted.effect.parameters
        if p.fixed and p.unit == "1" and 0.0 < p.lower < p.upper <= 10.0 * p.lower
    ]
    drawn = {p.name: _log_uniform(1.5 * p.lower, p.upper / 1.5, rng) for p in open_to}
    return Fitted.at_start(fitted.effect, {**fitted.values, **drawn})


def _drawn(p: Parameter, start: float, seen: Excitation, rng: np.random.Generator) -> float:
    if _is_damping(p):
        return _log_uniform(*DAMPING, rng)
    if p.lower < 0.0:  # a place
        return float(
            np.clip(start + ASIDE * seen.travel * rng.uniform(-1.0, 1.0), p.lower, p.upper)
        )
    high = min(start * ABOUT, p.upper)
    if p.period:
        high = min(high, seen.travel / LEAST_PITCHES)
    return _log_uniform(max(start / ABOUT, p.lower), high, rng)


def _is_damping(p: Parameter) -> bool:
    return p.unit == "1" and not p.strength and p.upper < 1.0


def _log_uniform(low: float, high: float, rng: np.random.Generator) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))
