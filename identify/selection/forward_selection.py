"""Forward selection with backward elimination: which physical effects a model lacks."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import partial

from identify.dataset.dataset import Dataset
from identify.estimation.channel_delay import moved_by
from identify.estimation.decision import RULE
from identify.estimation.fit import Fit, finished, fit_axis
from identify.estimation.scaling import Scaling
from identify.estimation.thorough_fit import fit_thoroughly
from identify.estimation.time_origin import synchronised
from identify.selection.bends import straightened
from identify.selection.diagnosis import AxisDiagnosis, SelectionState, Step, kept
from identify.selection.pair_search import held_at_floor, search_pairs
from identify.selection.ranking import (
    Progress,
    is_all_noise,
    less,
    part_explained,
    rank,
    tie,
    took_friction,
)
from identify.selection.reshaping import Reshaped, bent_in_place, curve_in_place
from identify.selection.scoring import Candidate, score
from identify.selection.unpredictable import is_unpredictable, with_own_noise
from identify.selection.verdict import decided
from twin.effect import Effect, Kind
from twin.effects import MOST_OF_ONE, Catalogue
from twin.model.machine import AxisModel
from twin.model.parameters import free_parameters


def diagnose_axis(
    base: Fit,
    dataset: Dataset,
    catalogue: Catalogue,
    progress: Progress | None = None,
    shifts: int = RULE.most_shifts,
) -> AxisDiagnosis:
    """Add effects to one fitted axis while evidence supports them, and decide on the verdict.

    shifts: how often the diagnosis may still start again because an added effect changes the
    channel delay.
    """
    if any(log.force_noise for log in dataset.fit):  # an effect may explain it yet
        dataset = dataset.with_force_noise(0.0)
        base = finished(base.axis, base.begun, dataset.fit, base.outcome)
    ranked = partial(rank, catalogue=catalogue, progress=progress)
    base, ranking = ranked(base, dataset)
    steps: list[Step] = []
    states = [SelectionState((), base)]
    final, found = base, ranking
    curves: list[Reshaped] = []
    while len(steps) < RULE.most_steps:
        if as_bent := bent_in_place(final, dataset, found, base.axis.names):
            final, found = ranked(as_bent, dataset)
            states[-1] = replace(states[-1], fit=final)
            continue
        if curve := curve_in_place(final, dataset, found, base.axis.names):
            curves.append(curve)
            steps, final = _needed_beside(curves, steps, base, dataset)
            dataset, final = synchronised(final, dataset)  # what repeats in time shows only now
            final, found = ranked(final, dataset)
            states[-1] = SelectionState(tuple(steps), final)
            continue
        if not (more := _next(final, dataset, found, ranked)):
            break
        final, dropped = _eliminated_backwards(
            base, more[-1].candidate.fit, dataset, _earlier(steps, curves)
        )
        steps += [*more[:-1], replace(more[-1], dropped=dropped)]
        states.append(SelectionState(tuple(steps), final))
        if is_all_noise(final):
            final = bent_in_place(final, dataset, (), base.axis.names) or final
            states[-1] = replace(states[-1], fit=final)
            break
        if shifts and (moved := moved_by(final, dataset)):
            again = fit_axis(base.axis, moved.fit)
            return diagnose_axis(again, moved, catalogue, progress, shifts - 1)
        dataset, final = synchronised(final, dataset)
        final, found = ranked(final, dataset)
        states[-1] = replace(states[-1], fit=final)
    if not any(map(_foretells, found)):
        dataset, states = _with_own_noise(dataset, states)
    return decided(dataset, ranking, states).beside(base, tuple(curves))


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
    taken = 1.0 - candidate.gain.left
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
    if ranking and ranking[0].is_added_to(base):
        best = ranking[0]
        near = tuple(c for c in _near(best, ranking) if c.supported)
        tied = tuple(c.effect.name for c in near if tie(dataset, best, c))
        instead = () if tied else _friction_instead(base, best, ranking)
        tied = tied or tuple(c.effect.name for c in instead)
        rivals = dict.fromkeys((*near, *instead, *_sisters(best, ranking)))
        return [Step(best, tied, rivals=tuple(rivals))]
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
    alone = next(c for c in ranking if c.effect.name == first.effect.name)
    return [
        Step(first, tuple(alike), beside=second.effect.name, rivals=_near(alone, ranking)),
        Step(second, (), beside=first.effect.name, rivals=_near(second, pair.seconds)),
    ]


def _friction_instead(
    base: Fit, best: Candidate, ranking: Sequence[Candidate]
) -> tuple[Candidate, ...]:
    """A friction that also explains nearly all, if the best candidate removes the dry friction.

    A machine always has dry friction. If adding a hysteresis removes all of it, the hysteresis is
    probably friction with memory, so both are reported.
    """
    if not took_friction(base.axis, best.fit.axis):
        return ()
    enough = (c for c in _frictions(ranking) if part_explained(base, c.fit) > RULE.nearly_all)
    return tuple(enough)[:1]


def _sisters(best: Candidate, ranking: Sequence[Candidate]) -> Iterable[Candidate]:
    """The other supported frictions, of a friction: effects still absent may part them wrongly."""
    if best.effect.kind is not Kind.FRICTION:
        return ()
    return (c for c in _frictions(ranking) if c is not best)


def _frictions(ranking: Sequence[Candidate]) -> Iterable[Candidate]:
    """The frictions that are supported."""
    return (c for c in ranking if c.effect.kind is Kind.FRICTION and c.supported)


def _near(best: Candidate, ranking: Sequence[Candidate]) -> tuple[Candidate, ...]:
    """The other candidates that explain about as much as the best; dead times are all alike."""
    least = RULE.near * best.evidence.log_gain
    others = [c for c in ranking if c.effect.name != best.effect.name and not c.is_noise]
    late = best.effect.dead_time
    return tuple(c for c in others if c.evidence.log_gain > least or (late and c.effect.dead_time))


def _eliminated_backwards(
    base: Fit, fit: Fit, dataset: Dataset, earlier: Sequence[Candidate]
) -> tuple[Fit, tuple[str, ...]]:
    """The fit without the earlier effects that are not needed any more, and their names.

    Nor is a bend of a law that another effect had asked for. Where a first of several is not, the
    second takes its place.
    """
    dropped = []
    for candidate in earlier:
        if candidate.effect.name not in fit.axis.names:  # a friction that another one replaced
            dropped.append(candidate.effect.name)
            continue
        without = less(candidate.effect, fit, base, dataset)
        needed = _is_needed(candidate.effect, fit, without, dataset)
        if needed:
            # The shapes of later effects were found beside this one; they may differ without it.
            without = fit_thoroughly(without.axis, dataset, base.begun)
            needed = _is_needed(candidate.effect, fit, without, dataset)
        if not needed:
            fit = without
            dropped.append(candidate.effect.name)
    fit = straightened(fit, dataset, base.axis.names)
    for candidate in earlier:
        fit, later = _in_its_place(fit, candidate.effect)
        dropped = [later if name == candidate.effect.name else name for name in dropped]
    return fit, tuple(dropped)


def _is_needed(effect: Effect, fit: Fit, without: Fit, dataset: Dataset) -> bool:
    """Whether an effect of a fit would be added to the fit without it."""
    return score(without, fit, dataset, effect).is_added_to(without)


def _in_its_place(fit: Fit, effect: Effect) -> tuple[Fit, str]:
    """The fit with the next of several in the place of a first that is gone; who is gone then."""
    present = [f.effect.name for f in fit.axis.effects if f.effect.several]
    after = (effect.numbered(n).name for n in range(effect.number + 1, MOST_OF_ONE + 1))
    later = next((name for name in after if name in present), effect.name)
    if effect.name in fit.axis.names or later == effect.name:
        return fit, effect.name

    def renamed(axis: AxisModel) -> AxisModel:
        own = (replace(f, effect=effect) if f.effect.name == later else f for f in axis.effects)
        return replace(axis, effects=tuple(own))

    axis = renamed(fit.axis)
    scaling = Scaling(free_parameters(axis))
    return replace(fit, axis=axis, scaling=scaling, begun=renamed(fit.begun)), later
