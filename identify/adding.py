"""Grow a model by one effect, the shape of one, a body, or all that was found; or take one out."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from identify.dataset.dataset import Dataset
from identify.dataset.given_logs import require_moving
from identify.estimation.fit import Fit, fit_axis
from identify.estimation.free_curves import having_shape
from identify.estimation.offered import require_shown
from identify.mechanism.bodies import corrected
from identify.mechanism.departures import departures_of
from identify.output.words.next_step import axis_in_words, notes_in_words
from identify.output.words.recording import read_otherwise_in_words
from identify.results.grown import (
    Addition,
    AllAdded,
    CorrectedBody,
    Removal,
    addition,
    removal,
    step_of_body,
)
from identify.results.results import steps_together
from identify.selection.acceptance import Judged, score
from identify.selection.candidates import Candidate
from identify.selection.nonparametric import fit_nonparametric, physics_alone
from identify.selection.trying import effect_tried, reshape
from identify.workflow import Model, as_given, fit, fit_as_given
from twin.effect import Effect
from twin.effects import Catalogue, load_catalogue
from twin.errors import InputError
from twin.logs import GivenLogs
from twin.model.file import as_model
from twin.model.machine import AxisModel, HistoryStep, MachineModel
from twin.parallel import Progress, parallel, silent


@parallel()
def add(
    effect: Effect | str,
    model: Model,
    logs: GivenLogs,
    holdout: GivenLogs | None = None,
    test: GivenLogs | None = None,
    *,
    catalogue: Catalogue | None = None,
    axis: str | None = None,
    test_function: float | None = None,
    progress: Progress = silent,
) -> Addition:
    """Add an effect to the axis that it helps most (or to ``axis``), refit and record the errors.

    Nonparametric effects of the model are removed before a physical effect is added. catalogue: of
    the effects that a name or the model's file names, the package's own where None. Raises
    InputError where the axis has the effect already.
    """
    known = load_catalogue() if catalogue is None else catalogue
    model = as_model(model, known)
    effect = known[effect] if isinstance(effect, str) else effect
    model.require_usable(effect, axis or next(iter(model.axes)))
    given, model = model, model if effect.is_nonparametric else physics_alone(model)
    read = as_given(model, logs, holdout, test)
    before = fit_as_given(read, Catalogue([]), test_function, progress, [effect])
    names = [axis] if axis else list(before.fits)
    for name in names:
        model.axis(name)
        require_moving(name, before.fits)
    open_axes = [n for n in names if effect.name not in model.axes[n].names]
    if not open_axes:
        raise InputError(
            f"axis {', '.join(names)} has the effect '{effect.name}' already; `twin fit` refits it"
            f"{f', {effect.numbered(effect.number + 1).name} is another' if effect.several else ''}"
        )
    progress("adding", 0, 1)
    shown = require_shown(effect, {n: (model.axes[n], before.datasets[n]) for n in open_axes})
    tried = [_attempt(before.fits[n], before.datasets[n], effect) for n in shown]
    best, there = max(tried, key=lambda one: (one[0].supported, one[0].part, one[0].delta_bic))
    having = [n for n in names if n not in open_axes]
    base, prepared = before.fits[best.axis], {**before.datasets, best.axis: there}
    if there is not before.datasets[best.axis]:
        base = replace(fit_axis(base.axis, there.training), begun=base.begun)
    made = addition(best, base, prepared, before.model, given)
    why = axis_in_words(effect.name, best.axis, names, having)
    return _with_notes(made, *read_otherwise_in_words(read.recording), why)


def _attempt(base: Fit, dataset: Dataset, effect: Effect) -> tuple[Candidate, Dataset]:
    """An effect beside a fit, and the dataset with the channel delay that it leaves."""
    if effect.is_nonparametric:
        return fit_nonparametric(base, dataset, effect), dataset
    tried = effect_tried(base, dataset, effect)
    return tried.candidate, tried.judged.dataset


@parallel()
def add_found(
    found: Model,
    model: Model,
    logs: GivenLogs,
    holdout: GivenLogs | None = None,
    test: GivenLogs | None = None,
    *,
    catalogue: Catalogue | None = None,
    test_function: float | None = None,
    progress: Progress = silent,
) -> AllAdded:
    """Add to a model all that a diagnosis of it found, refit, and record the errors.

    found: the model with it, such as ``Diagnosis.model`` or what ``found_in`` reads of a saved
    answer. Raises InputError where it has none of the axes of the model, or nothing beyond it.
    """
    known = load_catalogue() if catalogue is None else catalogue
    with_all, given = as_model(found, known), as_model(model, known)
    if with_all.axes.keys() != given.axes.keys():
        raise InputError(
            f"the answer is about a machine with axes {', '.join(with_all.axes)}, the model has "
            f"{', '.join(given.axes)}; give the model that was diagnosed"
        )
    changed = {a: _changed(given.axes[a], with_all.axes[a]) for a in given.axes}
    if not any(changed.values()) and with_all.mjcf == given.mjcf:
        raise InputError(
            f"{given.name}: the answer found nothing that this model lacks; diagnose it again"
        )
    job = partial(
        fit, logs=logs, holdout=holdout, test=test, test_function=test_function, progress=progress
    )
    before, after = job(physics_alone(given)), job(with_all)
    made, kept = replace(after.model, history=before.model.history), True
    for axis, names in changed.items():
        if names and axis in after.fits:
            last, dataset = after.fits[axis], after.datasets[axis]
            # Both on one dataset: a fit chooses its test functions by what its model leaves.
            first = fit_axis(before.fits[axis].axis, dataset.training)
            made = made.with_history(*steps_together(names, first, last, dataset))
            gain = score(Judged(first, dataset), Judged(last, dataset))
            kept = kept and gain.accepted
    for body, axes in _other_bodies(given, with_all).items():
        for axis in (a for a in axes if a in after.fits and a in before.fits):
            step = step_of_body(body, axis, before, after)
            made, kept = made.with_history(step), kept and _is_less_after(step)
    return AllAdded(made, before, made.history[len(given.history) :], kept)


def _is_less_after(step: HistoryStep) -> bool:
    """Whether the error is less with a step, on logs that were not fitted where there are any."""
    if step.holdout_error_before is not None and step.holdout_error_after is not None:
        return step.holdout_error_after < step.holdout_error_before
    return step.fit_error_after < step.fit_error_before


def _other_bodies(given: MachineModel, other: MachineModel) -> dict[str, tuple[str, ...]]:
    """Bodies of a mechanism that are others in the second model, and the axes that each changes."""
    if given.mjcf is None or other.mjcf is None or other.mjcf == given.mjcf:
        return {}
    from twin.mujoco.mechanism import mechanism_of

    one, two = (mechanism_of(m.mjcf or "", m.mjcf_name or "", m.joints) for m in (given, other))
    return one.differing(two)


def _changed(given: AxisModel, other: AxisModel) -> dict[str, bool]:
    """Laws that an axis has beyond another, or has free; and whether it is another shape of one."""
    added = {f.effect.name: False for f in other.effects if f.effect.name not in given.names}
    freed = [f.effect.name for f in given.effects if f.effect.name in other.names]
    freed = [name for name in freed if given[name].fixed - other[name].fixed]
    return added | dict.fromkeys(freed, True)


@parallel()
def correct_body(
    model: Model,
    logs: GivenLogs,
    holdout: GivenLogs | None = None,
    test: GivenLogs | None = None,
    *,
    file: str,
    catalogue: Catalogue | None = None,
    test_function: float | None = None,
    progress: Progress = silent,
) -> CorrectedBody:
    """The inertia that bodies have by the logs, written into a copy of the machine's MuJoCo file.

    file: name of the copy. catalogue: effects beside which bodies are judged, the package's own
    where None. Raises InputError where the axes are no joints, and where the logs prove no body to
    be another than in the file.
    """
    known = load_catalogue() if catalogue is None else catalogue
    model = as_model(model, known)
    if not model.joints:
        raise InputError(
            f"{model.name}: link_mass corrects a body of a MuJoCo file, and its axes are no joints "
            "of one; add payload_mass, or make the first model of an MJCF file (`twin new`)"
        )
    before = fit(
        physics_alone(model), logs, holdout, test, test_function=test_function, progress=progress
    )
    found = departures_of(before.model, before.fits, before.datasets, known, progress)
    if not found.bodies:
        raise InputError(
            f"{model.mjcf_name}: the logs prove no body to correct it; `twin diagnose` says what "
            "they show"
        )
    found = found.beside(found.fits, found.datasets)
    made = corrected(before.model, found.bodies, found.fits, file)
    return CorrectedBody(made, before.model, found.bodies)


@parallel()
def remove(
    effect: str,
    model: Model,
    logs: GivenLogs,
    holdout: GivenLogs | None = None,
    test: GivenLogs | None = None,
    *,
    catalogue: Catalogue | None = None,
    axis: str | None = None,
    test_function: float | None = None,
    progress: Progress = silent,
) -> Removal:
    """Take an effect out of an axis, refit the others, and record the errors with it and without.

    effect: its name in the model. axis: needed where several have it. Raises InputError where no
    axis has it, or several have.
    """
    model = as_model(model, catalogue)
    names = [axis] if axis else list(model.axes)
    having = [name for name in names if effect in model.axis(name).names]
    if len(having) != 1:
        known = {n: ", ".join(model.axes[n].names) for n in names}
        told = "; ".join(f"axis {n} has {effects or 'none'}" for n, effects in known.items())
        which = f"several axes have it: give one of {', '.join(having)}" if having else told
        raise InputError(f"{effect}: cannot be taken out; {which}")
    name = having[0]
    before = fit(model, logs, holdout, test, test_function=test_function, progress=progress)
    require_moving(name, before.fits)
    progress("taking it out", 0, 1)
    dataset, own = before.datasets[name], before.fits[name]
    less = replace(fit_axis(own.axis.without(effect), dataset.training), begun=own.begun)
    return removal(effect, before.model, own, less, dataset)


def _with_notes(made: Addition, *first: str | None) -> Addition:
    """An addition with what a reader should know; first: what is to be said before."""
    kept, notes = notes_in_words(made)
    return made.with_notes(kept, (*(note for note in first if note), *notes))


@parallel()
def add_shape(
    effect: Effect | str,
    model: Model,
    logs: GivenLogs,
    holdout: GivenLogs | None = None,
    test: GivenLogs | None = None,
    *,
    catalogue: Catalogue | None = None,
    axis: str | None = None,
    test_function: float | None = None,
    progress: Progress = silent,
) -> Addition:
    """Give the law of an effect the shape that the logs show, refit and record the errors.

    A free curve takes the law's place, or goes beside a friction law, which holds the axis at rest.
    axis: that which it helps most where None. Raises InputError where no axis has the effect, where
    its law assumes no curve, where the axis has a free curve already, and where the logs ask for
    none.
    """
    known = load_catalogue() if catalogue is None else catalogue
    model = as_model(model, known)
    effect = known[effect] if isinstance(effect, str) else effect
    names = having_shape(effect, model, axis)
    before = fit(model, logs, holdout, test, test_function=test_function, progress=progress)
    fits = {n: before.fits[n] for n in names if n in before.fits}
    if not fits:
        require_moving(names[0], before.fits)
    progress("adding", 0, 1)
    best, shape = reshape(effect, fits, before.datasets)
    return _with_notes(addition(best, fits[best.axis], before.datasets, before.model, model, shape))
