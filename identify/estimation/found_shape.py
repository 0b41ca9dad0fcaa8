"""The curve that a law assumes beside the curve that the logs show, with its band.

What bends it may be a parameter that a model holds by design, such as an exponent: set free, it
is one number more where a free curve has ten, so that a far smaller difference shows.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from statistics import NormalDist

import numpy as np

from identify.dataset.dataset import Dataset
from identify.dataset.prepared_log import moving
from identify.estimation.evidence import effective_samples, rms
from identify.estimation.fit import Fit
from identify.estimation.force_along import steady_force
from identify.estimation.force_balance import averaged_force
from identify.estimation.free_curves import Shape, sticking
from identify.estimation.intervals import BEYOND, with_band
from identify.estimation.least_squares import solve
from identify.estimation.splines import Linearised
from twin.curve import Coordinate
from twin.effect import RUBBING
from twin.model.machine import AxisModel, Fitted
from twin.model.units import LINEAR
from twin.record import Number, Values, record
from twin.signals import Array

BAND = NormalDist().inv_cdf(1.0 - BEYOND)  # standard deviations, to each side
UNITS = {Coordinate.POSITION: LINEAR.position, Coordinate.SPEED: LINEAR.velocity}
BOTH, AHEAD, BEHIND = "both directions", "forwards", "backwards"


@record
class FoundCurve:
    """One curve, each (k,) N: as the law assumes it, as the logs show it, half its 90 % band."""

    assumed: Values
    found: Values
    band_90: Values


@record
class FoundShape:
    """A law's curve as it is assumed and as it is found, by direction of motion."""

    over: Coordinate
    coordinate: Values
    """(k,), within one period where it has one."""
    coordinate_unit: str
    period: Number | None
    """m"""
    lets_go_at_standstill: bool
    unit: str
    """Of the force."""
    curves: Mapping[str, FoundCurve]
    """By direction; not a number where no training log has been."""

    @property
    def differs(self) -> bool:
        """Whether the curve found surely differs from the one assumed, by its band, anywhere."""
        pairs = (np.abs(c.found - c.assumed) - c.band_90 for c in self.curves.values())
        return any(bool(np.any(beyond > 0.0)) for beyond in pairs)


def found_shape(shape: Shape, fit: Fit, dataset: Dataset) -> FoundShape:
    """Draw a law of a fit and the free curve for it. The correction is smoothed, not the whole.

    The force of the law is read off where the curve lies: its mean over what else it depends on.
    """
    mask = moving(dataset.training, sticking(fit.axis, shape))[fit.kept]
    without = fit.axis.without(shape.effect)
    linear = Linearised.about(fit, dataset, shape.empty, mask, less=shape.effect)
    law = averaged_force(fit.axis, dataset.training) - averaged_force(without, dataset.training)
    own = np.array([c.effect == shape.empty.effect.name for c in linear.where])
    names = [c.parameter.name for c, is_own in zip(linear.where, own, strict=True) if is_own]
    hats = linear.columns[:, len(own) - len(names) :]  # which come last
    gram, met = hats.T @ hats, hats.T @ law[fit.kept][mask]
    assumed = _read_off(gram, met)
    correction, spread = _corrected(linear, shape.stiffness)
    knots, index = _knots(shape)
    coordinate = np.unique(np.clip(knots, *_covered(shape, dataset)))
    between = np.stack([np.interp(coordinate, knots, unit) for unit in np.eye(len(knots))], axis=1)
    curves = {}
    for name, at_knots in _directions(shape, index, names).items():
        weights = between @ at_knots
        full = np.zeros((len(weights), len(own)))
        full[:, own] = weights
        visits = np.sqrt(np.maximum(np.einsum("ki,ij,kj->k", weights, gram, weights), 0.0))
        # 0.02 of the most visited knot's weight, below which a knot is not drawn
        been = np.where(visits > 0.02 * visits.max(), 1.0, np.nan)
        curves[name] = FoundCurve(
            assumed=been * (weights @ assumed),
            found=been * (weights @ (assumed + correction[own])),
            band_90=been * BAND * np.sqrt(np.einsum("ki,ij,kj->k", full, spread, full)),
        )
    unit = fit.axis.units(UNITS[shape.curve.over])
    force = fit.axis.units.force
    return FoundShape(
        shape.curve.over, coordinate, unit, shape.period, shape.lets_go, force, curves
    )


def _covered(shape: Shape, dataset: Dataset) -> tuple[float, float]:
    """The ends of a coordinate that does not repeat, between which training logs have been."""
    if shape.period is not None:
        return -np.inf, np.inf
    been = {
        Coordinate.POSITION: lambda m: m.position,
        Coordinate.SPEED: lambda m: np.abs(m.velocity),
    }
    where = np.concatenate([been[shape.curve.over](log.motion) for log in dataset.training])
    return float(where.min()), float(where.max())


def _knots(shape: Shape) -> tuple[Array, list[int]]:
    free = shape.empty.effect.free_shape
    assert free is not None
    coordinate, index = free.knots(shape.empty.values)
    return np.array(coordinate), index


def _directions(shape: Shape, index: list[int], names: Sequence[str]) -> dict[str, Array]:
    """By direction, weights (k, n) of the strengths with these names in the curve at each knot."""
    even, odd = (
        np.array([[float(name == part.strengths[i]) for name in names] for i in index])
        for part in shape.empty.effect.parts
    )
    if not shape.curve.by_direction:
        return {BOTH: even}
    return {AHEAD: even + odd, BEHIND: even - odd}


def _read_off(gram: Array, met: Array) -> Array:
    """Strengths (k,) whose columns come nearest to a force; products (k, k), with it (k,)."""
    # of the data's weight: smoothing under which a law's own force is read off
    weak = 1e-6 * np.trace(gram) / len(gram) * np.eye(len(gram))
    return np.asarray(solve(gram + weak, met[:, None])[:, 0])


def _corrected(linear: Linearised, stiffness: Mapping[str, float]) -> tuple[Array, Array]:
    """Change (k,) of all strengths, and its covariance (k, k); the noise is taken as coloured."""
    change, _ = linear.solution(stiffness)
    left = linear.force + linear.columns @ change
    noise = rms(left) ** 2 * len(left) / effective_samples(left)
    return change, noise * linear.spread(stiffness)


# --- a parameter that a law holds by design -------------------------------------------------------


@record
class FreeExponent:
    """A parameter of a law, held by design, with which its curve comes nearest to the one found."""

    parameter: str
    held: Number
    found: Number
    unit: str

    @property
    def differs(self) -> bool:
        """Whether the law found is another than the one that is held."""
        same = 0.1  # relative distance from its value by design at which a law is still itself
        return abs(self.found - self.held) > same * abs(self.held)


def held_exponents(law: Fitted) -> tuple[str, ...]:
    """Names of the parameters that would bend the curves of a fitted law, and are held."""
    names = dict.fromkeys(c.bent_by for c in law.effect.curves if c.bent_by)
    return tuple(name for name in names if name in law.fixed)


def held_strengths(law: Fitted) -> tuple[str, ...]:
    """Names of the strengths that a MuJoCo file can state, and that a model holds at a value."""
    if law.effect.of_joint is None:
        return ()
    return tuple(p.name for p in law.effect.strengths if p.name in law.fixed and law.values[p.name])


def exponent_curve(held: Fitted, final: Fit, dataset: Dataset) -> FoundShape:
    """The steady force of a law of a final fit with its 90 % band, and that of it as it was held.

    Of a friction with what modifies it. In the middle of the travel, positive or negative as the
    force of the law is.
    """
    covered = dataset.excitation
    speed = covered.speed_max * np.geomspace(0.01, 1.0, 24)  # that are drawn
    place = 0.5 * (covered.position_low + covered.position_high)
    kinds = {f.effect.name: f.effect.kind for f in final.axis.effects}
    rubbing = [name for name, kind in kinds.items() if kind in RUBBING]
    names = rubbing if held.effect.name in rubbing else [held.effect.name]
    among = [c for c in final.scaling.where if c.effect in names]

    def force(axis: AxisModel, velocity: Array) -> Array:
        acting = replace(axis, effects=tuple(f for f in axis.effects if f.effect.name in names))
        return np.array([steady_force(acting, place, float(v)) for v in velocity])

    curves = {}
    for name, way in ((AHEAD, 1), (BEHIND, -1)):
        at = partial(force, velocity=way * speed)
        found, band = with_band(final, at, among)
        curves[name] = FoundCurve(at(final.axis.with_effect(held)), found, band)
    units = final.axis.units
    return FoundShape(
        Coordinate.SPEED, speed, units(UNITS[Coordinate.SPEED]), None, False, units.force, curves
    )
