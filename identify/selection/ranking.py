"""Candidates ranked: every absent effect is tried beside a fit and ordered by evidence."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from identify.dataset.dataset import Dataset
from identify.dataset.prepared_log import moving, sticks
from identify.estimation.decision import RULE
from identify.estimation.evidence import evidence, held_out_gain
from identify.estimation.fit import Fit, fit_axis
from identify.estimation.force_balance import residual
from identify.selection.candidates import Look, absent_effects, as_looked, look_at, refitted
from identify.selection.scoring import Candidate, on_equal_samples, score
from twin.effect import Effect, Kind
from twin.effects import Catalogue
from twin.memory import give_back
from twin.model.machine import AxisModel
from twin.parallel import counting, spread

Array = NDArray[np.float64]
LEADERS = 2  # that are refitted first, and tell what others must promise
Progress = Callable[[int, int], None]


def rank(
    base: Fit,
    dataset: Dataset,
    catalogue: Catalogue,
    progress: Progress | None = None,
) -> tuple[Fit, tuple[Candidate, ...]]:
    """The base, and every absent effect tried beside it, by falling merit.

    If the values of the best candidate without its effect are a better start for the base, the base
    is refitted from there: a base short of its optimum would give evidence to every candidate.
    """
    candidates = _tried(base, dataset, absent_effects(base.axis, catalogue), progress)
    give_back()
    supported = [c for c in candidates if c.supported]
    if supported:
        best = max(supported, key=lambda c: c.delta_bic)
        sure = _explained(base, best) > RULE.nearly_all  # wherever the base's optimum is
        again = base if sure else less(best.effect, best.fit, base, dataset)
        if again.error < RULE.settled * base.error:
            base = again
            candidates = [score(base, c.fit, dataset, c.effect) for c in candidates]
    return base, _ranked(candidates)


def _tried(
    base: Fit,
    dataset: Dataset,
    effects: Sequence[Effect],
    progress: Progress | None,
) -> list[Candidate]:
    """A candidate for each effect, in their order.

    All are looked at; those that promise most are refitted, then the others that promise a part of
    what these explain.
    """
    done: dict[str, Candidate] = {}
    one_more = counting(len(effects), progress)

    def keep(candidate: Candidate) -> None:
        done[candidate.effect.name] = candidate
        one_more()

    def looked(effect: Effect) -> Look:
        found = look_at(base, dataset, effect)
        if found.candidate is not None:
            keep(found.candidate)
        return found

    def refit(look: Look) -> None:
        keep(refitted(base, dataset, look))

    looks = spread(looked, effects)
    waiting = sorted((k for k in looks if k.candidate is None), key=_promise, reverse=True)
    least = RULE.contender * _promise(waiting[0]) if waiting else 0.0
    leaders = [k for k in waiting[:LEADERS] if _promise(k) >= least]
    spread(refit, leaders)
    most = max((_explained(base, done[k.effect.name]) for k in leaders), default=0.0)
    spread(
        refit,
        [k for k in waiting if k not in leaders and _promise(k) >= RULE.contender * most],
    )
    for look in looks:
        if look.effect.name not in done:
            keep(as_looked(base, dataset, look))
    return [done[e.name] for e in effects]


def _promise(look: Look) -> float:
    """Part of the base's squared error that a refit promises to explain; a friction's is open."""
    return 1.0 if look.share is None else look.share


def _explained(base: Fit, candidate: Candidate) -> float:
    """Part of the base's squared error that a candidate explains, 0..1; 0 without support."""
    if not candidate.supported:
        return 0.0
    return 1.0 - (candidate.fit.error / base.error) ** 2


def part_explained(base: Fit, final: Fit) -> float:
    """Part of the squared error above the noise floor that is explained."""
    was, left = base.error**2 - base.floor**2, final.error**2 - final.floor**2
    return 1.0 - left / was if was > 0.0 else 0.0


def less(effect: Effect, fit: Fit, base: Fit, dataset: Dataset) -> Fit:
    """The fit without an effect, refitted; a friction is replaced by that of the base.

    It counts as begun where the base was.
    """
    again = fit_axis(axis_less(effect, fit.axis, base.axis), dataset.fit)
    return replace(again, begun=base.begun)


def axis_less(effect: Effect, axis: AxisModel, base: AxisModel) -> AxisModel:
    """The axis without an effect; a friction is replaced by that of the base."""
    own = next((f for f in base.effects if f.effect.kind is Kind.FRICTION), None)
    if effect.kind is Kind.FRICTION and own:
        return axis.with_effect(own)
    return axis.without(effect.name)


def _ranked(candidates: Sequence[Candidate]) -> tuple[Candidate, ...]:
    """Supported first, and among these the effects that lower the error before noise.

    Noise that is as large as the error goes first where they leave less than it, and more than
    their own: its size is seen in the readings, so they lower what the model makes of it.
    """
    lowers = _ordered(on_equal_samples([c for c in candidates if not c.is_noise]))
    noise = _ordered([c for c in candidates if c.is_noise])
    helping = [c for c in lowers if c.supported]
    alone = [c for c in noise if c.supported and is_all_noise(c.fit) and _below(helping, c.fit)]
    rest = [c for c in (*lowers, *noise) if c not in alone]
    return (*alone, *sorted(rest, key=lambda c: not c.supported))


def _below(helping: Sequence[Candidate], noisy: Fit) -> bool:
    """Whether the best of these effects leaves less than a noise floor, but not noise alone.

    A friction without memory does not count beside one with it: it sees none of the noise that
    rounded readings make of that one's memory.
    """
    least = RULE.floor_sure[0] * noisy.floor
    seeing = [c for c in helping if sticks(noisy.axis) or not sticks(c.fit.axis)]
    return all(c.fit.error < least and not c.fit.at_floor for c in seeing[:1])


def is_all_noise(fit: Fit) -> bool:
    """Whether the error is as large as noise, within what an estimate of noise is sure of."""
    return RULE.floor_sure[0] < fit.ratio < RULE.floor_sure[1]


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
    """Whether the held-out error does not favour the best of two candidates.

    Evidence on the fit logs does not count: beside what is left of the force, or where one of the
    two smooths the noise of the reading, it separates what other logs do not.
    """
    if best.is_noise or other.is_noise:
        return False
    if best.effect.dead_time and other.effect.dead_time:
        return True
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
