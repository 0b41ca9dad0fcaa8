"""Intervals that allow for coloured residuals; none are given for a wrong model.

Sandwich covariance with blocks: (J'J)^-1 [sum_b J_b' r_b r_b' J_b] (J'J)^-1, where the blocks are
longer than the residual's memory and r_b is what the fit without block b leaves there. H. White,
Econometrica 48 (1980); K.-Y. Liang, S. L. Zeger, Biometrika 73 (1986) for blocks; R. M. Bell,
D. F. McCaffrey, Survey Methodology 28 (2002) for left-out residuals.

What a missing effect leaves depends on the motion, and every stretch of time may hold all of it: a
mass found from strong accelerations differs from one found from weak ones, in each block alike. So
the scatter between groups of like influence on the estimate is taken as well, and the larger of the
two counts. D. S. Lee, D. Card, J. Econometrics 142 (2008) group by the regressor, to have the error
of the model in the interval.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from identify.dataset.prepared_log import scale_of
from identify.estimation.evidence import BLOCKS, blocks_of, by_blocks, left_out, students_t
from identify.estimation.fit import Fit, is_linear
from identify.estimation.force_balance import changes
from identify.estimation.least_squares import ROUNDING
from identify.estimation.scaling import STEP
from identify.rules import RULE
from twin.effect import LEAST, Parameter
from twin.model.machine import AxisIntervals, AxisModel
from twin.model.parameters import ParameterReference, read, write
from twin.model.units import Scale, has_size
from twin.signals import Array

INSEPARABLE = 0.9999  # correlation of two estimates from which the data cannot separate them
CONFIDENCE_LEVEL = 0.9  # of every interval, as its texts say
BEYOND = 0.5 * (1.0 - CONFIDENCE_LEVEL)  # chance that the truth is off to one side
QUANTILE = students_t(BEYOND, BLOCKS - 1)
FAR = 4.0  # half widths to either side at which the error must have risen


class Side(Enum):
    """To which side of a value the error hardly rises."""

    SMALLER = "smaller"
    LARGER = "larger"


@dataclass(frozen=True)
class AlwaysAtRest:
    """The axis comes to rest within every test function, so that nothing was fitted."""


@dataclass(frozen=True)
class ModelWrong:
    """The force error (in ``unit``, RMS) is above the noise floor by more than that is unsure."""

    error: float
    floor: float
    unit: str


@dataclass(frozen=True)
class NotExcited:
    """The parameter has no influence on the force along this motion."""


@dataclass(frozen=True)
class Inseparable:
    """The correlation with the estimate of another parameter is almost 1."""

    label: str


@dataclass(frozen=True)
class OpenSided:
    """The error hardly rises towards this side of the value."""

    side: Side


NoInterval = AlwaysAtRest | ModelWrong | NotExcited | Inseparable | OpenSided


@dataclass(frozen=True)
class Estimate:
    """One parameter: value with its unit and 90 % interval, or the reason why it has none."""

    label: str
    value: float
    unit: str
    low: float | None
    high: float | None
    free: bool
    reason: NoInterval | None = None


def estimates(fit: Fit) -> tuple[Estimate, ...]:
    """Estimates of all parameters of a fitted axis, free ones first."""
    return (*_free(fit, refusal(fit)), *_held(fit))


def _free(fit: Fit, common: NoInterval | None) -> list[Estimate]:
    """Estimates of the free parameters; common: why none has an interval, or None."""
    where, half, units = fit.scaling.where, half_widths(fit), fit.axis.units
    reasons = {c.label: common for c in where} if common else _undetermined(fit, half)
    out = []
    for c, value, width in zip(where, read(fit.axis, where).tolist(), half, strict=True):
        p, why = c.parameter, reasons.get(c.label)
        least = 0.0 if p.lower == LEAST else p.lower  # which is beyond any machine
        low = None if why else float(max(value - width, least))
        high = None if why else float(min(value + width, p.upper))
        out.append(Estimate(c.label, value, units(p.unit), low, high, True, why))
    return out


def _undetermined(fit: Fit, half: Array) -> dict[str, NoInterval]:
    """Why parameters have none of their own, however good the model is."""
    where = fit.scaling.where
    out: dict[str, NoInterval] = {label: Inseparable(o) for label, o in inseparable(fit).items()}
    shown = _shown(fit, half)
    out |= {c.label: NotExcited() for c, each in zip(where, shown, strict=True) if not each}
    asked = [j for j, c in enumerate(where) if c.label not in out]
    sides = open_sides(fit, [where[j] for j in asked], half[asked])
    out |= {label: OpenSided(side) for label, side in sides.items()}
    scale, values = scale_of(fit.logs), read(fit.axis, where).tolist()
    return out | {
        c.label: NotExcited()
        for c, width, value in zip(where, half, values, strict=True)
        if c.label not in out and width > _widest(c.parameter, value, scale)
    }


def _shown(fit: Fit, half: Array) -> NDArray[np.bool_]:
    """Which parameters (k,) make a force beyond rounding where they are as large as the machine."""
    scale = scale_of(fit.logs)
    sizes = [_size(c.parameter, scale) for c in fit.scaling.where]
    with np.errstate(invalid="ignore"):  # of no force at all
        force = np.sqrt(np.mean(fit.jacobian**2, axis=0)) * sizes
    return np.asarray((half < np.inf) & (force > np.sqrt(np.finfo(float).eps) * scale.force))


def _size(p: Parameter, scale: Scale) -> float:
    """What alone would take the whole force, or all of the travel; infinite where there is none."""
    return scale.size(p.unit) if has_size(p.unit) else np.inf


def _widest(p: Parameter, value: float, scale: Scale) -> float:
    """Half the width of an interval, in the parameter's unit, from which it tells nothing."""
    return 10.0 * max(abs(value), _size(p, scale))


def intervals_to_keep(fit: Fit, found: Sequence[Estimate]) -> AxisIntervals:
    """The intervals of a fit's estimates, for its model's file: those that are told, and no other.

    What is refused where the fit is told is refused in the file: of a wrong model the intervals
    of one actuator from two logs need not overlap.
    """
    ends = {e.label: (e.low, e.high) for e in found if e.low is not None and e.high is not None}
    return AxisIntervals(ends, float(fit.ratio) if len(fit.residual) else 1.0)


def scatter(fit: Fit) -> AxisIntervals:
    """How far the values scatter between parts of the log, however wrong the model is.

    To compare a machine with its twin on the same motion, which a wrong model fits alike. No
    interval of a true value, and never written.
    """
    return intervals_to_keep(fit, _free(fit, None))


def open_sides(fit: Fit, where: Sequence[ParameterReference], half: Array) -> dict[str, Side]:
    """Sides to which the error hardly rises, by label, of parameters with these half widths.

    One to which both sides are closed is left out. Example: the position of an end stop that the
    motion just touches has a slope to one side only.
    """
    tried: list[tuple[ParameterReference, Side, float]] = []
    for c, width, value in zip(where, half, read(fit.axis, where), strict=True):
        if is_linear(fit.axis, c):  # the squared error is a parabola in it
            continue
        for side, far in ((Side.SMALLER, -FAR * width), (Side.LARGER, FAR * width)):
            to = np.clip(value + far, c.parameter.lower, c.parameter.upper)
            step = read(write(fit.axis, [c], [to]), [c])[0] - value
            if abs(step) >= 0.5 * FAR * width:  # else a bound is in the way
                tried.append((c, side, float(step)))
    steps = np.array([step for _, _, step in tried])
    moved = changes(fit.axis, fit.logs, [c for c, _, _ in tried], steps)[:, fit.kept]
    out: dict[str, Side] = {}
    for (c, side, step), change in zip(tried, moved, strict=True):
        column = fit.jacobian[:, fit.scaling.where.index(c)]
        predicted = 2.0 * step * float(fit.residual @ column) + step**2 * float(column @ column)
        rise = 2.0 * float(fit.residual @ change) + float(change @ change)
        # 0.1 of the rise that the linearised residual predicts
        if predicted > 0.0 and rise < 0.1 * predicted:
            out.setdefault(c.label, side)
    return out


def inseparable(fit: Fit) -> dict[str, str]:
    """Pairs of parameters, by label, whose estimates have a correlation of almost 1."""
    norms = np.linalg.norm(fit.jacobian, axis=0)
    excited = np.flatnonzero(norms > 0)
    columns = fit.jacobian[:, excited]
    columns /= norms[excited]
    inverse = np.linalg.pinv(columns.T @ columns, rcond=ROUNDING, hermitian=True)
    spread = np.sqrt(np.diag(inverse))
    correlation = np.abs(inverse / np.outer(spread, spread)) - np.eye(len(excited))
    labels = [fit.scaling.where[i].label for i in excited]
    return {
        label: labels[int(np.argmax(row))]
        for label, row in zip(labels, correlation, strict=True)
        if row.max() > INSEPARABLE
    }


def refusal(fit: Fit) -> NoInterval | None:
    """Why the fit has no intervals, or None where it has.

    Above the noise floor what parameters took over of a missing effect, which no residual shows,
    exceeds their intervals: of 73 given up to twice the floor beside a missing effect of 2 floors,
    54 held the truth (seeds 740161991 and 1528482097).
    """
    if len(fit.residual) == 0:
        return AlwaysAtRest()
    if fit.ratio <= RULE.at_floor:
        return None
    return ModelWrong(fit.error, fit.floor, fit.axis.units.force)


@lru_cache(maxsize=2)  # its estimates, the file and what the fit changed ask for the same
def half_widths(fit: Fit) -> Array:
    """Half widths (k,) of the 90 % intervals, in the parameters' units; inf where not excited."""
    return half_widths_of(fit, np.eye(fit.jacobian.shape[1]))


def half_widths_of(fit: Fit, weights: Array) -> Array:
    """The same of m sums of the parameters with these weights (k, m), by their covariance.

    inf where a parameter that is not excited takes part.
    """
    return half_widths_by(fit.jacobian, fit.residual, weights)


def half_widths_by(jacobian: Array, residual: Array, weights: Array) -> Array:
    """The same by a residual (n,) N and its Jacobian (n, k), in the order of time."""
    norms = np.linalg.norm(jacobian, axis=0)
    excited = norms > 0
    out = np.full(weights.shape[1], np.inf)
    known = ~(weights[~excited] != 0.0).any(axis=0)
    if not excited.any():
        return out
    columns = jacobian[:, excited]
    columns /= norms[excited]
    inverse = np.linalg.pinv(columns.T @ columns, rcond=ROUNDING, hermitian=True)
    # The fit makes the residuals of a block smaller than its errors, so the residuals of a fit
    # without the block are used (jackknife, CR3).
    honest = left_out(residual, columns)
    scores = by_blocks(columns, honest, blocks_of(len(honest)))
    covariance = inverse @ (scores.T @ scores * (BLOCKS - 1) / BLOCKS) @ inverse
    own = weights[excited][:, known] / norms[excited][:, None]
    # A prior or a bound shifts the estimate from the least-squares solution by this much.
    shift = np.abs(own.T @ inverse @ (columns.T @ residual))
    variance = np.einsum("ij,ik,kj->j", own, covariance, own)
    over_time = QUANTILE * np.sqrt(np.maximum(variance, 0.0))
    weighed = inverse @ own
    at_once = 16  # estimates whose influences are held, as many are as large as the Jacobian
    pieces = (weighed[:, k : k + at_once] for k in range(0, weighed.shape[1], at_once))
    influences = (column for piece in pieces for column in (columns @ piece).T)
    over_influence = np.array([_by_influence(column, residual) for column in influences])
    out[known] = np.maximum(over_time, over_influence) + shift
    return out


def _by_influence(influence: Array, residual: Array) -> float:
    """Half width by the scatter between test functions of more and of less influence.

    influence (n,): what one newton of the residual (n,) adds to the estimate. Each group holds an
    equal share of the squared influence, which is what the data tell of the estimate with the other
    parameters held. So all groups count alike, and the fit takes as much from each (CR2).
    """
    groups = 10  # of like influence; wide, as a law differs from the machine's over wide stretches
    size = np.abs(influence)
    told = np.sort(size) ** 2
    whole = told.sum() or 1.0  # of a sum of no parameters
    first = np.searchsorted(np.cumsum(told) - 0.5 * told, whole * np.arange(1, groups) / groups)
    edges = np.sqrt(told[np.minimum(first, len(size) - 1)])
    group = np.count_nonzero(size >= edges[:, None], axis=0)
    left = np.maximum(1.0 - np.bincount(group, size**2, groups) / whole, ROUNDING)
    moved = np.bincount(group, influence * residual, groups)
    return students_t(BEYOND, groups - 1) * float(np.sqrt((moved**2 / left).sum()))


def _held(fit: Fit) -> list[Estimate]:
    """The parameters that were not fitted, the mass first."""
    mass = fit.axis.mass_parameter
    every = [(mass.name, fit.axis.mass, mass.unit)]
    every += [
        (f"{f.effect.name}.{p.name}", f.values[p.name], p.unit)
        for f in fit.axis.effects
        for p in f.effect.parameters
    ]
    free = {c.label for c in fit.scaling.where}
    units = fit.axis.units
    return [
        Estimate(label, value, units(unit), None, None, False)
        for label, value, unit in every
        if label not in free
    ]


def with_band(
    fit: Fit, curve: Callable[[AxisModel], Array], among: Collection[ParameterReference]
) -> tuple[Array, Array]:
    """The curve (k,) of a fitted axis, and half the width (k,) of its 90 % band, in its unit.

    among: the free parameters that the curve depends on.
    """
    where, half = fit.scaling.where, half_widths(fit)
    centre, values = curve(fit.axis), read(fit.axis, where)
    slopes = np.zeros((len(where), len(centre)))
    for i in np.flatnonzero(np.isfinite(half)):
        if where[i] in among:
            step = STEP * half[i]
            slopes[i] = (curve(write(fit.axis, [where[i]], [values[i] + step])) - centre) / step
    return centre, half_widths_of(fit, slopes)
