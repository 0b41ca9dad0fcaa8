"""Which physical effect is missing: every absent effect is added in turn, refitted and judged."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from enum import Enum
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from identify.alignment import misalignment, realigned
from identify.candidates import Candidate, absent_effects, levelled, score, try_effect
from identify.evidence import held_out_gain
from identify.fit import AT_FLOOR, Fit, error_on, fit_axis, rms, sticks
from identify.repeats import Repeat, not_general
from identify.residual import moving, residual
from identify.structure import Structure, explains, find_structure
from identify.study import Study
from twin.effect import Effect, Kind
from twin.effects import Catalogue

Array = NDArray[np.float64]
Progress = Callable[[int, int], None]

MOST_STEPS = 5  # effects added to one axis at most
SETTLED = 0.999  # part of the error to which another start of the base must bring it
NEARLY_ALL = 0.95  # part of the squared error above the floor that speaks for itself
FLOOR_SURE = (0.85, 1.15)  # error over noise floor where both agree, and nothing more is sought
BEYOND_DOUBT = 100.0  # evidence asked of an effect where the error is at its floor already
PARTIAL_BIC = 50.0  # evidence asked of an effect that leaves other structure behind
LEAST_PART = 0.4  # part that must be explained where a dependence is gone
TIE = 2.0  # |t| of the held-out difference below which two explanations cannot be told apart


class Verdict(Enum):
    """The answer of a diagnosis, as a sentence."""

    MISSING_EFFECT = "One effect explains what the model lacks, on the fit logs and held out."
    NOTHING_MISSING = "Nothing is missing: the force error is at its noise floor."
    AMBIGUOUS = "Several effects explain the error equally well; this data cannot tell them apart."
    UNEXPLAINED = (
        "The error stands above the noise floor, and no effect of the catalogue explains it."
    )


@dataclass(frozen=True, eq=False)
class Step:
    """One effect that was added in turn, and the earlier ones it made needless."""

    candidate: Candidate
    tied: tuple[str, ...]
    dropped: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class AxisDiagnosis:
    """Diagnosis of one axis.

    base: the fitted model. ranking: candidates beside it, by falling evidence. steps: the effects
    added in turn until evidence stopped. final: the fit with all that were kept. unexplained: what
    the residual depends on where structure is left.
    """

    study: Study
    base: Fit
    ranking: tuple[Candidate, ...]
    steps: tuple[Step, ...]
    final: Fit
    verdict: Verdict
    unexplained: Structure | None

    @cached_property
    def repeat(self) -> Repeat | None:
        """A force that repeats along the track in each log, but at other places in each."""
        return None if self.final.at_floor else not_general(self.final, self.study)

    @property
    def named(self) -> tuple[str, ...]:
        """Names of the effects that are missing, in the order they were found."""
        if self.verdict not in (Verdict.MISSING_EFFECT, Verdict.AMBIGUOUS):
            return ()
        return tuple(s.candidate.effect.name for s in _kept(self.steps))

    @property
    def best(self) -> Candidate | None:
        """The candidate that is named first, where one is."""
        return _kept(self.steps)[0].candidate if self.named else None

    @property
    def ambiguous_with(self) -> tuple[str, ...]:
        """Effects that explain as well as the one named first."""
        return _kept(self.steps)[0].tied if self.named else ()


def _kept(steps: Sequence[Step]) -> list[Step]:
    dropped = {name for s in steps for name in s.dropped}
    return [s for s in steps if s.candidate.effect.name not in dropped]


def diagnose_axis(
    base: Fit,
    study: Study,
    catalogue: Catalogue,
    progress: Progress | None = None,
    workers: int | None = None,
) -> AxisDiagnosis:
    """Add effects to one fitted axis for as long as evidence asks for them, and decide.

    workers: threads; one a core where None.
    """
    base, ranking = rank(base, study, catalogue, progress, workers)
    steps: list[Step] = []
    final, found = base, ranking
    while found and _asked_for(found[0], final) and len(steps) < MOST_STEPS:
        best = found[0]
        tied = tuple(c.effect.name for c in found[1:] if c.supported and _tie(study, best, c))
        final, dropped = _looked_back(base, best.fit, study, [s.candidate for s in _kept(steps)])
        steps.append(Step(best, tied, dropped))
        if final.at_floor and FLOOR_SURE[0] < final.ratio < FLOOR_SURE[1]:
            break
        if ahead := misalignment(final, study):  # seen only now that more is explained
            moved = realigned(study, study.shift + ahead)
            again = fit_axis(base.axis, moved.fit)
            return diagnose_axis(again, moved, catalogue, progress, workers)
        final, found = rank(final, study, catalogue, progress, workers)
    return _decided(base, study, ranking, tuple(steps), final)


def _asked_for(best: Candidate, base: Fit) -> bool:
    """Whether the best candidate is to be added; at the noise floor only by much evidence.

    The floor is an estimate, so an error at it may still hold an effect that shows beyond doubt.
    """
    return best.supported and (not base.at_floor or best.delta_bic > BEYOND_DOUBT)


def rank(
    base: Fit,
    study: Study,
    catalogue: Catalogue,
    progress: Progress | None = None,
    workers: int | None = None,
) -> tuple[Fit, tuple[Candidate, ...]]:
    """Every absent effect tried beside a fitted axis: the base and candidates by falling merit.

    The base comes back refitted where a candidate's values, without its effect, suit it better: a
    base short of its optimum would make evidence for every candidate.
    """
    effects = absent_effects(base.axis, catalogue)
    candidates = []
    # The laws run outside Python's lock, so candidates go side by side.
    with ThreadPoolExecutor(workers or os.cpu_count()) as pool:
        for candidate in pool.map(partial(try_effect, base, study), effects):
            candidates.append(candidate)
            if progress:
                progress(len(candidates), len(effects))
    supported = [c for c in candidates if c.supported]
    if supported:
        best = max(supported, key=lambda c: c.delta_bic)
        again = _less(best.effect, best.fit, base, study)
        if again.error < SETTLED * base.error:
            base = again
            candidates = [score(base, c.fit, study, c.effect) for c in candidates]
    return base, _ranked(levelled(candidates))


def _less(effect: Effect, fit: Fit, base: Fit, study: Study) -> Fit:
    """The fit refitted without an effect, the friction that it replaced put back."""
    if effect.kind is Kind.FRICTION:
        own = next((f for f in base.axis.effects if f.effect.kind is Kind.FRICTION), None)
        axis = fit.axis.with_effect(own) if own else fit.axis.without(effect.name)
    else:
        axis = fit.axis.without(effect.name)
    return fit_axis(axis, study.fit)


def _looked_back(
    base: Fit, fit: Fit, study: Study, earlier: Sequence[Candidate]
) -> tuple[Fit, tuple[str, ...]]:
    """The fit less the earlier effects that it does not need any more, and their names."""
    dropped = []
    for candidate in earlier:
        without = _less(candidate.effect, fit, base, study)
        if not score(without, fit, study, candidate.effect).supported:
            fit = without
            dropped.append(candidate.effect.name)
    return fit, tuple(dropped)


def _ranked(candidates: list[Candidate]) -> tuple[Candidate, ...]:
    """By falling merit; those within no evidence of the best come in the catalogue's order."""
    ranking = sorted(candidates, key=_merit)
    if not ranking or not ranking[0].supported:
        return tuple(ranking)
    best = ranking[0].evidence
    level = [c for c in ranking if c.supported and best.over(c.evidence) < NO_EVIDENCE]
    rest = [c for c in ranking if c not in level]
    return (*sorted(level, key=lambda c: c.effect.name), *rest)


def _merit(c: Candidate) -> tuple[bool, float]:
    """Supported first, then by evidence."""
    return (not c.supported, -c.delta_bic)


def _decided(
    base: Fit, study: Study, ranking: tuple[Candidate, ...], steps: tuple[Step, ...], final: Fit
) -> AxisDiagnosis:
    """The verdict on what was added.

    A name is given where the effects bring the error to the floor, explain nearly all above it, or
    leave nothing of what the residual depended on most. What stands in for another effect leaves
    that dependence behind.
    """
    structure = None
    if final.at_floor or (steps and _held_at_floor(final, study)):
        tied = bool(steps) and _kept(steps)[0].tied
        verdict = Verdict.AMBIGUOUS if tied else Verdict.MISSING_EFFECT
        if not steps:
            verdict = Verdict.NOTHING_MISSING
    elif steps and (_part(base, final) > NEARLY_ALL or _gone(base, final, steps, study)):
        verdict = Verdict.AMBIGUOUS if _kept(steps)[0].tied else Verdict.MISSING_EFFECT
        structure = find_structure(final, study)
    else:
        verdict = Verdict.UNEXPLAINED
        structure = find_structure(base, study)
    return AxisDiagnosis(study, base, ranking, steps, final, verdict, structure)


def _held_at_floor(final: Fit, study: Study) -> bool:
    """Whether the logs that the fit did not see are explained down to noise."""
    return bool(study.holdout) and rms(error_on(final.axis, study.holdout)) < AT_FLOOR * final.floor


def _part(base: Fit, final: Fit) -> float:
    """Part of the squared error above the floor that is explained."""
    was, left = base.error**2 - base.floor**2, final.error**2 - final.floor**2
    return 1.0 - left / was if was > 0.0 else 0.0


def _gone(base: Fit, final: Fit, steps: Sequence[Step], study: Study) -> bool:
    """Whether effects with much evidence took away what the residual depended on most."""
    proven = all(s.candidate.delta_bic > PARTIAL_BIC for s in steps[:1])
    return proven and _part(base, final) > LEAST_PART and explains(base, final, study)


def _tie(study: Study, best: Candidate, other: Candidate) -> bool:
    """Whether the evidence and the held-out error both fail to separate two candidates."""
    if best.evidence.over(other.evidence) > LEAST_SEPARATION:
        return False
    logs = study.holdout or study.fit
    either = sticks(best.fit.axis) or sticks(other.fit.axis)
    kept = moving(logs, either)
    pair = [residual(c.fit.axis, logs)[kept] for c in (other, best)]
    return abs(held_out_gain(pair[0], pair[1], best.fit.floor).t) < TIE


NO_EVIDENCE = 2.0  # difference of BIC "not worth more than a bare mention" (Kass, Raftery 1995)
LEAST_SEPARATION = 10.0  # difference of BIC that separates two explanations
