"""Changes of a model that a diagnosis may make: an effect more, an exponent free, a free curve.

Each can be screened by one linear step, be refitted, and be undone, whatever it is; so one search
and one acceptance test serve them all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from identify.dataset.dataset import Dataset
from identify.dataset.prepared_log import Columns, PreparedLog, moving, split_by_log, sticks
from identify.estimation.evidence import BETTER
from identify.estimation.fit import Fit, at_bounds, fit_axis, fit_roughly
from identify.estimation.force_balance import jacobian, residual
from identify.estimation.found_shape import held_exponents, held_strengths
from identify.estimation.free_curves import Shape, columns_of, shapes_of, sticking
from identify.estimation.variable_projection import Start, starts
from identify.rules import RULE
from identify.selection.acceptance import Judged, part_of
from identify.selection.candidates import imitation_of
from identify.selection.controls import ControlTest, change_of, with_unit_penalty
from identify.selection.nonparametric import fit_in_place
from twin.effect import Effect, Kind
from twin.model.machine import AxisModel, Fitted
from twin.model.parameters import ParameterReference

Array = NDArray[np.float64]
Logs = Sequence[PreparedLog]


@dataclass(frozen=True, eq=False)
class Screening:
    """What is known of a change before any refit.

    promise: part of the error above the floor that it takes in one linear step (``acceptance``).
    axes: values to begin a refit from, the most promising first; none where a step tells no more.
    """

    change: Change
    promise: float
    axes: tuple[AxisModel, ...] = ()


class Change(Protocol):
    """What a model may lack."""

    @property
    def name(self) -> str:
        """Name of the effect that it is about."""

    @property
    def effect(self) -> Effect:
        """The effect that it adds or changes; of a free curve the curve itself."""

    def screen(self, judged: Judged, trial: ControlTest) -> Screening:
        """One linear step beside a fit."""

    def refit(self, judged: Judged, screening: Screening) -> Fit:
        """The fit with the change, from its first start."""

    def undone(self, axis: AxisModel, base: AxisModel) -> AxisModel | None:
        """An axis without the change, as the base has it; None where it is not there any more."""

    def columns(self, without: Judged, fit: Judged) -> tuple[Columns, bool]:
        """Its columns as found, beside a fit without it, and whether standstill is left out."""


@dataclass(frozen=True)
class Added:
    """An effect of the catalogue that the model does not have."""

    effect: Effect

    @property
    def name(self) -> str:
        return self.effect.name

    def screen(self, judged: Judged, trial: ControlTest) -> Screening:
        fit, dataset = judged.fit, judged.dataset
        found = starts(fit, dataset, self.effect)
        if self.effect.kind is Kind.FRICTION:
            return self._on_heads(judged, found)
        axes = tuple(fit.axis.with_effect(s.fitted) for s in found)
        # Of the training logs: where a period is only scanned, others tell little of it.
        left = max(1.0 - found[0].share(fit), 0.0) * fit.error**2
        return Screening(self, part_of(fit.error**2, left, fit.floor**2), axes)

    def _on_heads(self, judged: Judged, found: Sequence[Start]) -> Screening:
        """Another friction, which no linear step puts in the place of one: a fit on the heads.

        What it takes of all training logs counts as well, as their heads may hold little of the
        error.
        """
        fit, heads = judged.fit, judged.dataset.heads
        grounds = _before_a_friction(fit, judged.dataset)

        def promise(new: Fit) -> float:
            parts = []
            for logs, before in grounds:
                both = moving(logs, sticks(fit.axis) or sticks(new.axis))
                if not both.any():
                    continue  # these beginnings rest
                was, now = (r[both] @ r[both] for r in (before, residual(new.axis, logs)))
                parts.append(part_of(was / both.sum(), now / both.sum(), fit.floor**2))
            return max(parts, default=0.0)

        # 4 evaluations: more do not change which start is best
        fits = [fit_roughly(fit.axis.with_effect(s.fitted), heads, 4) for s in found]
        promises = {f: promise(f) for f in fits}
        first, *others = sorted(fits, key=lambda f: -promises[f])
        if (most := promises[first]) > 0.0:
            # 12 of the best one, where it helps: frictions with a memory need them
            first = fit_roughly(first.axis, heads, 12)
            most = promise(first)
        return Screening(self, most, tuple(f.axis for f in (first, *others)))

    def refit(self, judged: Judged, screening: Screening) -> Fit:
        return simplified(fit_axis(screening.axes[0], judged.dataset.training), judged, self.effect)

    def undone(self, axis: AxisModel, base: AxisModel) -> AxisModel | None:
        return axis_less(self.effect, axis, base) if self.name in axis.names else None

    def columns(self, without: Judged, fit: Judged) -> tuple[Columns, bool]:
        replaced = self.name not in fit.fit.axis.names  # by a free curve
        if replaced or self.effect.kind is Kind.FRICTION or not self.effect.strengths:
            return change_of(without, fit), _resting(without, fit)
        axis = without.fit.axis.with_effect(fit.fit.axis[self.name])
        return _strength_columns(axis, self.name, without.fit), sticks(axis)


@dataclass(frozen=True)
class Freed:
    """A parameter that a law holds by design, such as an exponent, and that bends its curve.

    Or the strength of one that a MuJoCo file states, and that the model holds at its value.
    """

    effect: Effect
    parameter: str
    held: float

    @property
    def name(self) -> str:
        return self.effect.name

    @property
    def is_strength(self) -> bool:
        """Whether it is how strong the law is, and not what bends it."""
        return self.effect.parameter(self.parameter).strength

    def free(self, axis: AxisModel) -> AxisModel:
        """The axis with the parameter free, at the value that it had."""
        law = axis[self.name]
        return axis.with_effect(replace(law, fixed=law.fixed - {self.parameter}))

    def screen(self, judged: Judged, trial: ControlTest) -> Screening:
        """By the change of the residual at two other values: the law bends between them."""
        axis, free = judged.fit.axis, self.free(judged.fit.axis)
        law = free[self.name]
        # 0.6, 1.5 times what a law holds by design, at which its exponent is tried
        others = [{**law.values, self.parameter: r * self.held} for r in (0.6, 1.5)]
        axes = [free, *(axis.with_effect(replace(law, values=v)) for v in others)]

        def columns(logs: Sequence[PreparedLog]) -> list[Array]:
            now, *then = (residual(a, logs) for a in axes)
            return split_by_log(np.column_stack([t - now for t in then]), logs)

        promise = trial.part(with_unit_penalty(columns, judged.fit), sticking=sticks(axis))
        return Screening(self, promise, tuple(axes))

    def refit(self, judged: Judged, screening: Screening) -> Fit:
        return fit_axis(screening.axes[0], judged.dataset.training)

    def undone(self, axis: AxisModel, base: AxisModel) -> AxisModel | None:
        law = axis[self.name] if self.name in axis.names else None
        if law is None or self.parameter in law.fixed:
            return None
        values = {**law.values, self.parameter: self.held}
        return axis.with_effect(replace(law, values=values, fixed=law.fixed | {self.parameter}))

    def columns(self, without: Judged, fit: Judged) -> tuple[Columns, bool]:
        return change_of(without, fit), _resting(without, fit)


@dataclass(frozen=True, eq=False)
class Reshaped:
    """A free curve in the place of a law, or beside it. law: as it was before."""

    shape: Shape
    law: Fitted

    @property
    def name(self) -> str:
        return self.shape.effect

    @property
    def effect(self) -> Effect:
        return self.shape.empty.effect

    def screen(self, judged: Judged, trial: ControlTest) -> Screening:
        columns, resting = self.columns(judged, judged)
        return Screening(self, trial.part(columns, sticking=resting))

    def refit(self, judged: Judged, screening: Screening) -> Fit:
        return fit_in_place(judged.fit, judged.dataset, self.shape)

    def undone(self, axis: AxisModel, base: AxisModel) -> AxisModel | None:
        curve = self.shape.empty.effect.name
        if curve not in axis.names:
            return None
        axis = axis.without(curve)
        rubs = self.law.effect.kind is Kind.FRICTION and axis.friction is not None
        return axis if rubs or self.name in axis.names else axis.with_effect(self.law)

    def columns(self, without: Judged, fit: Judged) -> tuple[Columns, bool]:
        axis, logs = without.fit.axis, without.dataset.training
        resting = sticking(axis, self.shape)
        samples = int(np.count_nonzero(moving(logs, resting)))
        return columns_of(axis, self.shape, samples), resting


def freed_of(axis: AxisModel) -> list[Freed]:
    """The parameters that bend the laws of an axis, or that its file states, and are held."""
    return [
        Freed(law.effect, name, law.values[name])
        for law in axis.effects
        for name in (*held_exponents(law), *held_strengths(law))
    ]


def reshaped_of(fit: Fit, dataset: Dataset) -> list[Reshaped]:
    """The free curves that the training logs ask for."""
    return [Reshaped(shape, fit.axis[shape.effect]) for shape in shapes_of(fit, dataset)]


def control(change: Change, without: Judged, fit: Judged) -> float:
    """The part that a change's controls take beside a fit without it (``controls``)."""
    columns, resting = change.columns(without, fit)
    return ControlTest.beside(without).control(columns, sticking=resting)


def from_all_starts(judged: Judged, screening: Screening, first: Fit) -> Fit:
    """The best of a first fit and of those from all other starts, in which the effect is itself.

    The effect was missing when the fit before was made, which distorts its values, so one start has
    those of the model as it was given.
    """
    change, logs, axes = screening.change, judged.dataset.training, screening.axes[1:]
    if not isinstance(change, Added):
        return min([first, *(fit_axis(axis, logs) for axis in axes)], key=lambda f: f.error)
    begun = judged.fit.axis.begun_as(judged.fit.begun).with_effect(first.axis[change.name])
    fits = [first, *(fit_axis(axis, logs) for axis in (begun, *axes))]
    return simplified(min(fits, key=partial(_rank, judged, change)), judged, change.effect)


def _rank(judged: Judged, change: Added, fit: Fit) -> tuple[bool, float]:
    """A law that has become another tells nothing, however much it takes."""
    law = fit.axis[change.name]
    other = imitation_of(fit.axis, law, (), judged.dataset.excitation) is not None
    return other, fit.error


def simplified(fit: Fit, judged: Judged, effect: Effect) -> Fit:
    """The fit with the simplest values of the effect, where they explain as much.

    Strengths that ended at a bound belong to another law; it is fitted without them.
    """
    inside = _held_inside(_less_at_bounds(fit, judged, effect), judged, effect)
    return in_simplest_values(inside, effect)


def in_simplest_values(fit: Fit, effect: Effect) -> Fit:
    """The fit with the simplest values of an effect, where they explain as much."""
    if effect.simplest is None:
        return fit
    fitted = fit.axis[effect.name]
    simple = effect.simplest(fitted.values)
    if simple == dict(fitted.values):
        return fit
    again = fit_axis(fit.axis.with_effect(replace(fitted, values=simple)), fit.logs)
    return again if BETTER * again.error < fit.error else fit


def _less_at_bounds(fit: Fit, judged: Judged, effect: Effect) -> Fit:
    """The fit without the strengths that ended at a bound, where it still takes most of as much."""
    ended = {label.split(".")[-1] for label in at_bounds(fit, effect.name)}
    if not ended or not ended < {p.name for p in effect.strengths}:
        return fit
    fitted = fit.axis[effect.name]
    values = {**fitted.values, **dict.fromkeys(ended, 0.0)}
    less = replace(fitted, values=values, fixed=fitted.fixed | ended)
    again = fit_axis(fit.axis.with_effect(less), fit.logs)
    before, first, then = (f.error**2 for f in (judged.fit, fit, again))
    return again if before - then > RULE.promise * (before - first) else fit


def _held_inside(fit: Fit, judged: Judged, effect: Effect) -> Fit:
    """The fit with what ended at a bound held half way to it, where that explains as much.

    Of two values of which the logs tell a ratio alone, as the load and the stiffness of a mode
    beyond what they reach, one ends anywhere: its bound tells nothing against the effect, but where
    it is another law beyond.
    """
    fitted, ended = fit.axis[effect.name], at_bounds(fit, effect.name)
    names = [label.split(".")[-1] for label in ended]
    if not names or imitation_of(fit.axis, fitted, ended, judged.dataset.excitation):
        return fit
    half = {n: 0.5 * (effect.parameter(n).start + fitted.values[n]) for n in names}
    values, fixed = {**fitted.values, **half}, fitted.fixed.union(names)
    again = fit_axis(fit.axis.with_effect(replace(fitted, values=values, fixed=fixed)), fit.logs)
    return again if RULE.fallen * again.error < fit.error else fit


def axis_less(effect: Effect, axis: AxisModel, base: AxisModel) -> AxisModel:
    """The axis without an effect; a friction is replaced by that of the base."""
    if effect.kind is Kind.FRICTION and base.friction:
        return axis.with_effect(base.friction)
    return axis.without(effect.name)


def _strength_columns(axis: AxisModel, name: str, fit: Fit) -> Columns:
    """The forces of an effect's free strengths."""
    law = axis[name]
    free = [p for p in law.effect.strengths if p.name not in law.fixed]
    where = [ParameterReference(name, p) for p in free]

    def columns(logs: Sequence[PreparedLog]) -> list[Array]:
        return split_by_log(jacobian(axis, logs, where), logs)

    return with_unit_penalty(columns, fit)


def _resting(without: Judged, fit: Judged) -> bool:
    return sticks(without.fit.axis) or sticks(fit.fit.axis)


@lru_cache(maxsize=4)  # every other friction is screened beside the same fit
def _before_a_friction(fit: Fit, dataset: Dataset) -> tuple[tuple[Logs, Array], ...]:
    """Heads and training logs, with the residual (n,) N of an axis fitted to each."""
    refitted = fit_axis(fit.axis, dataset.heads).axis
    pairs = ((dataset.heads, refitted), (dataset.training, fit.axis))
    return tuple((logs, residual(axis, logs)) for logs, axis in pairs)
