"""Variable projection: scan an effect's nonlinear parameters, solve for the linear ones at each.

The linear parameters are called strengths, a set of nonlinear values a shape. The strengths at a
shape are found by one linear step together with the parameters of a base fit.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from identify.dataset.dataset import Dataset
from identify.dataset.drive import parts_of
from identify.dataset.prepared_log import PreparedLog
from identify.dataset.spectral_lines import lines_in_time
from identify.estimation.evidence import effective_samples
from identify.estimation.fit import Fit, finished, fit_axis
from identify.estimation.force_balance import jacobian, residual
from identify.estimation.subspace import orthonormal, unabsorbed
from twin.effect import Effect, Excitation, Kind, Parameter
from twin.model.machine import AxisModel, Fitted
from twin.model.parameters import ParameterReference, read, write

Array = NDArray[np.float64]

RIDGE = 1e-4  # keeps the linear step finite along directions that the base explains already
RESCORED_SHAPES = 24  # best shapes of a coarse scan that are tried with every strength
CHANCE = 4.0  # twice the gain in log likelihood, for each strength, that a scan of noise finds
FULL_SHAPES = 4  # best shapes on the logs' heads that are tried on all of the logs
REFINED_STARTS = 2  # best shapes of the scan that are worth a full refit
RESIDUAL_LINES = 12  # spectral lines of the residual that are tried
BETTER = 0.99  # part of the error that a new start must reach to be taken


@dataclass(frozen=True, eq=False)
class Start:
    """An effect at one shape with the strengths that one linear step finds best beside a base.

    squared_error: N^2, sum over the test functions after that step.
    """

    squared_error: float
    shape: dict[str, float]
    fitted: Fitted


def starts(base: Fit, dataset: Dataset, effect: Effect) -> list[Start]:
    """The effect at its best shapes beside the base, best first; at least one.

    All shapes are tried on the logs' heads with the screened strengths, the best of them with every
    strength, and the best of those on all of the logs.
    """
    excitation = _with_lines_left(base, dataset)
    found = [
        Start(0.0, shape, Fitted.at_start(effect)) for shape in tried_shapes(effect, excitation)
    ]
    whole = _Ground.of(base, dataset, effect, excitation, on_heads=False)
    if len(found) > FULL_SHAPES:
        head = _Ground.of(base, dataset, effect, excitation, on_heads=True)
        coarse = [p for p in effect.strengths if p.screened]
        if len(found) > RESCORED_SHAPES and len(coarse) < len(effect.strengths):
            found = _best(head, found, coarse, RESCORED_SHAPES)
        found = _best(head, found, effect.strengths, FULL_SHAPES)
        if effect.kind is not Kind.FRICTION and not _worth_all(base, head, whole, found[0]):
            found = found[:1]
    return _best(whole, found, effect.strengths, REFINED_STARTS)


def _worth_all(base: Fit, head: _Ground, whole: _Ground, start: Start) -> bool:
    """Whether the best shape gains more on the heads than chance, so that others are tried too."""
    samples = effective_samples(base.residual)
    before = float(np.sum(head.unchanged**2))
    gain = samples * np.log(before / max(start.squared_error, 1e-12 * before))
    free = len(start.fitted.effect.strengths)
    return bool(gain * len(head.unchanged) / len(whole.unchanged) > CHANCE * free)


def _best(
    ground: _Ground, tried: Sequence[Start], strengths: Sequence[Parameter], count: int
) -> list[Start]:
    scored = [_try(ground, s.shape, strengths) for s in tried]
    return sorted(scored, key=lambda s: s.squared_error)[:count]


def stepped(base: Fit, fitted: Fitted, logs: Sequence[PreparedLog]) -> AxisModel:
    """The base with the effect, after one linear step of the base's own parameters."""
    together = base.axis.with_effect(fitted)
    where = [c for c in base.scaling.where if _belongs(c, together)]
    columns = base.jacobian[:, [base.scaling.where.index(c) for c in where]]
    force = residual(together, logs)[base.kept]
    norms = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    step = np.linalg.lstsq(columns / norms, -force, rcond=1e-6)[0] / norms
    lower = [c.parameter.lower for c in where]
    upper = [c.parameter.upper for c in where]
    return write(together, where, np.clip(read(together, where) + step, lower, upper))


def fit_thoroughly(axis: AxisModel, dataset: Dataset) -> Fit:
    """Fit an axis; scan its effects' shapes again where the error is above the noise floor."""
    best = fit_axis(axis, dataset.fit)
    for name in axis.names:
        effect = axis[name].effect
        if best.at_floor or not any(p.scan for p in effect.parameters):
            continue
        rest = fit_without(best, dataset, name)
        first = starts(rest, dataset, effect)[0].fitted
        held = {n: best.axis[name].values[n] for n in best.axis[name].fixed}
        again = replace(first, values={**first.values, **held}, fixed=best.axis[name].fixed)
        other = fit_axis(best.axis.with_effect(again), dataset.fit)
        if other.error < BETTER * best.error:
            best = replace(other, begun=best.begun)
    return best


def fit_without(fit: Fit, dataset: Dataset, name: str) -> Fit:
    """The fit with one effect removed and the values of the others unchanged."""
    return finished(fit.axis.without(name), fit.begun, dataset.fit, fit.outcome)


def _with_lines_left(base: Fit, dataset: Dataset) -> Excitation:
    """What the motion covers, with the spectral lines of the base's residual first."""
    every = np.zeros(len(base.kept))
    every[base.kept] = base.residual
    ends = np.cumsum([len(w) for w in dataset.fit])[:-1]
    parts = zip(np.split(every, ends), dataset.fit, strict=True)
    forces = [(part, w.test_function.stride * w.test_function.period) for part, w in parts]
    left = lines_in_time(forces, most=RESIDUAL_LINES)
    return replace(dataset.excitation, lines=(*left, *dataset.excitation.lines))


def tried_shapes(effect: Effect, excitation: Excitation) -> Iterator[dict[str, float]]:
    """Combinations of values to try for the nonlinear parameters that the effect scans."""
    scanned = [p for p in effect.parameters if p.scan]
    grids = [p.scan(excitation) if p.scan else () for p in scanned]
    for values in itertools.product(*grids):
        yield {p.name: v for p, v in zip(scanned, values, strict=True)}


@dataclass(frozen=True, eq=False)
class _Ground:
    """The data that all shapes share: the base, without the friction that a friction replaces."""

    logs: Sequence[PreparedLog]
    excitation: Excitation
    effect: Effect
    rest: AxisModel
    basis: Array
    unchanged: Array
    kept: NDArray[np.bool_]

    @classmethod
    def of(
        cls, base: Fit, dataset: Dataset, effect: Effect, excitation: Excitation, *, on_heads: bool
    ) -> _Ground:
        rest = _without_friction(base.axis) if effect.kind is Kind.FRICTION else base.axis
        columns = [i for i, c in enumerate(base.scaling.where) if _belongs(c, rest)]
        among = dataset.in_heads if on_heads else np.ones(len(base.kept), dtype=bool)
        rows = among[base.kept]
        return cls(
            excitation=excitation,
            logs=dataset.heads if on_heads else dataset.fit,
            effect=effect,
            rest=rest,
            basis=orthonormal(base.jacobian[rows][:, columns]),
            unchanged=base.residual[rows],
            kept=base.kept[among],
        )


def _try(ground: _Ground, shape: dict[str, float], strengths: Sequence[Parameter]) -> Start:
    """Best strengths at one shape, by a linear step with the base parameters free."""
    effect = ground.effect
    first = Fitted.at_start(effect, _clipped(effect, ground.excitation, shape))
    axis = ground.rest.with_effect(first)
    where = [ParameterReference(effect.name, p) for p in strengths if p.name not in first.fixed]
    silent = all(first.values[p.name] == 0.0 for p in effect.strengths)
    force = ground.unchanged if silent else residual(axis, ground.logs)[ground.kept]
    # A reading's error changes the other forces too, but only to second order.
    alone = parts_of(axis, Kind.SENSING) if effect.kind is Kind.SENSING else axis
    columns = jacobian(alone, ground.logs, where)[ground.kept]
    step, squared = _bounded_step(ground.basis, force, columns, where, first)
    moved = {c.parameter.name: s for c, s in zip(where, step, strict=True)}
    return Start(squared, shape, replace(first, values={**first.values, **moved}))


def _clipped(effect: Effect, excitation: Excitation, shape: dict[str, float]) -> dict[str, float]:
    values = {**effect.starts(excitation), **shape}
    return {p.name: float(min(max(values[p.name], p.lower), p.upper)) for p in effect.parameters}


def _belongs(c: ParameterReference, axis: AxisModel) -> bool:
    return not c.effect or c.effect in axis.names


def _without_friction(axis: AxisModel) -> AxisModel:
    return replace(
        axis, effects=tuple(f for f in axis.effects if f.effect.kind is not Kind.FRICTION)
    )


def _bounded_step(
    basis: Array, force: Array, columns: Array, where: list[ParameterReference], first: Fitted
) -> tuple[Array, float]:
    """Strengths within bounds that minimise the force outside the span of the base's columns."""
    left, own = unabsorbed(force, basis), unabsorbed(columns, basis)
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
