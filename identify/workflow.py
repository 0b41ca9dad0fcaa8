"""Fit, compare, diagnose, add and plan for a whole machine and its logs."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from identify.analysis.first_model import Masses, unused
from identify.analysis.first_model import first_model as shown_by
from identify.analysis.recording import Recording, misassigned
from identify.dataset.dataset import Dataset, Role
from identify.dataset.given_logs import shortness
from identify.dataset.preparation import datasets, informative_logs, tell_left_out, telling
from identify.dataset.prepared_log import sticks
from identify.dataset.time_scale import TEST_FUNCTIONS
from identify.estimation.alignment import aligned, fit_aligned
from identify.estimation.confounded import refit
from identify.estimation.disagreement import odd_in
from identify.estimation.errors import error_if_any
from identify.estimation.fit import Fit
from identify.estimation.force_balance import require_finite, require_residual
from identify.estimation.intervals import estimates, intervals_to_keep
from identify.estimation.offered import not_tried, offered, telling_beside
from identify.estimation.open_loop import simulated_error
from identify.estimation.residual_noise import noise_known, with_own_noise
from identify.estimation.simulated_motion import fit_simulated_motion
from identify.estimation.variable_projection import usable
from identify.experiment_design.plan import next_experiments
from identify.experiment_design.plan import plan as plan
from identify.frequency.of_logs import responses_of
from identify.mechanism.departures import Departures, departures_of
from identify.results.frequency import FrequencyResponse
from identify.results.results import (
    AxisSummary,
    Comparison,
    Diagnosis,
    Feedforward,
    FitResult,
    OnMachine,
    SimulationFit,
    summary_of,
    with_all_found,
)
from identify.selection.diagnosis import AxisDiagnosis, diagnose_axis
from identify.selection.nonparametric import physics_alone
from identify.validation.agreement import Agreement, agreement
from identify.validation.comparison import (
    SideBySide,
    compare_axis,
    free_run_errors,
    position_errors,
    side_by_side,
)
from identify.validation.misfit_maps import Region, worst_region
from identify.validation.tracking import tracking, unmoved
from twin.effect import Effect
from twin.effects import Catalogue, load_catalogue
from twin.errors import InputError
from twin.logs import GivenLogs, Log, logs_by_name, some_logs
from twin.model.file import as_model
from twin.model.machine import AxisModel, MachineModel
from twin.parallel import Progress, parallel, silent, spread, within

Model = MachineModel | str | Path
READING = "reading and preparing the logs"


@parallel()
def first_model(
    logs: GivenLogs,
    name: str = "machine",
    catalogue: Catalogue | None = None,
    *,
    mass: Masses | None = None,
) -> MachineModel:
    """A model to begin with, of what the logs show: mass, friction, constant force, hardware.

    mass: kg (kg m^2 of a rotary axis) where it is known, of the only axis that moves, or by axis;
    it is held, and the rest is found beside it. Raises InputError where no log says anything, and
    where the logs do not tell the mass and it is not given.
    """
    known = load_catalogue() if catalogue is None else catalogue
    given = logs_by_name(logs, Role.TRAINING.value)
    model = shown_by(given, name, known, mass=mass)
    tell_left_out(unused(model, given))
    return model


def odd_logs(logs: GivenLogs) -> dict[str, Dataset]:
    """The axes of which one log disagrees with the others, by a first model of all of them.

    The datasets hold which and how (``odd``); none where the logs do not tell a first model.
    """
    try:
        given = dict(logs_by_name(logs, Role.TRAINING.value))
        found = fit(shown_by(given, "machine", load_catalogue()), given).datasets
    except InputError:
        return {}
    return {axis: dataset for axis, dataset in found.items() if dataset.odd}


@parallel()
def fit(
    model: Model,
    logs: GivenLogs,
    holdout: GivenLogs | None = None,
    test: GivenLogs | None = None,
    *,
    catalogue: Catalogue | None = None,
    test_function: float | None = None,
    progress: Progress = silent,
) -> FitResult:
    """Identify the free parameters of a model's effects.

    logs, holdout, test: training, selection and test logs by name. catalogue: with it the result
    says which absent effects give the same force as a parameter that changed. test_function: length
    in s; chosen from the noise where None. Logs of a mechanism are read as its file needs them,
    which the result tells. Raises InputError for logs that do not fit the model, and where nothing
    can be fitted: an axis that comes to rest within every test function, a force that is not a
    number.
    """
    given = as_given(model, logs, holdout, test, catalogue)
    known = Catalogue([]) if catalogue is None else usable(catalogue, given.model)
    found = fit_as_given(given, known, test_function, progress)
    return replace(found, recording=given.recording)


def fit_as_given(
    logs: Given,
    known: Catalogue,
    test_function: float | None,
    progress: Progress,
    tried: Collection[Effect] = (),
) -> FitResult:
    """As ``fit`` says; tried: effects that are to be tried beside those of the model."""
    progress(READING, 0, 1)
    model = given = logs.model
    found = datasets(model, logs.training, logs.selection, test_function, logs.test)
    fits, intervals, refits, held, tested = {}, {}, {}, {}, {}
    for i, (axis, dataset) in enumerate([*found.items()]):
        progress("fitting", i, len(found))
        dataset = telling_beside(given.axes[axis], dataset, tried)
        found[axis], fits[axis] = dataset, done = _fitted(given.axes[axis], dataset)
        held[axis] = error_if_any(Role.SELECTION, done, dataset)
        tested[axis] = error_if_any(Role.TEST, done, dataset)
        intervals[axis] = estimates(done)
        refits[axis] = refit(given.axes[axis], done, known)
        model = model.with_axis(axis, done.axis)
        model = model.with_intervals(axis, intervals_to_keep(done, intervals[axis]))
        for used in (done, dataset):
            used.forget()  # the next axis needs the memory
    return FitResult(model, found, fits, intervals, held, tested, given, refits)


def _fitted(axis: AxisModel, dataset: Dataset) -> tuple[Dataset, Fit]:
    """The fit of an axis, and the dataset as it was found with it. Raises InputError."""
    require_residual(axis, dataset)
    dataset, fitted = fit_aligned(axis, dataset)
    dataset, fitted = with_own_noise(fitted, dataset)
    require_finite(fitted.residual, dataset)
    odd = odd_in(fitted.axis, dataset)
    return replace(dataset, odd=odd if odd and odd.is_sure else None), fitted


@parallel()
def fit_simulation(found: FitResult, *, progress: Progress = silent) -> SimulationFit:
    """Fit the motion that the model makes of the command alone, from a fit of the force residual.

    Over whole logs, without a restart (identify.estimation.simulated_motion). Raises InputError
    where that motion is not finite, or depends on another axis.
    """
    model, axes, held = found.model, {}, {}
    for i, (axis, dataset) in enumerate(found.datasets.items()):
        progress("fitting simulated motion", i, len(found.datasets))
        done = axes[axis] = fit_simulated_motion(found.fits[axis].axis, dataset.training)
        others = dataset.test or dataset.selection  # neither decides anything here
        both = (simulated_error(a, others) for a in (done.begun, done.axis))
        held[axis] = (next(both), next(both)) if others else None
        model = model.with_axis(axis, done.axis)
    return SimulationFit(model, found, axes, held)


@parallel()
def compare(
    model: Model,
    logs: GivenLogs,
    *,
    catalogue: Catalogue | None = None,
    test_function: float | None = None,
    progress: Progress = silent,
) -> Comparison:
    """The errors of a model with its present values, and where it fails. Raises InputError."""
    progress(READING, 0, 1)
    given = as_given(model, logs, catalogue=catalogue)
    model, axes = given.model, given.model.axes
    found = {
        axis: telling(dataset, sticks(axes[axis]))
        for axis, dataset in datasets(model, given.training, {}, test_function).items()
    }
    for axis, dataset in found.items():
        require_residual(axes[axis], dataset)
    found = {axis: noise_known(axes[axis], aligned(axes[axis], d)) for axis, d in found.items()}
    return replace(_compared(model, found, {}, progress), recording=given.recording)


@dataclass(frozen=True)
class Given:
    """A model, and the logs of each role by name as its file needs them.

    recording: how the logs of a mechanism were another than that; None where they were right.
    """

    model: MachineModel
    training: Mapping[str, Log]
    selection: Mapping[str, Log]
    test: Mapping[str, Log]
    recording: Recording | None


def as_given(
    model: Model,
    logs: GivenLogs,
    holdout: GivenLogs | None = None,
    test: GivenLogs | None = None,
    catalogue: Catalogue | None = None,
) -> Given:
    """A model and its logs, of whatever the caller has. Raises InputError."""
    others = [logs_by_name(g, r.value) for r, g in ((Role.SELECTION, holdout), (Role.TEST, test))]
    parts = [some_logs(logs, Role.TRAINING.value), *others]
    machine = as_model(model, catalogue)
    recording = _recording_of(machine, parts[0])
    training, selection, tests = (_read_as(recording, part) for part in parts)
    return Given(machine, training, selection, tests, recording)


def _compared(
    model: MachineModel,
    found: Mapping[str, Dataset],
    floors: Mapping[str, float],
    progress: Progress,
) -> Comparison:
    """The comparison on datasets that are prepared already; floors: N RMS, where known."""
    errors, drifts = position_errors(model, found, partial(progress, "comparing"))
    axes = {
        a: compare_axis(model, dataset, errors[a], drifts[a], floors.get(a))
        for a, dataset in found.items()
    }
    return Comparison(model, axes)


@parallel()
def side_by_side_of(found: Comparison) -> SideBySide:
    """Measured, model and what is left of the first log of a comparison; raises CannotRun."""
    name = next(log.motion.name for a in found.axes.values() for log in a.logs)
    parts = {
        axis: log for axis, one in found.axes.items() for log in one.logs if log.motion.name == name
    }
    return side_by_side(found.model, parts)


@parallel()
def diagnose(
    model: Model,
    logs: GivenLogs,
    holdout: GivenLogs | None = None,
    test: GivenLogs | None = None,
    *,
    catalogue: Catalogue | None = None,
    test_function: float | None = None,
    progress: Progress = silent,
) -> Diagnosis:
    """Fit the model, then find which effect of the catalogue it lacks. Raises InputError.

    Nonparametric effects of the model are removed first, so that their force can be explained. The
    test logs decide nothing; the errors that are reported are theirs.
    """
    catalogue = load_catalogue() if catalogue is None else catalogue
    model = as_model(model, catalogue)
    known = usable(catalogue, model)
    given = as_given(physics_alone(model), logs, holdout, test)
    result = fit_as_given(given, Catalogue([]), test_function, progress, [*known.values()])
    away = departures_of(result.model, result.fits, result.datasets, known, progress)
    # Of a mechanism the joints share their bodies, which were found at one length.
    lengths = TEST_FUNCTIONS if test_function is None and model.mjcf is None else ()

    def diagnosed(away: Departures, axis: str) -> AxisDiagnosis:
        every = away.offered(offered(result.given.axes[axis], result.datasets[axis], known), axis)
        of_axis = within(progress, f"diagnosis of {axis}")
        own = diagnose_axis(away.fits[axis], away.datasets[axis], every, of_axis, lengths)
        return away.with_ties(own)

    axes = dict(zip(away.fits, spread(partial(diagnosed, away), away.fits), strict=True))
    away, anew = away.asked_again(axes, progress)
    axes |= zip(anew, spread(partial(diagnosed, away), anew), strict=True)
    away = away.beside(
        {a: d.final for a, d in axes.items()}, {a: d.dataset for a, d in axes.items()}
    )
    axes = {a: d.beside(away.fits[a], away.datasets[a]) for a, d in axes.items()}
    progress("intervals and the next experiment", 0, 1)
    summaries = {axis: summary_of(d) for axis, d in axes.items()}
    model = _begun(result.model, axes, summaries)
    plans, not_planned = next_experiments(axes, model, test_function)
    prepared = result.datasets if away.bodies else {axis: d.dataset for axis, d in axes.items()}
    better = with_all_found(model, axes, summaries, away.bodies)
    comparing = partial(progress, "comparing with all that was found")
    return Diagnosis(
        fitted=model,
        axes=axes,
        comparison=_compared(model, prepared, {a: t.floor for a, t in summaries.items()}, progress),
        summaries=summaries,
        next_experiments=plans,
        refits={axis: refit(result.given.axes[axis], d.base, known) for axis, d in axes.items()},
        not_tried={a: not_tried(result.given, d, catalogue) for a, d in result.datasets.items()},
        not_planned=not_planned,
        left_over=_left_over(axes),
        bodies=away.bodies,
        disputed=away.disputed,
        recording=given.recording,
        model=better,
        free_runs={} if better is model else free_run_errors(better, prepared, comparing),
    )


def _left_over(axes: Mapping[str, AxisDiagnosis]) -> dict[str, Region]:
    """Where what is unexplained is largest, by axis."""
    regions = {a: worst_region(d.final, d.dataset) for a, d in axes.items() if d.unexplained}
    return {axis: region for axis, region in regions.items() if region}


def _recording_of(model: MachineModel, logs: Mapping[str, Log]) -> Recording | None:
    """How the logs of a mechanism are another than its file needs, by the first of them.

    One without a joint of it is refused where its motion is read.
    """
    if not model.joints:
        return None  # without reading a log, which each asking does
    first = next(iter(logs.values()))
    return misassigned(model, first) if {*model.joints} <= {*first.axes} else None


def _read_as(recording: Recording | None, logs: Mapping[str, Log]) -> Mapping[str, Log]:
    """Logs as they are read right."""
    return {n: recording.read(log) for n, log in logs.items()} if recording else logs


def _begun(
    model: MachineModel, axes: Mapping[str, AxisDiagnosis], summaries: Mapping[str, AxisSummary]
) -> MachineModel:
    """The fitted model that the answers start from: a diagnosis may find another channel delay."""
    for axis, found in axes.items():
        model = model.with_axis(axis, found.base.axis)
        model = model.with_intervals(axis, intervals_to_keep(found.base, summaries[axis].before))
    return model


@parallel()
def feedforward(
    model: Model,
    logs: GivenLogs,
    before: Model | None = None,
    *,
    machine: Model | None = None,
    catalogue: Catalogue | None = None,
    progress: Progress = silent,
) -> Feedforward:
    """The tracking error with the feedforward of a model, with that of one before, and without.

    In simulation, along the motion of the logs. machine: what is simulated, the model itself where
    None. Raises InputError, and CannotRun where the machine cannot be simulated.
    """
    read = as_given(model, logs, catalogue=catalogue)
    model, given = read.model, dict(read.training)  # each is read once
    before = None if before is None else as_model(before, catalogue)
    simulated = model if machine is None else as_model(machine, catalogue)
    moved = informative_logs(given, {name: unmoved(model, log) for name, log in given.items()})
    found = tracking(simulated, model, before, moved, progress)
    return Feedforward(model, before, tuple(moved), found)


@parallel()
def frequency_response(
    logs: GivenLogs,
    model: Model | None = None,
    *,
    catalogue: Catalogue | None = None,
    progress: Progress = silent,
) -> FrequencyResponse:
    """The response of position to force that logs show, with mass, resonances, delay and margins.

    The best linear approximation, with the setpoint as instrument; see identify.frequency. model:
    is simulated on the setpoints of the logs, and its response estimated in the same way. Raises
    InputError where no axis moves in all of the logs, or their sample rates differ.
    """
    given = dict(some_logs(logs))  # each is read once
    machine = None if model is None else as_model(model, catalogue)
    kept = informative_logs(given, {name: shortness(log) for name, log in given.items()})
    return FrequencyResponse(tuple(kept), responses_of(kept, machine, progress))


def on_machine(
    model: MachineModel,
    logs: GivenLogs,
    before: MachineModel | None = None,
    *,
    progress: Progress = silent,
) -> OnMachine:
    """The frequency response that logs show and the model makes, and what its feedforward gains.

    before: the model without what was found, if anything was. What the logs do not tell, and what
    the machine cannot run, is left out, with the reason.
    """
    given = logs_by_name(logs)
    jobs: dict[str, Callable[[], Any]] = {
        "response": partial(frequency_response, given, model, progress=progress)
    }
    if before is not None:
        jobs["worth"] = partial(feedforward, model, given, before, progress=progress)
    known: dict[str, Any] = {}
    left_out: dict[str, str] = {}
    for name, job in jobs.items():
        try:
            known[name] = job()
        except InputError as why:
            left_out[name] = str(why)
    return OnMachine(**known, left_out=left_out)


@parallel()
def agree(
    fit_a: FitResult | Model,
    fit_b: FitResult | Model,
    *,
    catalogue: Catalogue | None = None,
) -> Agreement:
    """Whether two fits agree within their uncertainties, and what makes the difference.

    fit_a, fit_b: results of `fit`, or models read from files that `twin fit` or `add` wrote.
    catalogue: effects that may be the cause; the package's own where None. Raises InputError where
    no parameter has an interval in both.
    """
    known = load_catalogue() if catalogue is None else catalogue
    models = (f.model if isinstance(f, FitResult) else f for f in (fit_a, fit_b))
    a, b = (as_model(model, known) for model in models)
    return agreement(a, b, known)
