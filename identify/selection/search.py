"""The search for what a model lacks: one list of changes a round, one acceptance test.

Forward: of all changes that are accepted, the one that leaves least; of those tied with it, the one
with the fewest parameters, unless the selection logs ask for another. Backward: an earlier change
that is not accepted beside the later ones goes, and all else is fitted again from the model as it
was given, of which it has moved no value; it may be asked for again later. Where no change is
accepted alone, those that come nearest are followed one round further: two that are accepted
together, and each beside the other, are needed together.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from identify.dataset.dataset import Dataset
from identify.estimation.alignment import begun_at, realigned, synchronised, time_origins
from identify.estimation.errors import error_on
from identify.estimation.evidence import rms
from identify.estimation.fit import Fit, fit_axis
from identify.estimation.variable_projection import basis_beside, fit_multistart
from identify.rules import RULE
from identify.selection.acceptance import Judged, Taken, least_t, prefers, score
from identify.selection.beside_kin import pairs_beside
from identify.selection.candidates import Candidate, candidate_of, ordered
from identify.selection.changes import (
    Added,
    Change,
    Reshaped,
    Screening,
    control,
    freed_of,
    in_simplest_values,
)
from identify.selection.controls import ControlTest
from identify.selection.held import has_collapsed, is_held
from identify.selection.law_or_curve import NEARLY, follows, laws_for, takes_as_much
from identify.selection.of_friction import is_of_friction
from identify.selection.refusal import Instead
from identify.selection.trying import (
    LEADERS,
    Beside,
    Tried,
    fitted_anew,
    judged_change,
    refitted_on,
    settled,
    tried_beside,
    tried_exchanged,
)
from twin.effect import Effect, Kind
from twin.effects import Catalogue
from twin.model.machine import AxisModel
from twin.parallel import Progress, silent, within
from twin.threads import trim_memory


@dataclass(frozen=True, eq=False)
class Step:
    """A change that was accepted, and those tied with it.

    with_others: whether it is accepted only together with another step. held: whether a later free
    curve can make its force too, and so tells nothing against it. dropped: names of earlier changes
    that were not needed any more beside it. kin: the others that do nearly as well; a law that ends
    in another shape resembles any of them. of_position: whether it stands for a force of position,
    of which the motion does not tell that it is this law.
    """

    tried: Tried
    tied: tuple[Tried, ...] = ()
    with_others: bool = False
    held: bool = False
    dropped: tuple[str, ...] = ()
    kin: tuple[Tried, ...] = ()
    of_position: bool = False

    @property
    def change(self) -> Change:
        """What was changed."""
        return self.tried.change


@dataclass(frozen=True, eq=False)
class Found:
    """What a search found.

    base: the fit before, at its best. steps: the changes that were accepted and are needed still.
    passed: all that were accepted on the way. final: the fit with the steps. ranking: every absent
    effect beside the base. last: the changes that were tried beside the final fit. exchanged: those
    of them that training and selection logs prove with their roles exchanged. barred: names of laws
    that were doubted, of which no change is tried.
    """

    dataset: Dataset
    base: Judged
    final: Judged
    steps: tuple[Step, ...]
    passed: tuple[Step, ...]
    ranking: tuple[Candidate, ...]
    last: tuple[Tried, ...]
    exchanged: tuple[Tried, ...] = ()
    barred: frozenset[str] = frozenset()


def search(base: Fit, dataset: Dataset, catalogue: Catalogue, progress: Progress = silent) -> Found:
    """Change one fitted axis while changes are accepted."""
    judged = Judged(base, dataset)
    return resumed(Found(dataset, judged, judged, (), (), (), ()), catalogue, progress)


def resumed(found: Found, catalogue: Catalogue, progress: Progress = silent) -> Found:
    """Go on from what was found, while changes are accepted.

    Long logs are searched by their beginnings, with one fit of the answer to all of them; where
    this leaves clearly more, it goes on from there on all of them.
    """
    dataset, base = found.dataset, found.base.fit
    if dataset.part is dataset:
        return _search(found, catalogue, progress)
    found = _search(_on_part(found), catalogue, progress)
    progress("answer fitted to the whole logs", 0, 1)
    _let_go(found)
    whole = _on_whole(found, base, dataset)
    if found.final.fit.ratio * RULE.at_floor > whole.final.fit.ratio or whole.final.at_floor:
        return whole
    return _search(whole, catalogue, progress)


def _let_go(found: Found) -> None:
    """Let go of the matrices of all fits of a search, before those of whole logs are made."""
    tried = [*found.last, *found.exchanged, *(t for s in found.passed for t in (s.tried, *s.tied))]
    fits = [found.base.fit, found.final.fit, *(t.judged.fit for t in tried)]
    for fit in (*fits, *(c.fit for c in found.ranking)):
        fit.forget()
    for known in (ControlTest.beside, basis_beside):
        known.cache_clear()
    trim_memory()


def _on_part(found: Found) -> Found:
    """What was found, fitted to the beginnings of the logs."""
    on_part = replace(found.base, dataset=found.dataset.part)
    base = refitted_on(found.base.fit.axis, on_part)
    final = refitted_on(found.final.fit.axis, on_part) if found.steps else base
    return replace(found, dataset=on_part.dataset, base=base, final=final)


def _on_whole(found: Found, base: Fit, dataset: Dataset) -> Found:
    """What was found on the beginnings of logs, fitted to the whole of them."""
    part, given = found.dataset, dataset.training
    if part.channel_delay != dataset.channel_delay:
        dataset = realigned(dataset, part.channel_delay)
    dataset = begun_at(dataset, time_origins(part))
    first, same = base, [*given] == [*dataset.training]
    if not same or rms(error_on(found.base.fit.axis, given)) < base.error:
        first = replace(fit_axis(found.base.fit.axis, dataset.training), begun=base.begun)
    judged = final = Judged(first, dataset)
    if found.steps:
        fit = fit_axis(found.final.fit.axis, dataset.training)
        final = Judged(replace(fit, begun=base.begun), dataset)
    return replace(found, dataset=dataset, base=judged, final=final)


def _search(found: Found, catalogue: Catalogue, progress: Progress) -> Found:
    """Go on from what was found."""
    first, judged, steps = found.base, found.final, found.steps
    passed, ranking, last = [*found.passed], found.ranking, list(found.last)
    exchanged = list(found.exchanged)
    been: set[frozenset[tuple[type, str]]] = set()
    while len(steps) < RULE.most_steps:
        made = frozenset((type(s.change), s.change.name) for s in steps)
        if made in been:
            break  # what one change makes needless, another asks for again
        been.add(made)
        step = within(progress, f"step {len(steps) + 1} of at most {RULE.most_steps}")
        trial = Beside(catalogue, tuple(s.change.name for s in steps), found.barred)
        judged = judged if steps else _without_delay(judged, trial, step)
        judged, last, candidates = tried_beside(judged, trial, step)
        if not steps:
            doubted = (c for c in ranking if c.effect.name in found.barred)
            first, ranking = judged, ordered([*candidates, *doubted])
        if not (new := _accepted(judged, last)):
            exchanged = tried_exchanged(judged, trial, step)
            new = _accepted(judged, exchanged) or _together(judged, last, exchanged, trial, step)
            new = new or _beside_kin(judged, trial, step) or _of_position([*last, *exchanged])
        if not new and (led := _by_a_curve(judged, steps, first, trial, step)):
            judged, steps, new = led
        if not new:
            break
        exchanged = []
        passed += new
        step("all values refitted", 0, 1)
        judged, steps = _needed(new[-1].tried.judged, (*steps, *new), first)
        judged = _in_simplest_values(judged, steps)
        passed[-1] = steps[-1]  # which tells what it made needless
        judged, freed = _with_free_exponents(judged, steps)
        passed, steps = [*passed, *freed], (*steps, *freed)
        if judged.at_floor:
            break
        fit = fit_multistart(judged.fit.axis, judged.dataset, judged.fit.begun)
        dataset, fit = synchronised(fit, judged.dataset)
        judged = settled(Judged(fit, dataset))
    ended = (judged.dataset, first, judged, steps, tuple(passed), ranking, tuple(last))
    found = Found(*ended, tuple(exchanged), found.barred)
    return found if first.dataset is judged.dataset else on_final_dataset(judged, found)


def _without_delay(judged: Judged, trial: Beside, progress: Progress) -> Judged:
    """The fit without a channel delay, where an effect of the catalogue leaves less than the delay.

    A friction that lags behind reversals looks like one while the model has it follow at once.
    """
    delay, fit = judged.dataset.channel_delay, judged.fit
    if delay == 0.0 or judged.at_floor:
        return judged
    dataset = realigned(judged.dataset, 0.0)
    plain = Judged(replace(fit_axis(fit.axis, dataset.training), begun=fit.begun), dataset)
    takes = 1.0 - (fit.error / plain.fit.error) ** 2
    instead = replace(trial, least=max(takes, trial.least))
    tried = tried_beside(plain, instead, within(progress, "no channel delay"))[1]
    found = [t for t in tried if t.candidate.supported and not t.judged.dataset.channel_delay]
    return plain if any(score(judged, t.judged).accepted for t in found) else judged


def _in_simplest_values(judged: Judged, steps: tuple[Step, ...]) -> Judged:
    """The fit with the simplest values of what was added, which later steps may have cleared."""
    fit = of_simplest_values(judged.fit, steps)
    if fit is judged.fit:
        return judged
    return Judged(replace(fit, begun=judged.fit.begun), judged.dataset)


def of_simplest_values(fit: Fit, steps: Sequence[Step]) -> Fit:
    """A fit with the simplest values of what some steps added, where they explain as much."""
    added = {s.change.name for s in steps if isinstance(s.change, Added)}
    for law in (f for f in fit.axis.effects if f.effect.name in added):
        fit = in_simplest_values(fit, law.effect)
    return fit


def _with_free_exponents(
    judged: Judged, steps: tuple[Step, ...]
) -> tuple[Judged, tuple[Step, ...]]:
    """The fit with free exponents where added laws ask for others than they hold; those steps.

    A law of another exponent is another law, however little its exponent takes of what is left.
    """
    added = {s.change.name for s in steps if isinstance(s.change, Added)}
    out: tuple[Step, ...] = ()
    for change in (c for c in freed_of(judged.fit.axis) if c.name in added):
        screening = Screening(change, 0.0, (change.free(judged.fit.axis),))
        freed = judged_change(judged, screening, change.refit(judged, screening))
        asked = freed.candidate.delta_bic > RULE.least_bic and not freed.candidate.doubt
        if asked and freed.candidate.gain.t > -least_t(1):  # other logs do not contradict it
            judged, out = freed.judged, (*out, Step(freed))
    return judged, out


def on_final_dataset(final: Judged, found: Found) -> Found:
    """What was found, on the dataset of the final fit, whose channel delay is another.

    So that the error without anything is one number, beside every candidate and in the answer, and
    so is that with the law that alone was found. What was decided, and by which score, stays; so
    does the part that all others leave.
    """
    dataset = final.dataset
    first = Judged(found.base.fit, dataset)
    if [*first.fit.logs] != [*dataset.training]:
        first = refitted_on(first.fit.axis, first)

    def candidate(one: Candidate) -> Candidate:
        if one.is_noise or _laws(one.fit) != _laws(final.fit):
            left, error = np.sqrt(one.gain.left), first.other_error
            return replace(one, gain=replace(one.gain, before=error, after=left * error))
        by = candidate_of(first, final, one.effect, ())
        return replace(one, fit=by.fit, evidence=by.evidence, gain=by.gain)

    ranking = {id(one): candidate(one) for one in found.ranking}

    def same(step: Step) -> Step:
        own = step.tried.candidate
        return replace(step, tried=replace(step.tried, candidate=ranking.get(id(own), own)))

    steps, passed = (tuple(map(same, each)) for each in (found.steps, found.passed))
    return replace(found, base=first, ranking=tuple(ranking.values()), steps=steps, passed=passed)


def _laws(fit: Fit) -> list[tuple[Effect, frozenset[str]]]:
    """The effects of a fit, with what each holds."""
    return [(f.effect, f.fixed) for f in fit.axis.effects]


def is_tied(one: Tried, best: Tried) -> bool:
    """Whether the logs do not clearly prefer the better of two changes."""
    effects = [t.change.effect for t in (one, best) if isinstance(t.change, Added)]
    if len(effects) == 2 and all(e.dead_time for e in effects):
        return True  # which of the two is late, no log of both can tell
    return not prefers(best.judged, one.judged)


def _accepted(judged: Judged, tried: Sequence[Tried]) -> list[Step]:
    """The step that the search takes: the simplest of those tied with the best."""
    proved = [t for t in tried if t.candidate.supported]
    lowering = [t for t in proved if not t.candidate.is_noise]
    noise = [t for t in proved if t.candidate.is_noise]
    if noise and not any(t.judged.at_floor for t in lowering):
        return [Step(noise[0])]
    if not lowering:
        return []
    most = best = _best_of(lowering)
    if isinstance(most.change, Reshaped):
        curves = [t for t in lowering if isinstance(t.change, Reshaped)]
        lowering = laws_for(most, judged, tried) or curves
        best = _best_of(lowering)
    tied = [best, *(t for t in lowering if t is not best and is_tied(t, best))]
    # A law leads a free curve that is no better: whatever is missing beside it bends the curve too.
    first = simplest([t for t in tied if not isinstance(t.change, Reshaped)] or tied)
    if most not in lowering and follows(first, most):
        tied.append(most)
    tied += [t for t in tried if takes_as_much(t, first)]
    kin = (t for t in lowering if t.candidate.part >= NEARLY * best.candidate.part)
    others, alike = (tuple(t for t in some if t is not first) for some in (tied, kin))
    return [Step(first, others, kin=alike)]


def _by_a_curve(
    judged: Judged, steps: tuple[Step, ...], first: Judged, trial: Beside, progress: Progress
) -> tuple[Judged, tuple[Step, ...], list[Step]] | None:
    """The fit and the steps with a free curve for a law that is level, where more is proved so."""
    for step in reversed(steps):
        axis = step.change.undone(judged.fit.axis, first.fit.axis)
        known = axis.names if axis else ()  # a law has one curve in its place
        there = [t for t in step.tied if t.change.name in known]
        curves = [t for t in there if isinstance(t.change, Reshaped)]
        if not curves or axis is None:
            continue
        curve, without = curves[0], refitted_on(axis, judged)
        fit = replace(curve.change.refit(without, curve.screening), begun=judged.fit.begun)
        names = tuple((curve.change if s is step else s.change).name for s in steps)
        asked = replace(trial, taken=names)
        beside, tried, _ = tried_beside(Judged(fit, judged.dataset), asked, progress)
        if new := _accepted(beside, tried):
            level = (step.tried, *curves[1:], *(t for t in step.tied if t not in curves))
            led = replace(step, tried=replace(curve, judged=beside), tied=level)
            return beside, tuple(led if s is step else s for s in steps), new
    return None


def _of_position(tried: Sequence[Tried]) -> list[Step]:
    """The step of a force of position that is proved, where no law is that could be itself."""
    proved = [t for t in tried if t.candidate.is_of_position]
    return [Step(_best_of(proved), of_position=True)] if proved else []


def simplest(tied: Sequence[Tried]) -> Tried:
    """Of tied changes the one with the fewest parameters, unless logs that were not fitted ask.

    Few parameters are to predict other logs well, and the selection logs tell whether they do.
    """
    first, *others = sorted(tied, key=lambda t: (round(t.judged.parameters), -t.candidate.part))
    for one in others:
        by = score(first.judged, one.judged)
        clear = by.other.t >= least_t(1) and by.other.part >= RULE.least_part
        first = one if clear and by.training.t > -least_t(1) else first
    return first


def _best_of(tried: Sequence[Tried]) -> Tried:
    """The change that takes most, or the one that the logs clearly prefer to it."""
    best, *others = sorted(tried, key=lambda t: -t.candidate.part)
    for one in others:
        best = best if is_tied(best, one) else one
    return best


def _together(
    judged: Judged,
    tried: Sequence[Tried],
    exchanged: Sequence[Tried],
    trial: Beside,
    progress: Progress,
) -> list[Step]:
    """Two changes that are accepted together, and each beside the other; none where there are not.

    While one is missing, it distorts what the other leaves, so that neither is accepted alone. What
    the logs prove with their roles exchanged is followed first, whatever it takes as they are.
    """

    def is_itself(t: Tried) -> bool:
        # Which friction is out of step is told beside the right one, which may be what is missing.
        return t.candidate.doubt in (None, Instead.FRICTION_OUT_OF_STEP)

    def may_help(t: Tried) -> bool:
        score, enough = t.candidate.score, RULE.promise * RULE.least_part
        return score is not None and score.t > 0.0 and score.part > enough and is_itself(t)

    shown = {t.change.name: t for t in exchanged if is_itself(t)}
    others = (t for t in tried if may_help(t) and t.change.name not in shown)
    ways = [*shown.values(), *sorted(others, key=lambda t: -t.candidate.part)]
    for way in ways[:LEADERS]:
        with_it = replace(trial, taken=(*trial.taken, way.change.name))
        beside, seconds, _ = tried_beside(
            way.judged, with_it, within(progress, f"beside {way.change.name}")
        )
        if not (then := _accepted(beside, seconds) or _of_position(seconds)):
            continue
        both, second = then[0].tried.judged, then[0]
        if _are_needed(way.change, both, judged):
            # None of them was proved when it was chosen: they are compared again beside the second.
            near = NEARLY * way.candidate.part
            level = tuple(t for t in ways if t is not way and t.candidate.part >= near)
            return [Step(way, level, with_others=True), replace(second, with_others=True)]
    return []


def _beside_kin(judged: Judged, trial: Beside, progress: Progress) -> list[Step]:
    """Another friction with what modifies it, where the logs ask for both together."""
    for pair in pairs_beside(judged, trial, progress):
        if _are_needed(pair.friction.change, pair.modifier.judged, judged):
            return [Step(pair.friction, with_others=True), Step(pair.modifier, with_others=True)]
    return []


def _are_needed(way: Change, both: Judged, judged: Judged) -> bool:
    """Whether a change and one beside it are accepted together, and it beside the other."""
    axis = way.undone(both.fit.axis, judged.fit.axis)
    if axis is None or score(judged, both).refused:
        return False
    alone = refitted_on(axis, both)
    return not is_of_friction(alone, both, way.effect) and _is_needed(way, alone, both)


def _is_needed(change: Change, without: Judged, fit: Judged, in_turn: Taken | None = None) -> bool:
    """Whether a change is accepted beside a fit without it, which leaves more than noise.

    in_turn: where other logs, choosing in turn, proved it.
    """
    if without.at_floor:
        return False
    plain = replace(score(without, fit), in_turn=in_turn)
    return plain.accepted and replace(plain, control=control(change, without, fit)).accepted


def _less_replaced(
    judged: Judged, steps: tuple[Step, ...], first: Judged
) -> tuple[Judged, tuple[Step, ...]]:
    """The fit and the steps without those about a friction in whose place it has another by now."""
    axis, gone = judged.fit.axis, replaced(judged.fit.axis, steps)
    for step in gone:
        axis = step.change.undone(axis, first.fit.axis) or axis
    if axis is not judged.fit.axis:
        judged = refitted_on(axis, judged)
    *kept, last = (s for s in steps if s not in gone)
    dropped = (*last.dropped, *dict.fromkeys(s.change.name for s in gone))
    return judged, (*kept, replace(last, dropped=dropped))


def replaced(axis: AxisModel, steps: Sequence[Step]) -> list[Step]:
    """The steps about a friction in whose place an axis has another."""
    own = axis.friction is not None
    return [s for s in steps if own and _rubs(s.change) and s.change.name not in axis.names]


def _rubs(change: Change) -> bool:
    """Whether a change is about a friction."""
    law = change.law.effect if isinstance(change, Reshaped) else change.effect
    return law.kind is Kind.FRICTION


def _needed(
    judged: Judged, steps: tuple[Step, ...], first: Judged
) -> tuple[Judged, tuple[Step, ...]]:
    """The fit and the steps without earlier ones that are not accepted beside the later ones."""
    judged, steps = _less_replaced(judged, steps, first)
    for was in steps[:-1]:
        fallen = partial(has_collapsed, was.change, was.tried.judged, judged)
        step = replace(was, held=was.held and not fallen())
        steps = tuple(step if s is was else s for s in steps)
        if step.held or any(s.change.name == step.change.name for s in steps if s is not step):
            continue  # another change of this law presupposes it
        axis = step.change.undone(judged.fit.axis, first.fit.axis)
        if axis is not None:
            without = refitted_on(axis, judged)
            last = steps[-1].change
            may = not step.with_others and is_held(step.change, last, without, judged)
            if may and not fallen():
                steps = tuple(replace(s, held=True) if s is step else s for s in steps)
                continue
            needed = partial(_is_needed, fit=judged, in_turn=step.tried.candidate.in_turn)
            is_needed, without = needed(step.change, without), fitted_anew(without)
            if is_needed and needed(step.change, without):
                continue
            judged = without
        kept = [s for s in steps if s is not step]
        dropped = (*kept[-1].dropped, step.change.name)
        steps = (*kept[:-1], replace(kept[-1], dropped=dropped))
    return judged, steps
