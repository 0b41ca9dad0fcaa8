"""A single change of a model that somebody asks for, judged as the search judges it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from identify.dataset.dataset import Dataset
from identify.dataset.drive import is_noise
from identify.estimation.fit import Fit, finished
from identify.estimation.variable_projection import starts
from identify.selection.acceptance import Judged
from identify.selection.candidates import Candidate, candidate_of, noise_candidate
from identify.selection.changes import Added, Change, Reshaped, control, refit_thoroughly
from identify.selection.controls import Trial
from identify.selection.curves import shapes_of
from twin.effect import Effect
from twin.errors import InputError


def try_effect(base: Fit, dataset: Dataset, effect: Effect) -> Candidate:
    """The model refitted together with an effect, and what speaks for it.

    It is refitted whatever one linear step promises; ``Candidate.refused`` says why not to keep it.
    """
    before, change = Judged(base, dataset), Added(effect)
    if is_noise(effect):
        axis = base.axis.with_effect(starts(base, dataset, effect)[0].fitted)
        after = Judged(finished(axis, base.begun, dataset.fit, base.outcome), dataset)
        return noise_candidate(before, after, effect)
    look = change.look(before, Trial.beside(before))
    fit = change.refit(before, look)
    if not fit.at_floor:
        fit = refit_thoroughly(before, look, fit)
    return _judged(change, before, fit, effect, [p.name for p in effect.parameters])


def reshape(
    effect: Effect, fits: Mapping[str, Fit], prepared: Mapping[str, Dataset]
) -> tuple[Candidate, Reshaped]:
    """The shape of an effect's law on the axis that it helps most; fits: by axis that has it.

    Raises InputError where the logs ask for none.
    """
    tried = []
    for name, fit in fits.items():
        before = Judged(fit, prepared[name])
        trial = Trial.beside(before)
        for shape in shapes_of(fit, before.dataset, effect.name):
            change = Reshaped(shape, fit.axis[effect.name])
            after = change.refit(before, change.look(before, trial))
            tried.append((_judged(change, before, after, shape.empty.effect, ()), change))
    if not tried:
        raise InputError(
            f"the logs show no other shape of {effect.name}: no curve in its place lowers their "
            "error; `twin diagnose` says what the model lacks"
        )
    return max(tried, key=lambda one: (one[0].supported, one[0].part))


def _judged(
    change: Change, before: Judged, fit: Fit, effect: Effect, own: Sequence[str]
) -> Candidate:
    """What speaks for a refitted change; its controls are asked only where they could decide."""
    after = Judged(fit, before.dataset)
    found = candidate_of(before, after, effect, 0.0, own)
    if found.score is None or not found.supported:
        return found
    taken = control(change, before, after)
    return replace(found, score=replace(found.score, control=taken))
