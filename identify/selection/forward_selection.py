"""Which physical effect is missing: every absent effect is added in turn, refitted and judged."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property, partial

from identify.dataset.dataset import Dataset
from identify.estimation.channel_delay import moved_by
from identify.estimation.decision import RULE
from identify.estimation.fit import Fit, fit_axis
from identify.estimation.time_origin import synchronised
from identify.estimation.variable_projection import fit_thoroughly
from identify.selection.candidates import Candidate, score
from identify.selection.pair_search import held_at_floor, search_pairs
from identify.selection.ranking import Progress, less, rank, tie, took_friction
from identify.selection.repeating_force import Repeat, not_general
from identify.selection.residual_dependence import Dependence, explains, find_dependence
from twin.effect import Kind
from twin.effects import Catalogue


class Verdict(Enum):
    """The answer of a diagnosis."""

    MISSING_EFFECT = "missing effect"
    NOTHING_MISSING = "nothing missing"
    AMBIGUOUS = "ambiguous"
    UNEXPLAINED = "unexplained"


@dataclass(frozen=True, eq=False)
class Step:
    """One effect that was added in turn, and the earlier ones it made needless.

    tied: effects that explain as well. beside: the effect without which it has no evidence.
    rivals: candidates that explained about as much when it was added.
    """

    candidate: Candidate
    tied: tuple[str, ...]
    dropped: tuple[str, ...] = ()
    beside: str | None = None
    rivals: tuple[Candidate, ...] = ()


@dataclass(frozen=True, eq=False)
class Stage:
    """All steps up to some moment, and the fit that they led to."""

    steps: tuple[Step, ...]
    fit: Fit


@dataclass(frozen=True, eq=False, repr=False)
class AxisDiagnosis:
    """Diagnosis of one axis.

    base: the fitted model. ranking: candidates beside it, by falling evidence. steps: the effects
    added in turn until evidence stopped. final: the fit with all that were kept. unexplained: what
    the residual depends on where structure is left.
    """

    dataset: Dataset
    base: Fit
    ranking: tuple[Candidate, ...]
    steps: tuple[Step, ...]
    final: Fit
    verdict: Verdict
    unexplained: Dependence | None

    def __repr__(self) -> str:
        told = f"{self.verdict.name.lower()} {list(self.answers)}"
        return f"<AxisDiagnosis of {self.dataset.axis}: {told}>"

    @cached_property
    def repeat(self) -> Repeat | None:
        """A force that repeats along the track in each log, but at other places in each."""
        return None if self.final.at_floor else not_general(self.final, self.dataset)

    @property
    def named(self) -> tuple[str, ...]:
        """Names of the effects that are missing, in the order they were found."""
        return tuple(answer[0] for answer in self.answers)

    @property
    def answers(self) -> tuple[tuple[str, ...], ...]:
        """Each effect that is missing, and after it those that explain as well."""
        if self.verdict not in (Verdict.MISSING_EFFECT, Verdict.AMBIGUOUS):
            return ()
        return tuple((s.candidate.effect.name, *s.tied) for s in _kept(self.steps))

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
    dataset: Dataset,
    catalogue: Catalogue,
    progress: Progress | None = None,
    workers: int | None = None,
    shifts: int = RULE.most_shifts,
) -> AxisDiagnosis:
    """Add effects to one fitted axis for as long as evidence asks for them, and decide.

    workers: threads; one a core where None. shifts: how often the force channel may still be moved
    and all begun anew, where an effect that was found shows when the force acted.
    """
    ranked = partial(rank, catalogue=catalogue, progress=progress, workers=workers)
    base, ranking = ranked(base, dataset)
    steps: list[Step] = []
    stages = [Stage((), base)]
    final, found = base, ranking
    while len(steps) < RULE.most_steps and (more := _next(final, dataset, found, ranked)):
        earlier = [s.candidate for s in _kept(steps)]
        final, dropped = _eliminated_backwards(base, more[-1].candidate.fit, dataset, earlier)
        steps += [*more[:-1], replace(more[-1], dropped=dropped)]
        stages.append(Stage(tuple(steps), final))
        if final.at_floor and RULE.floor_sure[0] < final.ratio < RULE.floor_sure[1]:
            break
        if shifts and (moved := moved_by(final, dataset)):
            again = fit_axis(base.axis, moved.fit)
            return diagnose_axis(again, moved, catalogue, progress, workers, shifts - 1)
        dataset, final = synchronised(final, dataset)
        final, found = ranked(final, dataset)
        stages[-1] = replace(stages[-1], fit=final)
    return _decided(dataset, ranking, stages)


def _next(
    base: Fit,
    dataset: Dataset,
    ranking: Sequence[Candidate],
    ranked: Callable[[Fit, Dataset], tuple[Fit, tuple[Candidate, ...]]],
) -> list[Step]:
    """What is to be added: the best effect, two that need each other, or nothing."""
    if ranking and _asked_for(ranking[0], base):
        best = ranking[0]
        near = tuple(c for c in ranking[1:] if c.supported and _near(best, c))
        tied = tuple(c.effect.name for c in near if tie(dataset, best, c))
        return [Step(best, tied or _friction_instead(base, best, ranking), rivals=near)]
    if base.at_floor or held_at_floor(base, dataset):
        return []
    pairs = search_pairs(base, dataset, ranking, ranked)
    if not pairs:
        return []
    pair = pairs[0]
    level = [p for p in pairs[1:] if tie(dataset, pair.together, p.together)]
    alike = sorted({name for p in level for name in p.names} - pair.names)
    first, second = pair.first, pair.second
    return [
        Step(first, tuple(alike), beside=second.effect.name),
        Step(second, (), beside=first.effect.name),
    ]


def _asked_for(best: Candidate, base: Fit) -> bool:
    """Whether the best candidate is to be added; at the noise floor only by much evidence.

    The floor is an estimate, so an error at it may still hold an effect that shows beyond doubt.
    """
    return best.supported and (not base.at_floor or best.delta_bic > RULE.beyond_doubt)


def _friction_instead(base: Fit, best: Candidate, ranking: Sequence[Candidate]) -> tuple[str, ...]:
    """A friction that explains nearly all as well, where the best took over the dry friction.

    No machine is without; a hysteresis that leaves none may as well be friction with a memory.
    """
    if not took_friction(base.axis, best.fit.axis):
        return ()
    frictions = (c for c in ranking if c.effect.kind is Kind.FRICTION and c.supported)
    return tuple(c.effect.name for c in frictions if _part(base, c.fit) > RULE.nearly_all)[:1]


def _near(best: Candidate, other: Candidate) -> bool:
    """Whether a candidate explains about as much as the best."""
    return other.evidence.log_gain > RULE.near * best.evidence.log_gain and not other.is_noise


def _compared_again(stages: Sequence[Stage], dataset: Dataset) -> tuple[Step, ...]:
    """The steps with those tied that explain as well beside all the effects that were added.

    When a first effect was compared, what the others explain was still in the way.
    """
    base, (steps, final) = stages[0].fit, (stages[-1].steps, stages[-1].fit)
    kept = _kept(steps)
    if len(kept) < 2:
        return steps
    named = {s.candidate.effect.name for s in kept}

    def level(own: Candidate, rival: Candidate) -> bool:
        axis = final.axis.without(own.effect.name)
        fit = fit_axis(axis.with_effect(rival.fit.axis[rival.effect.name]), dataset.fit)
        return tie(dataset, own, score(base, fit, dataset, rival.effect))

    def told(step: Step) -> Step:
        rivals = [r for r in step.rivals if r.effect.name not in named]
        if not rivals:
            return replace(step, tied=())
        own = score(base, final, dataset, step.candidate.effect)
        return replace(step, tied=tuple(r.effect.name for r in rivals if level(own, r)))

    return tuple(told(s) if s in kept and s.beside is None else s for s in steps)


def _eliminated_backwards(
    base: Fit, fit: Fit, dataset: Dataset, earlier: Sequence[Candidate]
) -> tuple[Fit, tuple[str, ...]]:
    """The fit less the earlier effects that it does not need any more, and their names."""
    dropped = []
    for candidate in earlier:
        if candidate.effect.name not in fit.axis.names:  # a friction that another one replaced
            dropped.append(candidate.effect.name)
            continue
        without = less(candidate.effect, fit, base, dataset)
        needed = score(without, fit, dataset, candidate.effect).supported
        if needed:
            # The later effects' shapes were found beside it, and may have to be found anew.
            without = fit_thoroughly(without.axis, dataset)
            needed = score(without, fit, dataset, candidate.effect).supported
        if not needed:
            fit = without
            dropped.append(candidate.effect.name)
    return fit, tuple(dropped)


def _decided(
    dataset: Dataset, ranking: tuple[Candidate, ...], stages: Sequence[Stage]
) -> AxisDiagnosis:
    """The verdict on what was added, as far as each stage explained what was left before it."""
    base = stages[0].fit
    told = list(stages)
    while len(told) > 1 and not _convincing(told[-2], told[-1], dataset):
        told.pop()
    steps, final = _compared_again(told, dataset), told[-1].fit
    if len(told) > 1 and _convincing(stages[0], told[-1], dataset):
        verdict = Verdict.AMBIGUOUS if _kept(steps)[0].tied else Verdict.MISSING_EFFECT
        done = final.at_floor or held_at_floor(final, dataset)
        structure = None if done else find_dependence(final, dataset)
    elif len(stages) == 1 and base.at_floor:
        verdict, structure = Verdict.NOTHING_MISSING, None
    else:
        steps, final = stages[-1].steps, stages[-1].fit
        verdict, structure = Verdict.UNEXPLAINED, find_dependence(base, dataset)
    return AxisDiagnosis(dataset, base, ranking, steps, final, verdict, structure)


def _convincing(before: Stage, after: Stage, dataset: Dataset) -> bool:
    """Whether effects bring the error to the floor, or explain nearly all or the foremost of it.

    What stands in for another effect leaves behind what the residual depended on most.
    """
    added = after.steps[len(before.steps) :]
    return (
        after.fit.at_floor
        or held_at_floor(after.fit, dataset)
        or _part(before.fit, after.fit) > RULE.nearly_all
        or _gone(before.fit, after.fit, added, dataset)
    )


def _part(base: Fit, final: Fit) -> float:
    """Part of the squared error above the floor that is explained."""
    was, left = base.error**2 - base.floor**2, final.error**2 - final.floor**2
    return 1.0 - left / was if was > 0.0 else 0.0


def _gone(base: Fit, final: Fit, steps: Sequence[Step], dataset: Dataset) -> bool:
    """Whether effects with much evidence took away what the residual depended on most."""
    proven = all(s.candidate.delta_bic > RULE.partial_bic for s in steps[:1])
    return proven and _part(base, final) > RULE.least_part and explains(base, final, dataset)
