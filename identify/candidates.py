"""One catalogue effect as the explanation: search its shape, refit the model with it, score it."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from identify.evidence import LEAST_BIC, LEAST_T, Gain, delta_bic, held_out_gain, left_out
from identify.fit import Fit, fit_axis, sticks
from identify.residual import jacobian, moving, residual
from identify.study import Study
from twin.effect import Effect, Kind
from twin.effects import Catalogue
from twin.model import AxisModel, Coordinate, Fitted

Array = NDArray[np.float64]

RIDGE = 1e-4  # keeps the linear step finite along directions that the base explains already
REFINED_STARTS = 2  # best shapes of the scan that are refitted in full


@dataclass(frozen=True, eq=False)
class Candidate:
    """A model with one effect more: its refit, evidence and held-out gain."""

    effect: Effect
    axis: str
    fit: Fit
    delta_bic: float
    gain: Gain

    @property
    def supported(self) -> bool:
        """Whether both the evidence and the held-out logs ask for the effect."""
        return (
            self.delta_bic > LEAST_BIC and self.gain.t > LEAST_T
            and self.gain.after < self.gain.before
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class _Start:
    squared_error: float
    fitted: Fitted


def absent_effects(axis: AxisModel, catalogue: Catalogue) -> list[Effect]:
    """Effects that could be added to the axis; another friction would take the old one's place."""
    has_friction = any(f.effect.kind is Kind.FRICTION for f in axis.effects)
    return [
        e
        for e in catalogue.values()
        if e.name not in axis.names and (e.kind is not Kind.MODIFIER or has_friction)
    ]


def try_effect(base: Fit, study: Study, effect: Effect) -> Candidate:
    """Refit the model together with the effect and score it against the base."""
    starts = sorted(_scan(base, study, effect), key=lambda s: s.squared_error)[:REFINED_STARTS]
    fits = [fit_axis(base.axis.with_effect(s.fitted), study.fit) for s in starts]
    return score(base, min(fits, key=lambda f: f.error), study, effect)


def score(base: Fit, fit: Fit, study: Study, effect: Effect) -> Candidate:
    """Evidence for a fitted larger model over the base, on the windows that both can use."""
    either = sticks(base.axis) or sticks(fit.axis)
    kept = moving(study.fit, either)
    before, after = (residual(f.axis, study.fit)[kept] for f in (base, fit))
    added = max(len(fit.scaling.where) - len(base.scaling.where), 1)
    if study.holdout:
        held = moving(study.holdout, either)
        pair = [residual(f.axis, study.holdout)[held] for f in (base, fit)]
    else:
        pair = [_cross_validated(f, study, kept) for f in (base, fit)]
    return Candidate(
        effect=effect,
        axis=study.axis,
        fit=fit,
        delta_bic=delta_bic(before, after, added),
        gain=held_out_gain(pair[0], pair[1], fit.floor),
    )


def _cross_validated(fit: Fit, study: Study, kept: NDArray[np.bool_]) -> Array:
    columns = jacobian(fit.axis, study.fit, fit.scaling.where)[kept]
    force = residual(fit.axis, study.fit)[kept]
    return left_out(force, columns, RIDGE * np.linalg.norm(columns, axis=0))


def shapes(effect: Effect, study: Study) -> Iterator[dict[str, float]]:
    """Values to try for the parameters that the effect says must be searched."""
    scanned = [p for p in effect.parameters if p.scan]
    grids = [p.scan(study.excitation) if p.scan else () for p in scanned]
    for values in itertools.product(*grids):
        yield {p.name: v for p, v in zip(scanned, values, strict=True)}


def _scan(base: Fit, study: Study, effect: Effect) -> Iterator[_Start]:
    """Best strengths for each shape, by one linear step with the base parameters free."""
    rest = _without_friction(base.axis) if effect.kind is Kind.FRICTION else base.axis
    kept_columns = [i for i, c in enumerate(base.scaling.where) if _belongs(c, rest)]
    basis = orthonormal(base.jacobian[:, kept_columns])
    unchanged = residual(base.axis, study.fit)[base.kept]
    for shape in shapes(effect, study):
        first = Fitted.at_start(effect, _clipped(effect, study, shape))
        axis = rest.with_effect(first)
        where = [Coordinate(effect.name, p) for p in effect.strengths if p.name not in first.fixed]
        silent = all(first.values[p.name] == 0.0 for p in effect.strengths)
        force = unchanged if silent else residual(axis, study.fit)[base.kept]
        columns = jacobian(axis, study.fit, where)[base.kept]
        step, squared = _bounded_step(basis, force, columns, where, first)
        moved = {c.parameter.name: s for c, s in zip(where, step, strict=True)}
        yield _Start(squared, replace(first, values={**first.values, **moved}))


def _clipped(effect: Effect, study: Study, shape: dict[str, float]) -> dict[str, float]:
    values = {**effect.starts(study.excitation), **shape}
    return {p.name: float(min(max(values[p.name], p.lower), p.upper)) for p in effect.parameters}


def _belongs(c: Coordinate, axis: AxisModel) -> bool:
    return not c.effect or c.effect in axis.names


def _without_friction(axis: AxisModel) -> AxisModel:
    return replace(
        axis, effects=tuple(f for f in axis.effects if f.effect.kind is not Kind.FRICTION)
    )


def orthonormal(columns: Array) -> Array:
    """Orthonormal basis (n, r) of the columns' span."""
    norms = np.linalg.norm(columns, axis=0)
    scaled = columns[:, norms > 0] / norms[norms > 0]
    left, singular, _ = np.linalg.svd(scaled, full_matrices=False)
    return left[:, singular > 1e-8 * singular.max(initial=1.0)]


def _bounded_step(
    basis: Array, force: Array, columns: Array, where: list[Coordinate], first: Fitted
) -> tuple[Array, float]:
    """Strengths within their bounds that minimise the force left beside the base's columns."""
    left = force - basis @ (basis.T @ force)
    own = columns - basis @ (basis.T @ columns)
    norms = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    start = np.array([first.values[c.parameter.name] for c in where])
    low = np.array([c.parameter.lower for c in where]) - start
    high = np.array([c.parameter.upper for c in where]) - start
    ridge = RIDGE * np.eye(len(where))
    scaled = np.vstack([own / norms, ridge])
    target = np.concatenate([-left, np.zeros(len(where))])
    step = np.linalg.lstsq(scaled, target, rcond=None)[0] / norms
    if ((step < low) | (step > high)).any():
        low, high = low * norms, np.maximum(high * norms, low * norms + 1e-12)
        step = lsq_linear(scaled, target, bounds=(low, high)).x / norms
    return start + step, float(np.sum((left + own @ step) ** 2))
