"""Draw a machine at random: values other than the model's, and an effect that the model lacks.

And the force that an effect adds along an exemplary motion: its fingerprint.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from identify.dataset.blocks import Blocks
from identify.dataset.dataset import Dataset
from identify.dataset.drive import reading_error
from identify.dataset.motion import Motion
from identify.dataset.prepared_log import PreparedLog, total_force
from identify.estimation.evidence import rms
from identify.estimation.fit import Fit
from identify.estimation.force_balance import residual
from identify.estimation.least_squares import unabsorbed
from twin.effect import Effect, Excitation, Kind, Parameter
from twin.effects import Catalogue
from twin.model.machine import AxisModel, Fitted, axis_table
from twin.model.parameters import free_parameters, read, write
from twin.signals import Array, rate

SPREAD = 0.2  # relative spread of a machine's values about the model's


def other_machine(axis: AxisModel, rng: np.random.Generator) -> AxisModel:
    """The axis with every free value of its effects moved by up to 20 %."""
    where = [c for c in free_parameters(axis) if c.effect]
    values = read(axis, where) * (1.0 + SPREAD * rng.uniform(-1.0, 1.0, len(where)))
    index = {(c.effect, c.parameter.name): i for i, c in enumerate(where)}
    for i, c in enumerate(where):
        p = c.parameter
        below = index.get((c.effect, p.at_least or ""))
        floor = p.lower if below is None else max(values[below], p.lower)
        values[i] = min(max(values[i], floor), p.upper)
    return write(axis, where, values)


def draw_effect(
    effect: Effect,
    axis: AxisModel,
    logs: Sequence[PreparedLog],
    excitation: Excitation,
    force: float,
    rng: np.random.Generator,
) -> Fitted:
    """Random values of an effect such that it changes the axis' force by ``force`` (N RMS).

    Nonlinear parameters are drawn from the range that a diagnosis scans, or about their start where
    they are not scanned. Linear parameters (strengths) get a random direction and are scaled on the
    motion of the logs.
    """
    values = effect.starts(excitation)
    for p in effect.parameters:
        if not (p.strength or p.fixed):
            values[p.name] = _drawn_shape(p, values[p.name], excitation, rng)
    base = residual(axis, logs)
    return strength_for(effect, lambda f: added_force(f, axis, logs, base), force, values, rng)


def _drawn_shape(
    p: Parameter, start: float, excitation: Excitation, rng: np.random.Generator
) -> float:
    if p.scan:
        low, high = min(p.scan(excitation)), max(p.scan(excitation))
        if low > 0:
            return float(np.exp(rng.uniform(np.log(low), np.log(high))))
        return float(rng.uniform(low, high))
    shape_spread = 0.3  # of the logarithm of nonlinear parameters that are not scanned
    drawn = start * float(np.exp(shape_spread * rng.uniform(-1.0, 1.0)))
    return min(max(drawn, p.lower), p.upper)


def _drawn_direction(p: Parameter, rng: np.random.Generator) -> float:
    # about the size of the start value, whose strength is set later
    size = float(rng.uniform(0.5, 1.5))
    return size if p.lower >= 0 else float(size * rng.choice((-1.0, 1.0)))


def strength_for(
    effect: Effect,
    added: Callable[[Fitted], Array],
    force: float,
    values: Mapping[str, float] | None = None,
    rng: np.random.Generator | None = None,
) -> Fitted:
    """The effect with strengths scaled until ``added`` (the force it adds, N) has RMS ``force``.

    values: the other parameters. rng: draws the ratios of the strengths; all are equal where None.
    """
    values = values or effect.starts()
    direction = {p.name: 1.0 if rng is None else _drawn_direction(p, rng) for p in effect.strengths}
    limits = {p.name: p.at_least for p in effect.parameters if p.at_least}

    def at(scale: float) -> Fitted:
        drawn = dict(values)
        for p in effect.strengths:
            drawn[p.name] = float(np.clip(scale * direction[p.name], p.lower, p.upper))
        for name, least in limits.items():
            drawn[least], drawn[name] = sorted((drawn[least], drawn[name]))
        return Fitted.at_start(effect, drawn)

    return at(_scale(lambda scale: rms(added(at(scale))), force))


def _scale(size: Callable[[float], float], wanted: float) -> float:
    """Scale between 1e-9 and 1e9 at which a size that grows with it is the wanted one.

    On logarithms, on which a force in proportion to its strengths is a straight line. A size need
    not grow all the way (a dead zone wider than every command leaves nothing), so that halving
    finds the rise first.
    """

    def error(log_scale: float) -> float:
        tiny = 1e-300  # no logarithm of nothing
        return float(np.log(max(size(float(np.exp(log_scale))), tiny) / max(wanted, tiny)))

    # a factor of 1e9 either way: from nothing to what no machine bears
    low, high, risen = float(np.log(1e-9)), float(np.log(1e9)), False
    for _ in range(12):  # to within a hundredth
        middle = 0.5 * (low + high)
        if error(middle) < 0.0:
            low = middle
        else:
            high, risen = middle, True
    if not risen or error(low) >= 0.0:
        return float(np.exp(low))
    from scipy.optimize import brentq  # a fit and most diagnoses plant nothing

    # 1e-12 of the size, so that one seed plants one size on every machine
    return float(np.exp(brentq(error, low, high, xtol=1e-12)))


def visible_force(fitted: Fitted, base: Fit, dataset: Dataset) -> float:
    """RMS force (N) of an effect that the parameters of a fit cannot reproduce."""
    force = _beside(fitted, base, dataset)
    return rms(unabsorbed(force, base.basis))


def hidden_part(fitted: Fitted, base: Fit, dataset: Dataset) -> float:
    """Part of an effect's RMS force that the parameters of a fit reproduce; 1 where it has none."""
    force = rms(_beside(fitted, base, dataset))
    return 1.0 - visible_force(fitted, base, dataset) / force if force > 0.0 else 1.0


def _beside(fitted: Fitted, base: Fit, dataset: Dataset) -> Array:
    logs = dataset.training
    return added_force(fitted, base.axis, logs, residual(base.axis, logs))[base.kept]


def added_force(
    fitted: Fitted, axis: AxisModel, logs: Sequence[PreparedLog], without: Array
) -> Array:
    """Force (n,) N that the effect adds to the residual of an axis, apparent force included."""
    if not fitted.effect.is_noise:
        return residual(axis.with_effect(fitted), logs) - without
    alone = replace(axis, effects=(fitted,))
    rates = [log.fine.acceleration(reading_error(alone, log.motion)[1]) for log in logs]
    return np.asarray(axis.mass * np.concatenate(rates))


FORCE = 0.1  # N RMS of the drawn effect
MASS = 10.0  # kg
VISCOUS = "sigma2"  # viscous friction, N s/m, of every friction of the catalogue


def exemplary_motion() -> Motion:
    """Passes over the travel in both directions, ever slower, with the command for 10 kg."""
    period = 1e-3  # s
    parts = []
    for half in (1.5, 3.0, 6.0):  # s for one way
        t = np.arange(0.0, 2.0 * half, period)
        parts.append(-0.15 * np.cos(np.pi * t / half))  # m
    position = np.concatenate(parts)
    velocity = rate(position, period)
    # 0.3 N of friction, as of the stage's guide
    command = MASS * rate(velocity, period) + 0.3 * np.sign(velocity)
    other = 0.5 * np.roll(position, len(position) // 7)
    speed = rate(other, period)
    others = np.stack([other, speed, rate(speed, period)])
    signals = np.stack([position, velocity, command])
    return Motion(
        name="exemplary", axis="x", track=Blocks(signals, signals[1:]), others=others,
        period=period, start=0.0, sample_period=period, position_noise=0.0,
    )  # fmt: skip


def signature(effect: Effect, catalogue: Catalogue) -> tuple[Motion, Array]:
    """The exemplary motion, and the force (n,) N that the effect adds along it."""
    motion = exemplary_motion()
    axis = AxisModel(MASS)
    if effect.kind is not Kind.FRICTION:
        friction = next(e for e in catalogue.values() if e.kind is Kind.FRICTION)
        axis = axis.with_effect(Fitted.at_start(friction, {VISCOUS: 0.5}))
    base = total_force(axis_table({motion.axis: axis}), motion)

    def added(fitted: Fitted) -> Array:
        return total_force(axis_table({motion.axis: axis.with_effect(fitted)}), motion) - base

    rubs = effect.kind is Kind.FRICTION
    return motion, added(Fitted.at_start(effect) if rubs else strength_for(effect, added, FORCE))
