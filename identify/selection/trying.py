"""Changes tried beside a fit: screened by one linear step, the promising refitted, and judged.

Of all changes for the search; of a single one for whoever asks for it.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

from identify.dataset.dataset import Dataset
from identify.dataset.drive import knows_rounding
from identify.estimation.alignment import moved_by
from identify.estimation.fit import Fit, finished, fit_axis, fit_themselves, turned
from identify.estimation.free_curves import shapes_of
from identify.estimation.residual_noise import foretells_aliases
from identify.estimation.scaling import Scaling
from identify.estimation.variable_projection import absent_effects, fit_multistart, starts
from identify.rules import RULE
from identify.selection.acceptance import Judged, Score, proved_in_turn
from identify.selection.ahead import Ahead
from identify.selection.candidates import Candidate, candidate_of, noise_candidate
from identify.selection.changes import (
    Added,
    Change,
    Freed,
    Reshaped,
    Screening,
    control,
    freed_of,
    from_all_starts,
    reshaped_of,
)
from identify.selection.controls import ControlTest
from identify.selection.of_friction import is_of_friction
from identify.selection.refusal import Instead
from twin.effect import Effect
from twin.effects import Catalogue
from twin.errors import InputError
from twin.model.machine import AxisModel
from twin.parallel import Progress, silent, spread, within

LEADERS = 2  # refitted first, to tell what others must promise; or followed where none helps
NEARLY_ALL = 0.95  # of what is left: such a change is right wherever the fit's optimum is


@dataclass(frozen=True, eq=False)
class Tried:
    """A change beside a fit, refitted: the fit with it, and what speaks for it."""

    change: Change
    screening: Screening
    judged: Judged
    candidate: Candidate


@dataclass(frozen=True, eq=False)
class Beside:
    """What is tried beside a fit: a catalogue, and what of it is not.

    taken: names of laws that the search added; a free curve may stand in the place of one, which is
    then not absent. barred: names of laws of which no change is tried. least: part of what is left
    that a change has to take.
    """

    catalogue: Catalogue
    taken: Sequence[str] = ()
    barred: Collection[str] = ()
    least: float = RULE.least_part

    def absent(self, judged: Judged) -> list[Effect]:
        """The effects that a fit does not have, and that may be tried beside it."""
        known = {*self.taken, *judged.fit.begun.names, *self.barred}
        every = absent_effects(judged.fit.axis, self.catalogue)
        return [e for e in every if e.name not in known]


def tried_beside(
    judged: Judged, trial: Beside, progress: Progress = silent
) -> tuple[Judged, list[Tried], list[Candidate]]:
    """Every change beside a fit: the fit at its best, those refitted, and all absent effects.

    An effect is not absent where a free curve stands in the place of it, which the search added or
    the model had from the beginning.

    If the values of the best without its change are a better start for the fit, it is refitted from
    there: a fit short of its optimum would let every change in.
    """
    barred, effects = trial.barred, trial.absent(judged)
    plain = [Added(e) for e in effects if not e.is_noise]
    held = (c for c in freed_of(judged.fit.axis) if c.name not in barred)
    freed = [c for c in held if not c.is_strength or c.name in trial.catalogue]
    changes: list[Change] = [*plain, *freed]
    if judged.at_floor and not foretells_aliases(judged.fit, judged.dataset):
        changes = []
    controls = ControlTest.beside(judged)
    trying = partial(progress, "trying changes")
    ahead = Ahead(progress)
    screenings = spread(lambda c: ahead.screened(c.screen(judged, controls)), changes, trying)
    looks = judged.dataset.looks
    kinds = looks * len({e.kind for e in effects})
    tried = _refitted(judged, screenings, kinds, progress, trial.least)
    for one in tried:
        ahead.note(one.change, one.candidate.part)
    enough = judged.at_floor or any(t.judged.at_floor and t.candidate.supported for t in tried)
    if not enough:
        progress("trying free curves", 0, 1)
        shapes = [c for c in reshaped_of(judged.fit, judged.dataset) if c.name not in barred]
        curves = [c.screen(judged, controls) for c in shapes]
        best = sorted(curves, key=lambda k: -k.promise)[:LEADERS]
        tried += _refitted(judged, best, looks * len(curves), progress, trial.least, tried)
    judged, tried = _at_its_best(judged, tried)
    tried = _with_alike_evidence(tried)
    rounded = knows_rounding(judged.fit.axis, [log.motion for log in judged.dataset.training])
    noise = [as_noise(judged, e) for e in effects if e.is_noise and not rounded]
    ranked = {t.candidate.effect.name: t.candidate for t in tried if isinstance(t.change, Added)}
    screened = [_as_screened(judged, k) for k in screenings if isinstance(k.change, Added)]
    candidates = [ranked.get(c.effect.name, c) for c in screened] + [n.candidate for n in noise]
    return judged, [*tried, *noise], candidates


def tried_exchanged(judged: Judged, trial: Beside, progress: Progress = silent) -> list[Tried]:
    """What is proved where other logs choose, judged with the roles as they are; each law once.

    Fitted again for that: what it takes is to be seen either way, but a start that the one group of
    logs hides, the other may show. Whoever looks more often finds more by chance, so that each is
    one of as many times the changes. What all of two or more such logs prove stands where those
    that choose see it too. Nothing is asked where a law was doubted at the end of a search, as its
    kin would be one after another; nor of a joint beside its bodies, which all of the logs chose.
    """
    own = judged.dataset
    if own.beside_bodies or trial.barred or judged.at_floor:
        return []
    turns = own.exchanged
    found: dict[str, Tried] = {}
    proofs: list[dict[str, Score]] = []  # of each turn by law
    for dataset in turns:
        there = refitted_on(judged.fit.axis, Judged(judged.fit, dataset))
        tried = tried_beside(there, trial, within(progress, "other logs choosing"))[1]
        proved = (t for t in tried if t.candidate.supported or may_be_itself(t.candidate))
        laws = [t for t in proved if not t.candidate.is_noise]
        sure = (t for t in laws if t.candidate.supported)
        proofs.append({t.change.name: s for t in sure if (s := t.candidate.score)})
        for t in laws:
            found.setdefault(t.change.name, t)

    def as_they_are(t: Tried) -> Tried:
        score, fit = t.candidate.score, refitted_on(t.judged.fit.axis, judged).fit
        among = (len(turns) + 1) * score.among if score else 1
        again = judged_change(judged, t.screening, fit, among)
        candidate, name = again.candidate, t.change.name
        in_turn = proved_in_turn([turn.get(name) for turn in proofs])
        if candidate.score is None or in_turn is None:
            return again
        sure = replace(candidate.score, in_turn=in_turn)
        return replace(again, candidate=replace(candidate, score=sure))

    return [as_they_are(t) for t in found.values()]


def may_be_itself(c: Candidate) -> bool:
    """Whether a law is proved but for what only others beside it tell: which one it is."""
    return c.is_of_position or (c.is_proved and c.doubt is Instead.FRICTION_OUT_OF_STEP)


def _refitted(
    judged: Judged,
    screenings: Sequence[Screening],
    among: int,
    progress: Progress,
    least: float,
    known: Sequence[Tried] = (),
) -> list[Tried]:
    """The changes that promise enough, refitted; the better ones from all starts if none is enough.

    among: of how many independent ones they are; effects of one kind are alike. least: part of what
    is left that each has to take. known: what was refitted before.
    """
    most = max((t.candidate.part for t in known), default=0.0)
    asked = RULE.promise * max(least, most)
    waiting = sorted((k for k in screenings if k.promise >= asked), key=lambda k: -k.promise)
    refitting = partial(progress, "refitting the promising")
    first = spread(lambda k: (k, _fit_of(judged, k)), waiting[:LEADERS], refitting)
    most = max([most, *(_roughly(judged, f) for _, f in first)])
    rest = [k for k in waiting[LEADERS:] if k.promise >= RULE.promise * most]
    fits = [*first, *spread(lambda k: (k, _fit_of(judged, k)), rest, refitting)]
    if not any(f.at_floor for _, f in fits):
        fits.sort(key=lambda pair: -_roughly(judged, pair[1]))
        anew = partial(progress, "refitting the best from other starts")
        fits[:LEADERS] = spread(lambda p: (p[0], from_all_starts(judged, *p)), fits[:LEADERS], anew)
    judging = partial(progress, "judging the refitted")
    return spread(lambda pair: judged_change(judged, *pair, among), fits, judging)


def _fit_of(judged: Judged, screening: Screening) -> Fit:
    return screening.change.refit(judged, screening)


def _roughly(judged: Judged, fit: Fit) -> float:
    """Part of the error above the floor that a fit takes of the training logs."""
    # 1e-300: of an error at its floor, no division by zero
    above = max(judged.fit.error**2 - judged.fit.floor**2, 1e-300)
    return (judged.fit.error**2 - fit.error**2) / above


def judged_change(judged: Judged, screening: Screening, fit: Fit, among: int = 1) -> Tried:
    """A refitted change with its score; its controls are asked only where they could decide.

    among: of how many changes it is chosen.
    """
    # What was given stays that, whatever was changed since.
    change, after = screening.change, Judged(replace(fit, begun=judged.fit.begun), judged.dataset)
    if not fit.at_floor:
        after = settled(after)
    found = candidate_of(judged, after, change.effect, parameters(change), among)
    if found.score and (found.supported or found.is_of_position):
        taken = control(change, judged, after)
        found = replace(found, score=replace(found.score, control=taken))
    if found.supported and is_of_friction(judged, after, change.effect):
        found = replace(found, doubt=Instead.FRICTION_OUT_OF_STEP)
    return Tried(change, screening, after, found)


def parameters(change: Change) -> tuple[str, ...]:
    """Names of the parameters by which a change is told to be plausible."""
    if isinstance(change, Added):
        return tuple(p.name for p in change.effect.parameters)
    return (change.parameter,) if isinstance(change, Freed) else ()


def settled(judged: Judged) -> Judged:
    """The fit with the channel delay that it finds, where that is another than the dataset has.

    An effect that the model lacked may have looked like a delay, or hidden one. So a change brings
    its own delay, and is judged with it.
    """
    moved = moved_by(judged.fit, judged.dataset)
    if moved is None:
        return judged
    fit = replace(fit_axis(judged.fit.axis, moved.training), begun=judged.fit.begun)
    return Judged(fit, moved) if fit.error < judged.fit.error else judged


def refitted_on(axis: AxisModel, judged: Judged) -> Judged:
    """An axis fitted to the dataset of a judged fit."""
    dataset = judged.dataset
    return Judged(replace(fit_themselves(axis, dataset.training), begun=judged.fit.begun), dataset)


def fitted_anew(judged: Judged) -> Judged:
    """The fit made again: its shapes scanned, and from the values of the model as it was given.

    What it had beside and lost may have led the shapes of others, and moved the values of all. None
    of its laws may become what was lost.
    """
    axis, dataset, begun = judged.fit.axis, judged.dataset, judged.fit.begun
    scanned = Judged(fit_multistart(axis, dataset, begun), dataset)
    again = (scanned, refitted_on(axis.begun_as(begun), judged))
    own = [j for j in again if not turned(axis, j.fit.axis, dataset.training)]
    return min([judged, *own], key=lambda j: j.fit.error)


def _as_screened(judged: Judged, screening: Screening) -> Candidate:
    """An absent effect that was not refitted, as its linear step predicts it."""
    axis = screening.axes[0]
    fit = replace(judged.fit, axis=axis, scaling=Scaling.of(axis, judged.fit.logs))
    return Candidate.screened(judged, fit, screening.change.effect, screening.promise)


def as_noise(judged: Judged, effect: Effect) -> Tried:
    """An effect that only raises the noise floor."""
    fit, dataset = judged.fit, judged.dataset
    axis = fit.axis.with_effect(starts(fit, dataset, effect)[0].fitted)
    after = Judged(finished(axis, fit.begun, dataset.training, fit.outcome), dataset)
    change = Added(effect)
    return Tried(change, Screening(change, 0.0), after, noise_candidate(judged, after, effect))


def _at_its_best(judged: Judged, tried: list[Tried]) -> tuple[Judged, list[Tried]]:
    """The fit refitted from where the best change left it, and the changes scored against it."""
    proved = [t for t in tried if t.candidate.supported]
    if not proved:
        return judged, tried
    best = max(proved, key=lambda t: t.candidate.part)
    axis = best.change.undone(best.judged.fit.axis, judged.fit.axis)
    if axis is None or best.candidate.part > NEARLY_ALL:
        return judged, tried
    refitted = refitted_on(axis, judged)
    # 0.999 of the error, below which another refit is a better optimum
    if refitted.fit.error > 0.999 * judged.fit.error:
        return judged, tried
    return refitted, [_scored_again(refitted, t) for t in tried]


def _with_alike_evidence(tried: list[Tried]) -> list[Tried]:
    """The changes with evidence that can be compared: by the samples of the best one's residual."""
    every = [t.candidate.evidence for t in tried]
    samples = max(every, key=lambda e: e.log_gain).samples if every else 0.0
    alike = [
        replace(t.candidate, evidence=replace(e, samples=samples))
        for t, e in zip(tried, every, strict=True)
    ]
    return [replace(t, candidate=c) for t, c in zip(tried, alike, strict=True)]


def _scored_again(judged: Judged, tried: Tried) -> Tried:
    among = tried.candidate.score.among if tried.candidate.score else 1
    return judged_change(judged, tried.screening, tried.judged.fit, among)


def try_effect(base: Fit, dataset: Dataset, effect: Effect) -> Candidate:
    """The model refitted together with an effect, and what speaks for it.

    It is refitted whatever one linear step promises; ``Candidate.refused`` says why not to keep it.
    """
    return effect_tried(base, dataset, effect).candidate


def effect_tried(base: Fit, dataset: Dataset, effect: Effect) -> Tried:
    """The same with the dataset, whose channel delay may be another beside the effect."""
    before, change = Judged(base, dataset), Added(effect)
    if effect.is_noise:
        return as_noise(before, effect)
    screening = change.screen(before, ControlTest.beside(before))
    fit = change.refit(before, screening)
    if not fit.at_floor:
        fit = fit_multistart(from_all_starts(before, screening, fit).axis, dataset, base.begun)
    return judged_change(before, screening, fit)


def reshape(
    effect: Effect, fits: Mapping[str, Fit], prepared: Mapping[str, Dataset]
) -> tuple[Candidate, Reshaped]:
    """The shape of an effect's law on the axis that it helps most; fits: by axis that has it.

    Raises InputError where the logs ask for none.
    """
    tried = []
    for name, fit in fits.items():
        before = Judged(fit, prepared[name])
        trial = ControlTest.beside(before)
        for shape in shapes_of(fit, before.dataset, effect.name):
            change = Reshaped(shape, fit.axis[effect.name])
            screening = change.screen(before, trial)
            after = change.refit(before, screening)
            tried.append((judged_change(before, screening, after).candidate, change))
    if not tried:
        raise InputError(
            f"the logs show no other shape of {effect.name}: no curve in its place lowers their "
            "error; `twin diagnose` says what the model lacks"
        )
    return max(tried, key=lambda one: (one[0].supported, one[0].part))
