"""The verdict on the effects that a selection added: which of them are named, and beside what."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identify.dataset.dataset import Dataset
from identify.dataset.drive import is_noise
from identify.estimation.decision import RULE
from identify.estimation.errors import Errors, gain_held_out
from identify.estimation.fit import Fit, fit_axis
from identify.selection.decoys import proof
from identify.selection.diagnosis import AxisDiagnosis, SelectionState, Step, Verdict, kept
from identify.selection.findings import share_explained
from identify.selection.pair_search import held_at_floor
from identify.selection.ranking import axis_less, less, part_explained, tie
from identify.selection.residual_dependence import explains, find_dependence
from identify.selection.scoring import Candidate, score
from twin.effect import Effect


def decided(
    dataset: Dataset, ranking: tuple[Candidate, ...], states: Sequence[SelectionState]
) -> AxisDiagnosis:
    """The verdict on the added effects, up to the last one that explained enough.

    Beyond it, and where none explains enough, those are named that are proved against decoys.
    """
    base = states[0].fit
    explained = list(states)
    while len(explained) > 1 and not _convincing(explained[-2], explained[-1], dataset):
        explained.pop()
    steps, final = _compared_again(explained, dataset), explained[-1].fit
    enough = len(explained) > 1 and _convincing(states[0], explained[-1], dataset)
    if not (enough and final.at_floor) and len(states) > 1:
        sure = kept(steps) if enough else []
        graded = _graded(states, [s.candidate.effect.name for s in sure], dataset)
        if graded is not None:
            steps, final, enough = *graded, True
    if enough:
        steps, final = _without_small(steps, final, base, dataset)
        verdict = Verdict.MISSING_EFFECTS
        done = final.at_floor or held_at_floor(final, dataset)
        dependence = None if done else find_dependence(final, dataset)
    elif len(states) == 1 and base.at_floor:
        verdict, dependence = Verdict.NOTHING_MISSING, None
    else:
        steps, final = states[-1].steps, states[-1].fit
        verdict, dependence = Verdict.UNEXPLAINED, find_dependence(base, dataset)
    return AxisDiagnosis(dataset, base, ranking, steps, final, verdict, dependence)


def _graded(
    states: Sequence[SelectionState], sure: Sequence[str], dataset: Dataset
) -> tuple[tuple[Step, ...], Fit] | None:
    """The steps with those marked that are sure or proved, and the fit with them.

    None where that proves none beyond the sure ones.
    """
    base, (steps, final) = states[0].fit, (states[-1].steps, states[-1].fit)
    there = [s.candidate.effect for s in kept(steps) if s.candidate.effect.name in final.axis.names]
    if not {*sure} <= {e.name for e in there}:  # a later step made one of them needless
        return None
    unsure = [e for e in there if e.name not in sure]
    left_out = [e for e in unsure if not _is_proved(e, final, base, dataset)]
    if len(left_out) == len(unsure):
        return None
    fit = final
    for effect in left_out:
        fit = less(effect, fit, base, dataset)
    names = {*sure} | {e.name for e in unsure if e not in left_out}
    named = (replace(s, proved=s.candidate.effect.name in names) for s in steps)
    return tuple(named), fit


def _without_small(
    steps: tuple[Step, ...], final: Fit, base: Fit, dataset: Dataset
) -> tuple[tuple[Step, ...], Fit]:
    """The steps and the fit without those that explain next to nothing beside the others.

    What a large effect's law leaves of it may be significant, and any other law may take a part of
    it; one that takes nearly all of it is no chance.
    """

    named = [s for s in kept(steps) if s.proved and s.candidate.effect.name in final.axis.names]
    named = [s for s in named if not s.candidate.is_noise]
    if len(named) < 2:
        return steps, final
    without = [less(s.candidate.effect, final, base, dataset) for s in named]
    falls = [Errors.of(fit, final, dataset, dataset.chosen_on) for fit in without]
    shares = [
        np.inf if _takes_the_rest(fall, final) else share_explained(fall, base, dataset)
        for fall in falls
    ]
    least = int(np.argmin(shares))
    if shares[least] >= RULE.least_finding:
        return steps, final
    rest = tuple(replace(s, proved=False) if s is named[least] else s for s in steps)
    return _without_small(rest, without[least], base, dataset)


def _takes_the_rest(fall: Errors, final: Fit) -> bool:
    """Whether an effect takes nearly all that the others leave above the noise floor."""
    above, left = (error**2 - final.floor**2 for error in (fall.before, fall.after))
    return above - left > RULE.nearly_all * above > 0.0


def _is_proved(effect: Effect, final: Fit, base: Fit, dataset: Dataset) -> bool:
    """Whether an effect leaves clearly less of the held-out logs than the fit without it.

    Less than its decoys, where a shift in time makes one; and where that fit is at the floor, with
    far more evidence. Noise has no force; the readings themselves show it.
    """
    if is_noise(effect):
        return True
    without = less(effect, final, base, dataset)
    if without.may_be_noise and _is_doubtful(score(without, final, dataset, effect)):
        return False
    refit = gain_held_out(without, final, dataset)
    beside = proof(without, final.axis[effect.name], dataset, refit)
    chosen = Errors.of(without, final, dataset, dataset.chosen_on)
    if beside is not None:
        return beside.holds and chosen.after < chosen.before
    return chosen.after**2 < RULE.beside_decoys * chosen.before**2


def _convincing(before: SelectionState, after: SelectionState, dataset: Dataset) -> bool:
    """Whether effects reach the noise floor, explain nearly all, or remove the foremost dependence.

    A wrong effect that imitates the missing one does not remove the foremost dependence. Where the
    fit before is at the floor already, as the floor is known at the end, they need far more
    evidence than they were added with: what is noise had seemed to be left for them.
    """
    added = after.steps[len(before.steps) :]
    if before.fit.may_be_noise and all(_is_doubtful(s.candidate) for s in added):
        return False
    return (
        after.fit.at_floor
        or held_at_floor(after.fit, dataset)
        or part_explained(before.fit, after.fit) > RULE.nearly_all
        or _gone(before.fit, after.fit, added, dataset)
    )


def _is_doubtful(candidate: Candidate) -> bool:
    """Whether an effect may be noise that is left; noise itself has no force to doubt."""
    return not (candidate.is_noise or candidate.is_beyond_doubt)


def _gone(base: Fit, final: Fit, steps: Sequence[Step], dataset: Dataset) -> bool:
    """Whether effects with much evidence removed the dependence of the residual."""
    proven = all(s.candidate.delta_bic > RULE.partial_bic for s in steps[:1])
    return (
        proven and part_explained(base, final) > RULE.least_part and explains(base, final, dataset)
    )


def _compared_again(states: Sequence[SelectionState], dataset: Dataset) -> tuple[Step, ...]:
    """The steps, with ties decided beside all effects and free curves that were added.

    When an early effect was compared with its rivals, the later ones were still missing.
    """
    base, (steps, final) = states[0].fit, (states[-1].steps, states[-1].fit)
    still = kept(steps)
    if len(still) < 2 and not any(f.effect.free_shape for f in final.axis.effects):
        return steps
    named = {s.candidate.effect.name for s in still}

    def level(own: Candidate, rival: Candidate) -> bool:
        axis = axis_less(own.effect, final.axis, base.axis)
        fit = fit_axis(axis.with_effect(rival.fit.axis[rival.effect.name]), dataset.fit)
        return tie(dataset, own, score(base, fit, dataset, rival.effect))

    def compared(step: Step) -> Step:
        rivals = [r for r in step.rivals if r.effect.name not in named]
        with_pair = step.tied if step.beside else ()
        if not rivals:
            return replace(step, tied=with_pair)
        own = score(base, final, dataset, step.candidate.effect)
        tied = (r.effect.name for r in rivals if level(own, r))
        return replace(step, tied=tuple(dict.fromkeys((*with_pair, *tied))))

    return tuple(compared(s) if s in still else s for s in steps)
