"""Candidates ranked: every absent effect is tried beside a fit and ordered by evidence."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial

import numpy as np
from numpy.typing import NDArray

from identify.dataset.dataset import Dataset
from identify.dataset.prepared_log import moving, sticks
from identify.estimation.decision import RULE
from identify.estimation.evidence import evidence, held_out_gain
from identify.estimation.fit import Fit, fit_axis
from identify.estimation.force_balance import residual
from identify.selection.candidates import (
    Candidate,
    absent_effects,
    on_equal_samples,
    score,
    try_effect,
)
from twin.effect import Effect, Kind
from twin.effects import Catalogue
from twin.model.machine import AxisModel

Array = NDArray[np.float64]
Progress = Callable[[int, int], None]


def rank(
    base: Fit,
    dataset: Dataset,
    catalogue: Catalogue,
    progress: Progress | None = None,
    workers: int | None = None,
) -> tuple[Fit, tuple[Candidate, ...]]:
    """The base, and every absent effect tried beside it, by falling merit.

    If the values of the best candidate without its effect are a better start for the base, the base
    is refitted from there: a base short of its optimum would give evidence to every candidate.
    """
    effects = absent_effects(base.axis, catalogue)
    candidates = []
    # The laws release Python's lock, so candidates run in parallel.
    with ThreadPoolExecutor(workers or os.cpu_count()) as pool:
        for candidate in pool.map(partial(try_effect, base, dataset), effects):
            candidates.append(candidate)
            if progress:
                progress(len(candidates), len(effects))
    supported = [c for c in candidates if c.supported]
    if supported:
        best = max(supported, key=lambda c: c.delta_bic)
        again = less(best.effect, best.fit, base, dataset)
        if again.error < RULE.settled * base.error:
            base = again
            candidates = [score(base, c.fit, dataset, c.effect) for c in candidates]
    return base, _ranked(candidates)


def less(effect: Effect, fit: Fit, base: Fit, dataset: Dataset) -> Fit:
    """The fit without an effect, refitted; a friction is replaced by that of the base."""
    if effect.kind is Kind.FRICTION:
        own = next((f for f in base.axis.effects if f.effect.kind is Kind.FRICTION), None)
        axis = fit.axis.with_effect(own) if own else fit.axis.without(effect.name)
    else:
        axis = fit.axis.without(effect.name)
    return fit_axis(axis, dataset.fit)


def _ranked(candidates: Sequence[Candidate]) -> tuple[Candidate, ...]:
    """Supported first, and among these the effects that lower the error before noise."""
    lowers = _ordered(on_equal_samples([c for c in candidates if not c.is_noise]))
    noise = _ordered([c for c in candidates if c.is_noise])
    return tuple(sorted([*lowers, *noise], key=lambda c: not c.supported))


def _ordered(candidates: list[Candidate]) -> list[Candidate]:
    """By falling merit; those that no evidence separates from the best are in order of name."""
    ranking = sorted(candidates, key=_merit)
    if not ranking or not ranking[0].supported:
        return ranking
    best = ranking[0].evidence
    level = [c for c in ranking if c.supported and best.over(c.evidence) < RULE.no_evidence]
    rest = [c for c in ranking if c not in level]
    return [*sorted(level, key=lambda c: c.effect.name), *rest]


def _merit(c: Candidate) -> tuple[bool, float]:
    """Supported first, then by evidence."""
    return (not c.supported, -c.delta_bic)


def tie(dataset: Dataset, best: Candidate, other: Candidate) -> bool:
    """Whether neither the evidence nor the held-out error favours the best of two candidates."""
    if best.is_noise or other.is_noise:
        return False
    if best.evidence.over(other.evidence) > RULE.least_separation:
        return False
    logs = dataset.holdout or dataset.fit
    either = sticks(best.fit.axis) or sticks(other.fit.axis)
    kept = moving(logs, either)
    pair = [residual(c.fit.axis, logs)[kept] for c in (other, best)]
    if held_out_gain(pair[0], pair[1], best.fit.floor).t < RULE.tie:
        return True
    # A significant difference may still be negligible, such as between two kinds of delay.
    return evidence(pair[0], pair[1], 0).delta_bic < RULE.no_evidence


def took_friction(before: AxisModel, after: AxisModel) -> bool:
    """Whether the friction lost most of its dry part (N) between two models."""
    for old in before.effects:
        if old.effect.kind is not Kind.FRICTION or old.effect.name not in after.names:
            continue
        new = after[old.effect.name].values
        dry = [p.name for p in old.effect.strengths if p.dry and p.name not in old.fixed]
        return any(new[name] < RULE.collapse * old.values[name] for name in dry)
    return False
