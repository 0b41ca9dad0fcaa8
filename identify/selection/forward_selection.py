"""Forward selection with backward elimination: which physical effects a model lacks."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

from identify.dataset.dataset import Dataset
from identify.estimation.channel_delay import moved_by
from identify.estimation.decision import RULE
from identify.estimation.fit import Fit, finished, fit_axis
from identify.estimation.time_origin import synchronised
from identify.estimation.variable_projection import fit_thoroughly
from identify.selection.candidates import Candidate, score
from identify.selection.decoys import proof
from identify.selection.diagnosis import AxisDiagnosis, SelectionState, Step, Verdict, kept
from identify.selection.pair_search import held_at_floor, search_pairs
from identify.selection.ranking import Progress, less, rank, tie, took_friction
from identify.selection.reshaping import Reshaped, curve_in_place
from identify.selection.residual_dependence import explains, find_dependence
from identify.selection.unpredictable import is_unpredictable, with_own_noise
from twin.effect import Kind
from twin.effects import Catalogue


def diagnose_axis(
    base: Fit,
    dataset: Dataset,
    catalogue: Catalogue,
    progress: Progress | None = None,
    workers: int | None = None,
    shifts: int = RULE.most_shifts,
) -> AxisDiagnosis:
    """Add effects to one fitted axis while evidence supports them, and decide on the verdict.

    workers: threads; one a core where None. shifts: how often the diagnosis may still start again
    because an added effect changes the channel delay.
    """
    if any(log.force_noise for log in dataset.fit):  # an effect may explain it yet
        dataset = dataset.with_force_noise(0.0)
        base = finished(base.axis, base.begun, dataset.fit, base.outcome)
    ranked = partial(rank, catalogue=catalogue, progress=progress, workers=workers)
    base, ranking = ranked(base, dataset)
    steps: list[Step] = []
    states = [SelectionState((), base)]
    final, found = base, ranking
    curves: list[Reshaped] = []
    while len(steps) < RULE.most_steps:
        while curve := curve_in_place(final, dataset, found, base.axis.names):
            curves.append(curve)
            steps, final = _needed_beside(curves, steps, base, dataset)
            dataset, final = synchronised(final, dataset)  # what repeats in time shows only now
            final, found = ranked(final, dataset)
            states[-1] = SelectionState(tuple(steps), final)
        if not (more := _next(final, dataset, found, ranked)):
            break
        final, dropped = _eliminated_backwards(
            base, more[-1].candidate.fit, dataset, _earlier(steps, curves)
        )
        steps += [*more[:-1], replace(more[-1], dropped=dropped)]
        states.append(SelectionState(tuple(steps), final))
        if final.at_floor and RULE.floor_sure[0] < final.ratio < RULE.floor_sure[1]:
            break
        if shifts and (moved := moved_by(final, dataset)):
            again = fit_axis(base.axis, moved.fit)
            return diagnose_axis(again, moved, catalogue, progress, workers, shifts - 1)
        dataset, final = synchronised(final, dataset)
        final, found = ranked(final, dataset)
        states[-1] = replace(states[-1], fit=final)
    if not any(map(_foretells, found)):
        dataset, states = _with_own_noise(dataset, states)
    return _decided(dataset, ranking, states).beside(base, tuple(curves))


def _earlier(steps: Sequence[Step], curves: Sequence[Reshaped]) -> list[Candidate]:
    """The candidates that were added; not those of which a curve is the shape."""
    own = {c.shape.effect for c in curves}
    return [s.candidate for s in kept(steps) if s.candidate.effect.name not in own]


def _needed_beside(
    curves: Sequence[Reshaped], steps: Sequence[Step], base: Fit, dataset: Dataset
) -> tuple[list[Step], Fit]:
    """The steps without effects that had imitated what the last curve explains, and the fit."""
    earlier = _earlier(steps, curves)
    fit, dropped = _eliminated_backwards(base, curves[-1].fit, dataset, earlier)
    if not dropped:
        return list(steps), fit
    return [*steps[:-1], replace(steps[-1], dropped=(*steps[-1].dropped, *dropped))], fit


def _foretells(candidate: Candidate) -> bool:
    """Whether a candidate, though not supported, takes so much that what is left is no noise."""
    taken = 1.0 - (candidate.gain.after / candidate.gain.before) ** 2
    return candidate.delta_bic > RULE.least_bic and taken > RULE.least_share


def _with_own_noise(
    dataset: Dataset, states: list[SelectionState]
) -> tuple[Dataset, list[SelectionState]]:
    """Dataset and states with what is left at the end as noise, where nothing predicts it."""
    noisy, _ = with_own_noise(states[-1].fit, dataset)
    if noisy is dataset:
        return dataset, states
    fits = [finished(s.fit.axis, s.fit.begun, noisy.fit, s.fit.outcome) for s in states]
    return noisy, [replace(s, fit=f) for s, f in zip(states, fits, strict=True)]


def _next(
    base: Fit,
    dataset: Dataset,
    ranking: Sequence[Candidate],
    ranked: Callable[[Fit, Dataset], tuple[Fit, tuple[Candidate, ...]]],
) -> list[Step]:
    """The next steps: the best effect, a pair that is needed together, or none."""
    if ranking and _is_added(ranking[0], base):
        best = ranking[0]
        near = tuple(c for c in ranking[1:] if c.supported and _near(best, c))
        tied = tuple(c.effect.name for c in near if tie(dataset, best, c))
        return [Step(best, tied or _friction_instead(base, best, ranking), rivals=near)]
    if base.at_floor or held_at_floor(base, dataset):
        return []
    if not any(map(_foretells, ranking)) and is_unpredictable(base, dataset):
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


def _is_added(best: Candidate, base: Fit) -> bool:
    """Whether the best candidate is added; at the noise floor it needs far more evidence.

    The noise floor is an estimate, so an effect may be significant although the error is at it.
    """
    return best.supported and (not base.at_floor or best.delta_bic > RULE.beyond_doubt)


def _friction_instead(base: Fit, best: Candidate, ranking: Sequence[Candidate]) -> tuple[str, ...]:
    """A friction that also explains nearly all, if the best candidate removes the dry friction.

    A machine always has dry friction. If adding a hysteresis removes all of it, the hysteresis is
    probably friction with memory, so both are reported.
    """
    if not took_friction(base.axis, best.fit.axis):
        return ()
    frictions = (c for c in ranking if c.effect.kind is Kind.FRICTION and c.supported)
    return tuple(c.effect.name for c in frictions if _part(base, c.fit) > RULE.nearly_all)[:1]


def _near(best: Candidate, other: Candidate) -> bool:
    """Whether a candidate explains about as much as the best."""
    return other.evidence.log_gain > RULE.near * best.evidence.log_gain and not other.is_noise


def _compared_again(states: Sequence[SelectionState], dataset: Dataset) -> tuple[Step, ...]:
    """The steps, with ties decided beside all effects that were added.

    When an early effect was compared with its rivals, the later effects were still missing.
    """
    base, (steps, final) = states[0].fit, (states[-1].steps, states[-1].fit)
    still = kept(steps)
    if len(still) < 2:
        return steps
    named = {s.candidate.effect.name for s in still}

    def level(own: Candidate, rival: Candidate) -> bool:
        axis = final.axis.without(own.effect.name)
        fit = fit_axis(axis.with_effect(rival.fit.axis[rival.effect.name]), dataset.fit)
        return tie(dataset, own, score(base, fit, dataset, rival.effect))

    def compared(step: Step) -> Step:
        rivals = [r for r in step.rivals if r.effect.name not in named]
        if not rivals:
            return replace(step, tied=())
        own = score(base, final, dataset, step.candidate.effect)
        return replace(step, tied=tuple(r.effect.name for r in rivals if level(own, r)))

    return tuple(compared(s) if s in still and s.beside is None else s for s in steps)


def _eliminated_backwards(
    base: Fit, fit: Fit, dataset: Dataset, earlier: Sequence[Candidate]
) -> tuple[Fit, tuple[str, ...]]:
    """The fit without the earlier effects that are not needed any more, and their names."""
    dropped = []
    for candidate in earlier:
        if candidate.effect.name not in fit.axis.names:  # a friction that another one replaced
            dropped.append(candidate.effect.name)
            continue
        without = less(candidate.effect, fit, base, dataset)
        needed = score(without, fit, dataset, candidate.effect).supported
        if needed:
            # The shapes of later effects were found beside this one; they may differ without it.
            without = fit_thoroughly(without.axis, dataset)
            needed = score(without, fit, dataset, candidate.effect).supported
        if not needed:
            fit = without
            dropped.append(candidate.effect.name)
    return fit, tuple(dropped)


def _decided(
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
    """The steps with those marked that are sure or proved against decoys, and the fit with them.

    None where that proves none beyond the sure ones.
    """
    base, (steps, final) = states[0].fit, (states[-1].steps, states[-1].fit)
    names = [s.candidate.effect.name for s in kept(steps)]
    if not set(sure) < set(names):
        return None
    proved = set(sure)
    for step in kept(steps):
        effect = step.candidate.effect
        if effect.name in sure or effect.name not in final.axis.names:
            continue
        if step.candidate.is_noise:  # it has no force that a decoy could have; the readings show it
            proved.add(effect.name)
            continue
        beside = proof(less(effect, final, base, dataset), final.axis[effect.name], dataset)
        if beside is not None and beside.holds:
            proved.add(effect.name)
    if proved == set(sure):
        return None
    axis = final.axis
    for name in set(names) - proved:
        axis = axis.without(name) if name in axis.names else axis
    fit = final if axis is final.axis else fit_axis(axis, dataset.fit)
    named = (replace(s, proved=s.candidate.effect.name in proved) for s in steps)
    return tuple(named), fit


def _convincing(before: SelectionState, after: SelectionState, dataset: Dataset) -> bool:
    """Whether effects reach the noise floor, explain nearly all, or remove the foremost dependence.

    A wrong effect that imitates the missing one does not remove the foremost dependence.
    """
    added = after.steps[len(before.steps) :]
    return (
        after.fit.at_floor
        or held_at_floor(after.fit, dataset)
        or _part(before.fit, after.fit) > RULE.nearly_all
        or _gone(before.fit, after.fit, added, dataset)
    )


def _part(base: Fit, final: Fit) -> float:
    """Part of the squared error above the noise floor that is explained."""
    was, left = base.error**2 - base.floor**2, final.error**2 - final.floor**2
    return 1.0 - left / was if was > 0.0 else 0.0


def _gone(base: Fit, final: Fit, steps: Sequence[Step], dataset: Dataset) -> bool:
    """Whether effects with much evidence removed the dependence of the residual."""
    proven = all(s.candidate.delta_bic > RULE.partial_bic for s in steps[:1])
    return proven and _part(base, final) > RULE.least_part and explains(base, final, dataset)
