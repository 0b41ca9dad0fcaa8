"""Variable projection: scan an effect's nonlinear parameters, solve for the linear ones at each.

The linear parameters are called strengths, a set of nonlinear values a shape. The strengths at a
shape are found by one linear step together with the parameters of a base fit. A fit from given
values ends in the nearest optimum, such as a pitch of one roller fewer, so where error is left the
shapes of the effects that a model has are scanned again (`fit_multistart`).
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from identify.dataset.dataset import Dataset
from identify.dataset.drive import parts_of
from identify.dataset.prepared_log import PreparedLog
from identify.estimation.evidence import BETTER, Evidence
from identify.estimation.fit import Fit, finished, fit_axis
from identify.estimation.force_balance import jacobian, residual
from identify.estimation.least_squares import RIDGE, ROUNDING, minimise, orthonormal, unabsorbed
from twin.effect import Effect, Excitation, Kind, Parameter
from twin.effects import Catalogue
from twin.model.machine import AxisModel, Fitted, MachineModel
from twin.model.parameters import ParameterReference, read
from twin.signals import Array

FINALISTS = 4  # best shapes that are looked at more closely: beside them, on all of the logs
REFINED_STARTS = 2  # best shapes of the scan that are worth a full refit


@dataclass(frozen=True, eq=False)
class Start:
    """An effect at one shape with the strengths that one linear step finds best beside a base.

    force (n,): N, residual with it and the base as it is. left (n,): N, after the base's own
    parameters followed by a linear step. is_silent: whether no strength makes a force there.
    """

    shape: dict[str, float]
    fitted: Fitted
    force: Array
    left: Array
    is_silent: bool = False

    @cached_property
    def squared_error(self) -> float:
        """N^2, sum over the test functions of what is left."""
        return float(self.left @ self.left)

    def share(self, base: Fit) -> float:
        """Part of the squared error that it takes, of what a linear step of the base leaves."""
        before = float(base.unabsorbed @ base.unabsorbed)
        return 1.0 - self.squared_error / before if before > 0.0 else 0.0

    def is_likely(self, base: Fit) -> bool:
        """Whether it gains more than its strengths would of noise, by Schwarz's criterion."""
        told = Evidence(
            -np.log(max(1.0 - self.share(base), ROUNDING)),
            len(self.fitted.effect.strengths),
            base.samples,
        )
        return told.delta_bic > 0.0


def starts(base: Fit, dataset: Dataset, effect: Effect) -> list[Start]:
    """The effect at its best shapes beside the base, best first; at least one.

    Few shapes are tried on all of the logs. More are tried on their heads, of many those that
    ``_scanned`` picks, and the best of them on all of the logs; the others only if the first gains
    more there than chance. So are the shapes that make no force on the heads, such as a stop that
    only a later move reaches. A friction's shapes are told apart by the heads.
    """
    excitation = with_what_repeats(base, dataset)
    nothing, absent = np.zeros(0), Fitted.at_start(effect)
    shapes = _itself(effect, list(tried_shapes(effect, excitation)), excitation)
    found = [Start(shape, absent, nothing, nothing) for shape in shapes]
    whole = _Ground.of(base, dataset, effect, excitation, on_heads=False)
    # 12 shapes are few enough to be tried where the effect may be rare, as breakaways after rests
    if len(found) <= (FINALISTS if effect.kind is Kind.FRICTION else 12):
        return _best(whole, found)[:REFINED_STARTS]
    found = _scanned(_Ground.of(base, dataset, effect, excitation, on_heads=True), found)
    if effect.kind is Kind.FRICTION:
        return _unlike(found)
    unseen = [s for s in found if s.is_silent]
    found = [s for s in found if not s.is_silent][:FINALISTS] or unseen[:1]
    first = _try(whole, found[0].shape)
    others = _best(whole, [*(found[1:] if first.is_likely(base) else ()), *unseen])
    return sorted((first, *others), key=lambda s: s.squared_error)[:REFINED_STARTS]


def _itself(
    effect: Effect, shapes: list[dict[str, float]], excitation: Excitation
) -> list[dict[str, float]]:
    """The shapes with which the effect is itself; all, where it is with none.

    Others would fit better, as harmonics of a period that is too long follow whatever is slow.
    """
    begun = effect.starts(excitation)
    return [s for s in shapes if not effect.imitation({**begun, **s}, excitation)] or shapes


def _best(ground: _Ground, tried: Iterable[Start]) -> list[Start]:
    return sorted((_try(ground, s.shape) for s in tried), key=lambda s: s.squared_error)


def _scanned(ground: _Ground, tried: Sequence[Start]) -> list[Start]:
    """All shapes, best first; of many every other value of each, and those beside the best."""
    if len(tried) <= 50:  # of which every other value is tried first, then what is beside the best
        return _best(ground, tried)
    grids = {name: sorted({s.shape[name] for s in tried}) for name in tried[0].shape}

    def places(shapes: Sequence[Start]) -> NDArray[np.int_]:
        return np.array([[grids[n].index(v) for n, v in s.shape.items()] for s in shapes])

    there = places(tried)
    first = np.all(there % 2 == 0, axis=1)
    found = _best(ground, itertools.compress(tried, first.tolist()))
    steps = np.abs(there[:, None] - places(found[:FINALISTS])).max(axis=2)
    beside = np.any(steps <= 1, axis=1) & ~first
    others = _best(ground, itertools.compress(tried, beside.tolist()))
    return sorted((*found, *others), key=lambda s: s.squared_error)


def _unlike(found: Sequence[Start]) -> list[Start]:
    """The first of some starts, and the next that shares no value of its shape, where one does.

    The linear step ranks stiffnesses poorly where all are far off; each may lead to another fit.
    """
    others = (s for s in found[1:] if not s.shape.items() & found[0].shape.items())
    return [found[0], *itertools.islice(others, REFINED_STARTS - 1)]


def with_what_repeats(base: Fit, dataset: Dataset) -> Excitation:
    """What the motion covers, with what repeats in the base's residual, and first."""
    known = dataset.excitation
    return replace(known, repeats=_Beside(base, known.lines))


@dataclass(frozen=True, eq=False)
class _Beside:
    """What repeats beside a base, which few effects ask for. known: Hz, lines of the force."""

    base: Fit
    known: tuple[float, ...]

    @property
    def lines(self) -> tuple[float, ...]:
        return (*self.base.lines, *self.known)

    @property
    def pitches(self) -> tuple[float, ...]:
        return self.base.pitches

    @property
    def thrust_pitches(self) -> tuple[float, ...]:
        return self.base.thrust_pitches

    @property
    def friction_pitches(self) -> tuple[float, ...]:
        return self.base.friction_pitches


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
        rest = base.axis
        if effect.kind is Kind.FRICTION:
            rest = parts_of(rest, *(set(Kind) - {Kind.FRICTION}))
        among = dataset.in_heads if on_heads else np.ones(len(base.kept), dtype=bool)
        return cls(
            excitation=excitation,
            logs=dataset.heads if on_heads else dataset.training,
            effect=effect,
            rest=rest,
            basis=basis_beside(base, dataset if on_heads else None, rest.names),
            unchanged=base.residual[among[base.kept]],
            kept=base.kept[among],
        )


@lru_cache(maxsize=4)  # every effect asks it of the same base: on the heads and whole
def basis_beside(base: Fit, heads: Dataset | None, names: tuple[str, ...]) -> Array:
    """Orthonormal basis of what the base's parameters of some effects can add, on heads if any."""
    columns = [i for i, c in enumerate(base.scaling.where) if not c.effect or c.effect in names]
    rows = base.jacobian if heads is None else base.jacobian[heads.in_heads[base.kept]]
    return orthonormal(rows[:, columns])


def _try(ground: _Ground, shape: dict[str, float]) -> Start:
    """Best strengths at one shape, by a linear step with the base parameters free."""
    effect = ground.effect
    values = {**effect.starts(ground.excitation), **shape}
    clipped = {p.name: float(min(max(values[p.name], p.lower), p.upper)) for p in effect.parameters}
    first = Fitted.at_start(effect, clipped)
    axis = ground.rest.with_effect(first)
    where = [
        ParameterReference(effect.name, p) for p in effect.strengths if p.name not in first.fixed
    ]
    silent = all(first.values[p.name] == 0.0 for p in effect.strengths)
    force = ground.unchanged if silent else residual(axis, ground.logs)[ground.kept]
    # A reading's error changes the other forces too, but only to second order.
    apart = (Kind.SENSING, Kind.ACTUATION)
    alone = parts_of(axis, *apart) if effect.kind is Kind.SENSING else axis
    columns = jacobian(alone, ground.logs, where, ground.kept)
    step = _bounded_step(ground.basis, force, columns, where, first)
    ends = read(axis, where) + step
    moved = {c.parameter.name: v for c, v in zip(where, ends, strict=True)}
    added = force + columns @ step
    fitted = replace(first, values={**first.values, **moved})
    left = unabsorbed(added, ground.basis)
    return Start(shape, fitted, added, left, is_silent=not columns.any())


def _bounded_step(
    basis: Array, force: Array, columns: Array, where: list[ParameterReference], first: Fitted
) -> Array:
    """Change of the strengths (k,) within bounds that minimises the force outside a base's span."""
    left, own = unabsorbed(force, basis), unabsorbed(columns, basis)
    norms = np.linalg.norm(columns, axis=0)
    norms[norms == 0.0] = 1.0
    start = np.array([first.values[c.parameter.name] for c in where])
    low = (np.array([c.parameter.lower for c in where]) - start) * norms
    high = (np.array([c.parameter.upper for c in where]) - start) * norms
    normal = own.T @ own / np.outer(norms, norms) + RIDGE**2 * np.eye(len(where))
    wanted = -(own.T @ left) / norms
    step = np.linalg.solve(normal, wanted)
    if ((step < low) | (step > high)).any():
        if len(step) == 1:
            return np.clip(step, low, high) / norms
        factor = np.linalg.cholesky(normal).T.astype(float)
        aim = np.linalg.solve(factor.T, wanted)
        step = minimise(lambda x: factor @ x - aim, lambda x: factor, step, (low, high)).x
    return np.asarray(step / norms)


def fit_multistart(axis: AxisModel, dataset: Dataset, begun: AxisModel | None = None) -> Fit:
    """Fit an axis; scan its effects' shapes again where the error is above the noise floor.

    Long logs by their beginnings, with one fit of what is found to all of them. begun: what the fit
    counts as begun with; the axis itself where None.
    """
    if dataset.part is not dataset:
        shaped = fit_multistart(axis, dataset.part).axis
        return replace(fit_axis(shaped, dataset.training), begun=begun or axis)
    best = fit_axis(axis, dataset.training)
    if begun is not None:
        best = replace(best, begun=begun)
    for name in axis.names:
        effect = axis[name].effect
        if best.at_floor or not any(p.scan for p in effect.parameters):
            continue
        rest = fit_without(best, dataset, name)
        found = starts(rest, dataset, effect)[0]
        known = with_what_repeats(rest, dataset)
        if not _promises(found, best, dataset) and _is_nearest(found.shape, best.axis[name], known):
            continue
        first = found.fitted
        held = {n: best.axis[name].values[n] for n in best.axis[name].fixed}
        again = replace(first, values={**first.values, **held}, fixed=best.axis[name].fixed)
        other = fit_axis(best.axis.with_effect(again), dataset.training)
        if other.error < BETTER * best.error:
            best = replace(other, begun=best.begun)
    return best


def _promises(start: Start, fit: Fit, dataset: Dataset) -> bool:
    """Whether a start, after its linear step, leaves less than a fit on the same logs.

    A fit that ended early is worth another, whatever leads to it. On the heads, where a start was
    found on them, after a linear step too: a fit to all of the logs does not fit them as well.
    """
    there = fit.residual
    if len(start.left) != len(there):
        rows = dataset.in_heads[fit.kept]
        there = unabsorbed(fit.residual[rows], orthonormal(fit.jacobian[rows]))
    return bool(np.mean(start.left**2) < BETTER**2 * np.mean(there**2))


def _is_nearest(shape: dict[str, float], present: Fitted, excitation: Excitation) -> bool:
    """Whether the present values are nearer to this shape than to any other that is scanned."""

    def nearest(p: Parameter) -> float:
        value = present.values[p.name]
        return min(p.scan(excitation) if p.scan else (), key=lambda v: abs(v - value))

    return all(nearest(present.effect.parameter(n)) == v for n, v in shape.items())


def fit_without(fit: Fit, dataset: Dataset, name: str) -> Fit:
    """The fit with one effect removed and the values of the others unchanged."""
    return finished(fit.axis.without(name), fit.begun, dataset.training, fit.outcome)


def absent_effects(axis: AxisModel, catalogue: Catalogue) -> list[Effect]:
    """Effects that could be added to the axis; another friction replaces the present one."""
    return [
        e
        for e in catalogue.after(axis.names)
        if axis.can_have(e)
        and (e.kind is not Kind.MODIFIER or axis.friction is not None)
        and not e.is_nonparametric
    ]


def usable(catalogue: Catalogue, model: MachineModel) -> Catalogue:
    """The effects of a catalogue that a machine with as many axes can have."""
    return Catalogue([e for e in catalogue.values() if model.can_use(e)])
