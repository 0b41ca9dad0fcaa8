"""Absent effects as candidates: scan the shape of each, refit the model with it, score it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from identify.dataset.dataset import Dataset
from identify.dataset.drive import is_noise
from identify.dataset.prepared_log import moving, sticks
from identify.estimation.decision import RULE
from identify.estimation.evidence import effective_samples, evidence
from identify.estimation.fit import Fit, Outcome, finished, fit_axis, fit_roughly
from identify.estimation.force_balance import residual
from identify.estimation.thorough_fit import fit_thoroughly
from identify.estimation.variable_projection import Start, one_linear_step, starts
from identify.selection.scoring import Candidate, score
from twin.effect import Effect, Kind
from twin.effects import Catalogue
from twin.model.machine import AxisModel, MachineModel

Array = NDArray[np.float64]

FIRST_EVALUATIONS = 12  # of a refit, after which it must show some evidence to go on
HEAD_EVALUATIONS = 12  # of a friction fitted on the heads of the logs
HOPELESS = 2.0  # times the squared error of the present friction, after a rough fit of another


def absent_effects(axis: AxisModel, catalogue: Catalogue) -> list[Effect]:
    """Effects that could be added to the axis; another friction replaces the present one."""
    has_friction = any(f.effect.kind is Kind.FRICTION for f in axis.effects)
    return [
        e
        for e in catalogue.after(axis.names)
        if axis.can_have(e)
        and (e.kind is not Kind.MODIFIER or has_friction)
        and not e.is_nonparametric
    ]


def usable(catalogue: Catalogue, model: MachineModel) -> Catalogue:
    """The effects of a catalogue that a machine with as many axes can have."""
    return Catalogue([e for e in catalogue.values() if model.can_use(e)])


@dataclass(frozen=True, eq=False)
class Look:
    """What a cheap estimate tells of an effect: its starts, best first, or the candidate it is.

    share: part of the base's squared error that one linear step takes; None for a friction, which
    no linear step can put in the place of another. candidate: None where a refit is promising.
    """

    effect: Effect
    starts: tuple[Start, ...]
    share: float | None
    candidate: Candidate | None


def try_effect(base: Fit, dataset: Dataset, effect: Effect) -> Candidate:
    """Refit the model together with the effect and score it against the base.

    Where a look at it is far from any evidence, that is scored and no refit is made.
    """
    look = look_at(base, dataset, effect)
    return look.candidate or refitted(base, dataset, look)


def look_at(base: Fit, dataset: Dataset, effect: Effect) -> Look:
    """One linear step beside the base; for a friction a fit to the heads of the logs."""
    found = tuple(starts(base, dataset, effect))
    best, share = found[0], None
    fit: Fit | None = None
    if is_noise(effect):
        axis = base.axis.with_effect(best.fitted)
        fit = finished(axis, base.begun, dataset.fit, base.outcome)
    elif effect.kind is Kind.FRICTION:
        fit, best = _fitted_to_heads(base, dataset, found)
        found = (best, *(s for s in found if s is not best))
    else:
        share = best.share(base)
        fit = None if _promising(base, best) else one_linear_step(base, best)
    candidate = None if fit is None else score(base, fit, dataset, effect)
    return Look(effect, found, share, candidate)


def as_looked(base: Fit, dataset: Dataset, look: Look) -> Candidate:
    """The candidate as its linear step predicts it, without a refit."""
    return score(base, one_linear_step(base, look.starts[0]), dataset, look.effect)


def refitted(base: Fit, dataset: Dataset, look: Look) -> Candidate:
    """The candidate with all parameters fitted, from where the look ended."""
    effect, (best, *others) = look.effect, look.starts
    fit = fit_axis(base.axis.with_effect(best.fitted), dataset.fit, FIRST_EVALUATIONS)
    first = score(base, fit, dataset, effect)
    if first.delta_bic < 0.0:
        return first
    if fit.outcome is Outcome.NOT_CONVERGED:
        fit = fit_axis(fit.axis, dataset.fit)
    fit = simplified(fit, dataset, effect)
    first = first if fit is first.fit else score(base, fit, dataset, effect)
    if first.fit.at_floor or first.delta_bic < RULE.least_bic:
        return first
    # It helps but does not explain everything. The effect was missing when the base was fitted,
    # which distorts its values, so the fit also starts from where the base started.
    fits = [first.fit, fit_axis(base.begun.with_effect(best.fitted), dataset.fit)]
    fits += [fit_axis(base.axis.with_effect(other.fitted), dataset.fit) for other in others]
    best_fit = min(fits, key=lambda f: f.error)
    if not best_fit.at_floor:
        best_fit = fit_thoroughly(best_fit.axis, dataset)
    return score(base, simplified(best_fit, dataset, effect), dataset, effect)


def _promising(base: Fit, start: Start) -> bool:
    """Whether the gain of the linear step is large enough that a refit may give evidence."""
    free = len(start.fitted.effect.parameters) - len(start.fitted.fixed)
    asked = RULE.least_bic + free * np.log(base.samples)
    return bool(start.gain(base) > RULE.promise * asked)


def _fitted_to_heads(
    base: Fit, dataset: Dataset, found: Sequence[Start]
) -> tuple[Fit | None, Start]:
    """Another friction fitted to the heads, if it is no better there than the present one.

    And the start that led furthest.
    """
    if sum(map(len, dataset.heads)) > 0.5 * sum(map(len, dataset.fit)):
        return None, found[0]
    old = _on_heads(base, dataset)
    fits = [_to_heads(base.axis.with_effect(s.fitted), dataset, old) for s in found]
    new, start = min(zip(fits, found, strict=True), key=lambda pair: pair[0].error)
    either = moving(dataset.heads, sticks(old.axis) or sticks(new.axis))
    before, after = (residual(f.axis, dataset.heads)[either] for f in (old, new))
    gain = effective_samples(before) * evidence(before, after, 1).log_gain
    if gain > RULE.promise * RULE.least_bic:
        return None, start
    return finished(new.axis, base.begun, dataset.fit, new.outcome), start


def _to_heads(axis: AxisModel, dataset: Dataset, old: Fit) -> Fit:
    """An axis with another friction fitted to the heads, to its end unless that is hopeless."""
    fit = fit_roughly(axis, dataset.heads, HEAD_EVALUATIONS)
    both = fit.kept & old.kept
    left, present = (f.residual[both[f.kept]] for f in (fit, old))
    if left @ left > HOPELESS * (present @ present):
        return fit
    return fit_axis(fit.axis, dataset.heads, HEAD_EVALUATIONS)


@lru_cache(maxsize=1)  # every friction is compared with the same base
def _on_heads(base: Fit, dataset: Dataset) -> Fit:
    return fit_axis(base.axis, dataset.heads)


def simplified(fit: Fit, dataset: Dataset, effect: Effect) -> Fit:
    """The fit with the simplest values of the effect, where they explain as much."""
    if effect.simplest is None:
        return fit
    fitted = fit.axis[effect.name]
    simple = effect.simplest(fitted.values)
    if simple == dict(fitted.values):
        return fit
    again = fit_axis(fit.axis.with_effect(replace(fitted, values=simple)), dataset.fit)
    return again if again.error < RULE.same_error * fit.error else fit
