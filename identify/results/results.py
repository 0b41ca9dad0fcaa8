"""The results of fit, compare and diagnose; ``print`` shows the text of the command."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from identify.analysis.recording import Recording
from identify.dataset.dataset import Dataset, Role
from identify.dataset.noise_floor import NoiseFloor, floor_of, known_floor
from identify.estimation.confounded import MovedParameter, Refit, moved_parameters
from identify.estimation.errors import Errors, error_if_any, error_in, error_on
from identify.estimation.evidence import rms
from identify.estimation.fit import Fit
from identify.estimation.intervals import Estimate, estimates, intervals_to_keep
from identify.estimation.offered import NotTried
from identify.estimation.simulated_motion import MotionFit
from identify.experiment_design.plan import Plan
from identify.mechanism.bodies import WrongBody, corrected
from identify.printed import Pictured, Printed
from identify.results.frequency import FrequencyResponse
from identify.selection.acceptance import left_on
from identify.selection.diagnosis import AxisDiagnosis, Verdict
from identify.selection.findings import FindingKind
from identify.validation.comparison import AxisComparison
from identify.validation.misfit_maps import Region
from identify.validation.tracking import AxisTracking
from twin.effect import Effect
from twin.model.machine import HistoryStep, MachineModel
from twin.model.parameters import ParameterReference, free_parameters, read


@dataclass(frozen=True, eq=False, repr=False)
class FitResult(Printed):
    """A fitted machine: by axis the fit, the estimates, and the RMS force errors on other logs.

    holdout_error, test_error: on the selection and on the test logs; None where there are none.
    given: the model before the fit. refits: what the fit changed of it, by axis. recording: how the
    logs of a mechanism are another than its file needs; all is of them so read.
    """

    model: MachineModel
    datasets: Mapping[str, Dataset]
    fits: Mapping[str, Fit]
    estimates: Mapping[str, tuple[Estimate, ...]]
    holdout_error: Mapping[str, float | None]
    test_error: Mapping[str, float | None]
    given: MachineModel
    refits: Mapping[str, Refit]
    recording: Recording | None = None

    @property
    def left_out(self) -> Mapping[str, Mapping[str, str]]:
        """By axis, the logs that say nothing new of it, with why."""
        return {axis: dataset.left_out for axis, dataset in self.datasets.items()}

    @property
    def not_fitted(self) -> tuple[str, ...]:
        """Axes of the model of which no training log says anything."""
        return tuple(axis for axis in self.model.axes if axis not in self.fits)


def refitted(fit: MotionFit) -> Iterator[tuple[ParameterReference, float, float]]:
    """Each parameter with its value by the fit of the force, and by this one."""
    where = free_parameters(fit.axis)
    values = (read(axis, where).tolist() for axis in (fit.begun, fit.axis))
    return zip(where, *values, strict=True)


@dataclass(frozen=True, eq=False, repr=False)
class SimulationFit(Printed):
    """A machine fitted to the motion of whole logs, by axis, from a fit of the force residual.

    holdout_error: by axis, RMS position error over the test logs, else the selection logs, before
    and after, begun as measured; None where there are none.
    """

    model: MachineModel
    force: FitResult
    axes: Mapping[str, MotionFit]
    holdout_error: Mapping[str, tuple[float, float] | None]

    @property
    def disagreeing(self) -> tuple[tuple[str, str, float, float], ...]:
        """Axis, label, value of the force fit and of this one, where they are far apart.

        Of parameters that cannot be negative: of others, such as a phase, a ratio says nothing.
        """
        # times, by which the values of two objectives differ where one of them is wrong
        disagree = 2.0
        return tuple(
            (axis, c.label, before, after)
            for axis, fit in self.axes.items()
            for c, before, after in refitted(fit)
            if c.parameter.lower >= 0.0 and not before <= disagree * after <= disagree**2 * before
        )


@dataclass(frozen=True, eq=False, repr=False)
class Comparison(Pictured):
    """The errors of a model on logs, by axis.

    recording: how the logs of a mechanism are another than its file needs; all is of them so read.
    """

    model: MachineModel
    axes: Mapping[str, AxisComparison]
    recording: Recording | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Feedforward(Printed):
    """What the feedforward of a model is worth on the motion of logs, by axis that moves there.

    before: the model whose feedforward it is compared with; None where none was given.
    """

    model: MachineModel
    before: MachineModel | None
    logs: tuple[str, ...]
    axes: Mapping[str, AxisTracking]


@dataclass(frozen=True, eq=False)
class OnMachine:
    """What a model says of the loop of its machine; None where the logs do not tell it.

    response: of position to force, measured and modelled. worth: of the model's feedforward.
    left_out: by the name of one of these, why it is not told.
    """

    response: FrequencyResponse | None = None
    worth: Feedforward | None = None
    left_out: Mapping[str, str] = field(default_factory=dict)


UNTOLD = OnMachine()


@dataclass(frozen=True)
class LogErrors:
    """RMS force errors (N) in one log without what was found and with it.

    seconds: that were looked at. floor: noise floor of the logs of its role, N.
    """

    name: str
    role: Role
    seconds: float
    before: float
    after: float
    floor: float


@dataclass(frozen=True)
class AxisSummary:
    """The final model of an axis, and how it differs from the one that was fitted before.

    before, after: estimates without and with what was found. moved: parameters that what was found
    changed. tested, chosen: errors without and with it on the test logs and on those that chose.
    floors: noise floor of the final model on the logs of each role, N RMS, the only one that is
    told: of what is known to make noise, and never more than what the model leaves there. beyond:
    by role, error of the final model on logs that were not fitted, over all noise that they may
    have. noise: the floor on the training logs with its parts. by_log: the errors in each log.
    """

    before: tuple[Estimate, ...]
    after: tuple[Estimate, ...]
    moved: tuple[MovedParameter, ...]
    tested: Errors
    chosen: Errors
    floors: Mapping[Role, float]
    beyond: Mapping[Role, float] = field(default_factory=dict)
    noise: NoiseFloor | None = None
    by_log: tuple[LogErrors, ...] = ()

    @property
    def floor(self) -> float:
        """Noise floor on the training logs, N RMS."""
        return self.floors[Role.TRAINING]


def summary_of(found: AxisDiagnosis) -> AxisSummary:
    """The summary of a diagnosis."""
    base, final, dataset = found.base, found.final, found.dataset
    floors, beyond = {Role.TRAINING: final.noise.known}, dict[Role, float]()
    for role in (Role.SELECTION, Role.TEST):
        if logs := dataset.having(role):
            floors[role] = known_floor(final.axis, logs, np.nan_to_num(left_on(final, logs)))
            beyond[role] = error_in(role, final, dataset) / floor_of(final.axis, logs)
    before = estimates(base)
    return AxisSummary(
        before=before,
        after=before if final is base else estimates(final),
        moved=() if final is base else moved_parameters(base, final),
        tested=found.tested,
        chosen=found.chosen,
        floors=floors,
        beyond=beyond,
        noise=final.noise,
        by_log=tuple(_errors_by_log(found, floors)),
    )


def _errors_by_log(found: AxisDiagnosis, floors: Mapping[Role, float]) -> Iterator[LogErrors]:
    base, final = found.base.axis, found.final.axis
    for role in Role:
        for log in found.dataset.having(role):
            left = error_on(base, [log])
            if not len(left):  # at rest, or where no training log has been
                continue
            before = rms(left)
            after = before if final is base else rms(error_on(final, [log]))
            seconds = len(log.motion.time) * log.motion.period
            yield LogErrors(log.motion.name, role, seconds, before, after, floors[role])


@dataclass(frozen=True, eq=False, repr=False)
class Diagnosis(Pictured):
    """Diagnoses by axis; the answer is that of the axis with the strongest evidence.

    fitted: the model with the values of the fit before anything was found. summaries: of each axis.
    next_experiments: for an axis whose diagnosis is ambiguous, the experiment that decides.
    refits: what fitting changed of the given model, by axis. not_tried: by axis, effects of the
    catalogue that it lacks and that could not be tried on it, and why. not_planned: for an
    ambiguous axis without next experiment, why the machine can run none. left_over: for an axis
    with a remainder, where that is largest. bodies: of a mechanism, those whose inertia is not
    that of its file, the one that explains most first; the diagnoses are with them as found.
    disputed: bodies of which the logs tell each another change, and those logs; then none is found.
    recording: how the logs of a mechanism are another than its file needs; all is of them so read.
    model: with everything that was found, fitted together, and how its errors fell. free_runs: its
    free-running position error, axis -> training log -> m RMS; none where nothing was found.
    """

    fitted: MachineModel
    axes: Mapping[str, AxisDiagnosis]
    comparison: Comparison
    summaries: Mapping[str, AxisSummary]
    next_experiments: Mapping[str, Plan] = field(default_factory=dict)
    refits: Mapping[str, Refit] = field(default_factory=dict)
    not_tried: Mapping[str, Mapping[str, NotTried]] = field(default_factory=dict)
    not_planned: Mapping[str, str] = field(default_factory=dict)
    left_over: Mapping[str, Region] = field(default_factory=dict)
    bodies: tuple[WrongBody, ...] = ()
    disputed: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    recording: Recording | None = None
    model: MachineModel = field(kw_only=True)
    free_runs: Mapping[str, Mapping[str, float]] = field(default_factory=dict)

    @property
    def body(self) -> WrongBody | None:
        """That of the bodies which explains most."""
        return next(iter(self.bodies), None)

    @property
    def leading(self) -> AxisDiagnosis:
        """The axis that the answer is about."""
        order = [Verdict.NOTHING_MISSING, Verdict.UNEXPLAINED, Verdict.WRONG_SHAPE]
        order += [Verdict.MISSING_EFFECTS]

        def weight(d: AxisDiagnosis) -> tuple[bool, int, float]:
            bic = d.ranking[0].delta_bic if d.ranking else 0.0
            return d.best is not None, order.index(d.verdict), bic if d.best else d.base.ratio

        return max(self.axes.values(), key=weight)

    @property
    def effect(self) -> Effect | None:
        """The effect that is named, if any."""
        best = self.leading.best
        return best.effect if best else None


def with_all_found(
    fitted: MachineModel,
    axes: Mapping[str, AxisDiagnosis],
    summaries: Mapping[str, AxisSummary],
    bodies: Sequence[WrongBody] = (),
) -> MachineModel:
    """A fitted model with everything that was found, and how its errors fell; see Diagnosis."""
    model = fitted
    if bodies and model.joints:
        fits = {axis: found.base for axis, found in axes.items()}
        model = corrected(model, bodies, fits, f"{model.name}_corrected.xml")
    for axis, found in axes.items():
        if found.findings:
            mass = model.axes[axis].mass if bodies else found.final.axis.mass
            better = replace(found.final.axis, mass=mass)
            model = model.with_axis(axis, found.dataset.kept_in(better))
            after = summaries[axis].after
            model = model.with_intervals(axis, intervals_to_keep(found.final, after))
            model = model.with_history(*_steps_of(found))
    return model


def _steps_of(found: AxisDiagnosis) -> Iterator[HistoryStep]:
    """What a diagnosis did to the errors, for each law that it added or changed."""
    bent = (FindingKind.WRONG_SHAPE, FindingKind.WRONG_VALUE)
    changed = {f.effect: f.kind in bent for f in found.findings}
    return steps_together(changed, found.base, found.final, found.dataset)


def steps_together(
    changed: Mapping[str, bool], before: Fit, after: Fit, dataset: Dataset
) -> Iterator[HistoryStep]:
    """A step for each law of an axis that was changed, with the errors without and with all.

    changed: by name of the law, whether it was there and got another shape or value.
    """
    errors = step_errors(before, after, dataset)
    for name, is_shape in changed.items():
        others = ", ".join(other for other in changed if other != name)
        notes = (f"together with {others}; the errors are those of all",) if others else ()
        action = "shape" if is_shape else "add"
        yield HistoryStep(action, name, dataset.axis, **errors, notes=notes)


def step_errors(before: Fit, after: Fit, dataset: Dataset) -> dict[str, Any]:
    """The errors of a step on the logs of each role, with their unit."""
    return {
        "fit_error_before": before.error,
        "fit_error_after": after.error,
        "holdout_error_before": error_if_any(Role.SELECTION, before, dataset),
        "holdout_error_after": error_if_any(Role.SELECTION, after, dataset),
        "test_error_before": error_if_any(Role.TEST, before, dataset),
        "test_error_after": error_if_any(Role.TEST, after, dataset),
        "unit": after.axis.units.force,
    }
