"""How a machine departs from its model: values, laws, and logs that are not so good.

Values are drawn without a look at what a diagnosis scans: over a range in which such a value lies
on machines, continuously, and so that the logs can show it. One variation changes one thing, so
that a self-test shows where a diagnosis fails.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.selftest.laws import BUMPS, CABLES, NOISE
from twin.effect import Effect, Excitation, Kind, Parameter
from twin.effects import load_catalogue
from twin.model.machine import AxisModel, Fitted, MachineModel

FOLD = (0.7, 1.4)  # of the start of the travel over which the stiffness of a cable changes
MASS_OFF = 0.1  # of the model's
ABOUT = 4.0  # factor to either side of the start of a value
DAMPING = (0.005, 0.2)  # of structures; the damping ratio of a steel frame, and of a rubber mount
ASIDE = 0.1  # of the travel, to either side of the start of a place
LEAST_PITCHES = 3.0  # in the travel


@dataclass(frozen=True)
class Drawn:
    """A model and the machine that it is a model of, so far.

    reshaped: effects of the model whose law is not the machine's. right: further effects that it
    would be right to name.
    """

    model: MachineModel
    true: MachineModel
    reshaped: frozenset[str] = frozenset()
    right: frozenset[str] = frozenset()

    def on(self, axis: str, change: Callable[[AxisModel], AxisModel]) -> Drawn:
        """The same with one axis of the machine changed."""
        return replace(self, true=self.true.with_axis(axis, change(self.true.axes[axis])))


Variation = Callable[[Drawn, str, np.random.Generator], Drawn]


def plain(drawn: Drawn, axis: str, rng: np.random.Generator) -> Drawn:
    """The laws of the model; other values."""
    return drawn


def bumps(drawn: Drawn, axis: str, rng: np.random.Generator) -> Drawn:
    """Bumps of another form."""
    return _in_place(drawn, axis, BUMPS[rng.integers(len(BUMPS))], {})


def cable(drawn: Drawn, axis: str, rng: np.random.Generator) -> Drawn:
    """A cable that is no cubic."""
    form = CABLES[rng.integers(len(CABLES))]
    fold = form.parameter("fold").start * float(rng.uniform(*FOLD))
    return _in_place(drawn, axis, form, {"fold": fold})


def exponent(drawn: Drawn, axis: str, rng: np.random.Generator) -> Drawn:
    """A friction with another Stribeck exponent than the model holds."""
    old = next(f for f in drawn.true.axes[axis].effects if f.effect.kind is Kind.FRICTION)
    out = drawn.on(axis, lambda a: a.with_effect(other_exponents(old, rng)))
    return replace(out, reshaped=out.reshaped | {old.effect.name})


def coloured(drawn: Drawn, axis: str, rng: np.random.Generator) -> Drawn:
    """Force noise of 2 to 10 mN with a memory of 3 to 50 ms."""
    values = {"size": rng.uniform(2e-3, 10e-3), "memory": 3e-3 * (50 / 3) ** rng.uniform()}
    noise = Fitted.at_start(NOISE, {k: float(v) for k, v in values.items()})
    return drawn.on(axis, lambda a: a.with_effect(noise))


def encoder(drawn: Drawn, axis: str, rng: np.random.Generator) -> Drawn:
    """An encoder of 3 to 300 nm with noise of 1 to 30 nm, both known to the model."""
    step, noise = float(3e-9 * 100.0 ** rng.uniform()), float(1e-9 * 30.0 ** rng.uniform())

    def of(machine: MachineModel) -> MachineModel:
        a = machine.axes[axis]
        hardware = replace(a.hardware, encoder_resolution=step, encoder_noise=noise)
        return machine.with_axis(axis, replace(a, hardware=hardware))

    rounding = {e.name for e in load_catalogue().values() if e.is_noise}
    return replace(drawn, model=of(drawn.model), true=of(drawn.true), right=drawn.right | rounding)


def rate(drawn: Drawn, axis: str, rng: np.random.Generator) -> Drawn:
    """Logs and control at 1 to 8 kHz."""
    chosen = float(rng.choice([1e3, 2e3, 2.5e3, 4e3, 5e3, 8e3]))
    model, true = (replace(m, sample_rate=chosen) for m in (drawn.model, drawn.true))
    return replace(drawn, model=model, true=true)


def everything(drawn: Drawn, axis: str, rng: np.random.Generator) -> Drawn:
    """All of them at once."""
    for one in (rate, encoder, bumps, cable, exponent, coloured):
        drawn = one(drawn, axis, rng)
    return drawn


VARIATIONS: Mapping[str, Variation] = {
    f.__name__: f for f in (plain, bumps, cable, exponent, coloured, encoder, rate, everything)
}


def _in_place(drawn: Drawn, axis: str, form: Effect, own: Mapping[str, float]) -> Drawn:
    """The machine with a form in place of the effect that assumes the same kind of curve."""
    old = next(f for f in drawn.true.axes[axis].effects if f.effect.curves == form.curves)
    known = {**old.values, **own}
    new = Fitted.at_start(form, {p.name: known[p.name] for p in form.parameters if p.name in known})
    out = drawn.on(axis, lambda a: a.without(old.effect.name).with_effect(new))
    return replace(out, reshaped=out.reshaped | {old.effect.name})


# --- values ----------------------------------------------------------------------------------


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
