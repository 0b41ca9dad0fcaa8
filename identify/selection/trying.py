"""A single change of a model that somebody asks for, judged as the search judges it."""

from __future__ import annotations

from collections.abc import Mapping

from identify.dataset.dataset import Dataset
from identify.dataset.drive import is_noise
from identify.estimation.fit import Fit
from identify.estimation.variable_projection import fit_multistart
from identify.selection.acceptance import Judged
from identify.selection.candidates import Candidate
from identify.selection.changes import Added, Reshaped, from_all_starts
from identify.selection.controls import Trial
from identify.selection.curves import shapes_of
from identify.selection.search import as_noise, judged_change
from twin.effect import Effect
from twin.errors import InputError


def try_effect(base: Fit, dataset: Dataset, effect: Effect) -> Candidate:
    """The model refitted together with an effect, and what speaks for it.

    It is refitted whatever one linear step promises; ``Candidate.refused`` says why not to keep it.
    """
    before, change = Judged(base, dataset), Added(effect)
    if is_noise(effect):
        return as_noise(before, effect).candidate
    look = change.look(before, Trial.beside(before))
    fit = change.refit(before, look)
    if not fit.at_floor:
        fit = fit_multistart(from_all_starts(before, look, fit).axis, dataset, base.begun)
    return judged_change(before, look, fit).candidate


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
            look = change.look(before, trial)
            after = change.refit(before, look)
            tried.append((judged_change(before, look, after).candidate, change))
    if not tried:
        raise InputError(
            f"the logs show no other shape of {effect.name}: no curve in its place lowers their "
            "error; `twin diagnose` says what the model lacks"
        )
    return max(tried, key=lambda one: (one[0].supported, one[0].part))
