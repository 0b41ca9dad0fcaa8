"""The JSON of fits, of comparisons of a model with logs, and of two fits."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from identify.estimation.confounded import Refit
from identify.estimation.intervals import Estimate
from identify.estimation.simulated_motion import MotionFit
from identify.output.answers import LOWER, Answer, Entry, answer_of, read
from identify.output.words.fit import (
    LOOPS,
    MOTION_OUTCOMES,
    OUTCOMES,
    no_interval_in_words,
    objectives_in_words,
    region_in_words,
)
from identify.results.results import Comparison, Feedforward, FitResult, SimulationFit, refitted
from identify.validation.agreement import Agreement, AxisAgreement
from identify.validation.comparison import AxisComparison
from identify.validation.misfit_maps import MisfitMap
from identify.validation.tracking import AxisTracking
from identify.validation.whiteness import Correlation
from twin.record import Number

# --- fits ------------------------------------------------------------------------------------


class EstimateEntry(Entry):
    """A value with its 90 % interval, or the reason why it has none."""

    value: Number
    unit: str
    free: bool
    interval_90: tuple[Number, Number] | None
    interval_refused: str | None


class FitEntry(Entry):
    """The fit of an axis: RMS force errors on the logs of each role, and the parameters."""

    outcome: str
    converged: bool
    at_bound: list[str]
    force_error: Number = read("error")
    noise_floor: Number = read("noise.known")
    holdout_force_error: Number
    test_force_error: Number
    unit: str = read("axis.units.force")
    left_out: list[str]
    """Logs that say nothing new of the axis: nothing at all, or they are copies of another."""
    force_noise: Number
    """Force that no sensor makes and nothing measured predicts, RMS."""
    force_shift: Number = read("channel_delay")
    force_shift_unit: str = "s"
    beginnings_left_out: dict[str, Number]
    beginnings_left_out_unit: str = "s"
    parameters: dict[str, EstimateEntry]
    refit: Refit | None


class ReadOtherwiseEntry(Entry):
    """How a recording is another than a mechanism's file needs; all else is of it as read so."""

    said: str
    axis: str
    """Of which it makes most."""
    before: Number
    """Part of its torque that bodies and friction leave as it is recorded."""
    after: Number
    """The same as it is read."""


class FitAnswer(Answer):
    """What `twin fit` prints."""

    objective: Literal["force"] = "force"
    axes: dict[str, FitEntry]
    not_fitted: list[str]
    """Axes of which no training log says anything."""
    left_out: list[str] = Field([])
    """Logs that say nothing of an axis, and why."""
    recording: ReadOtherwiseEntry | None
    """Of a mechanism, in what its recording is another than its file needs."""


@answer_of.register
def _(result: FitResult, **more: Any) -> FitAnswer:
    axes = {
        axis: FitEntry.of(
            fit,
            result.datasets[axis],
            outcome=fit.axis.units.words(OUTCOMES[fit.ended]),
            converged=fit.ended.name != "NOT_CONVERGED",
            holdout_force_error=result.holdout_error[axis],
            test_force_error=result.test_error[axis],
            left_out=list(result.left_out[axis]),
            beginnings_left_out=result.datasets[axis].begun,
            parameters=estimate_entries(result.estimates[axis]),
            refit=result.refits[axis],
        )
        for axis, fit in result.fits.items()
    }
    recording = ReadOtherwiseEntry.of(result.recording) if result.recording else None
    rest = list(result.not_fitted)
    return FitAnswer(axes=axes, not_fitted=rest, recording=recording, **more)


def estimate_entries(estimates: tuple[Estimate, ...]) -> dict[str, EstimateEntry]:
    """Estimates by their labels."""
    return {
        e.label: EstimateEntry.of(
            e,
            interval_90=None if e.low is None else (e.low, e.high),
            interval_refused=e.reason and no_interval_in_words(e.reason),
        )
        for e in estimates
    }


# --- fits of simulated motion ----------------------------------------------------------------


class SimulatedValueEntry(Entry):
    """A parameter, and what the fit of the force had found."""

    value: Number
    force_fit: Number
    unit: str


class BeginningEntry(Entry):
    """Where the simulated motion of a log begins."""

    time: Number
    time_unit: str = "s"
    position: Number
    position_unit: str
    velocity: Number
    velocity_unit: str


class SimulationFitEntry(Entry):
    """The fit of an axis to simulated motion: RMS position errors, before and after."""

    outcome: str
    converged: bool
    position_error: Number = read("error")
    position_error_of_force_fit: Number = read("error_begun")
    holdout_position_error: Number
    holdout_position_error_of_force_fit: Number
    unit: str = read("axis.units.position")
    errors_of_starts: list[Number]
    parameters: dict[str, SimulatedValueEntry]
    beginnings: dict[str, BeginningEntry]


class SimulationFitAnswer(Answer):
    """What `twin fit --objective simulation` prints."""

    objective: Literal["simulation"] = "simulation"
    axes: dict[str, SimulationFitEntry]
    not_fitted: list[str] = read("force.not_fitted")
    objectives_disagree: list[str]
    """A sentence for each parameter that the two objectives give far apart."""
    left_out: list[str] = Field([])


@answer_of.register
def _(result: SimulationFit, **more: Any) -> SimulationFitAnswer:
    axes = {axis: _motion_fit(fit, result.holdout_error[axis]) for axis, fit in result.axes.items()}
    return SimulationFitAnswer.of(
        result, axes=axes, objectives_disagree=objectives_in_words(result), **more
    )


def _motion_fit(fit: MotionFit, held: tuple[float, float] | None) -> SimulationFitEntry:
    units = fit.axis.units
    before, after = held or (None, None)
    return SimulationFitEntry.of(
        fit,
        outcome=MOTION_OUTCOMES[fit.outcome],
        converged=fit.outcome.name != "NOT_CONVERGED",
        holdout_position_error=after,
        holdout_position_error_of_force_fit=before,
        parameters={
            c.label: {"value": now, "force_fit": begun, "unit": units(c.parameter.unit)}
            for c, begun, now in refitted(fit)
        },
        beginnings={
            log.motion.name: BeginningEntry.of(
                begun,
                time=begun.first * log.motion.sample_period,
                position_unit=units.position,
                velocity_unit=units("m/s"),
            )
            for log, begun in zip(fit.logs, fit.beginnings, strict=True)
        },
    )


# --- whether two fits agree ------------------------------------------------------------------


class AgreementAnswer(Answer):
    """What `twin agree` prints."""

    a: str | None = None
    b: str | None = None
    agree: bool
    axes: dict[str, AxisAgreement]
    not_compared: list[str]


@answer_of.register
def _(result: Agreement, **more: Any) -> AgreementAnswer:
    return AgreementAnswer.of(result, **more)


# --- feedforward -----------------------------------------------------------------------------


class FeedforwardAnswer(Answer):
    """What `twin feedforward` prints."""

    logs: list[str]
    axes: dict[str, AxisTracking]


@answer_of.register
def _(result: Feedforward, **more: Any) -> FeedforwardAnswer:
    return FeedforwardAnswer.of(result, **more)


# --- comparisons -----------------------------------------------------------------------------


class LogErrorsEntry(Entry):
    """The RMS errors of a log; those of the position are null of imposed motion."""

    force_error: Number
    force_unit: str
    force_ratio: Number
    position_error: Number | None
    position_unit: str
    position_ratio: Number | None


class HistogramEntry(Entry):
    """How the force residual is distributed."""

    edges: list[Number]
    unit: str
    density: list[Number]
    density_unit: str
    normal_rms: Number = read("floor")
    share_within_90: Number


class ResidualTestsEntry(Entry):
    """Whether the force residual is noise."""

    tested: str
    loop: Annotated[Literal["open", "closed", "unknown"], LOWER] = read("loop.name")
    reason: str
    samples: int
    passed: bool
    histogram: HistogramEntry
    correlations: dict[str, Correlation]


class ComparisonEntry(Entry):
    """The errors of an axis, by log and by region."""

    logs: dict[str, LogErrorsEntry]
    noise_floor: Number = read("floor")
    position_drift_of_noise: dict[str, Number]
    regions: dict[str, MisfitMap]
    worst: list[str]
    residual_tests: ResidualTestsEntry


class ComparisonAnswer(Answer):
    """What `twin compare` prints."""

    axes: dict[str, ComparisonEntry]
    left_out: list[str] = Field([])
    recording: ReadOtherwiseEntry | None
    """Of a mechanism, in what its recording is another than its file needs."""


@answer_of.register
def _(result: Comparison, **more: Any) -> ComparisonAnswer:
    recording = ReadOtherwiseEntry.of(result.recording) if result.recording else None
    axes = {a: _comparison(c) for a, c in result.axes.items()}
    return ComparisonAnswer.of(axes=axes, recording=recording, **more)


def _comparison(c: AxisComparison) -> ComparisonEntry:
    t, units = c.tests, c.units
    return ComparisonEntry.of(
        c,
        logs={name: _log_errors(c, name) for name in c.force_error},
        regions={m.coordinate: m for m in c.maps},
        worst=[region_in_words(r) for r in c.worst],
        residual_tests=ResidualTestsEntry.of(
            t,
            tested=units.words("force residual"),
            reason=units.words(LOOPS[t.loop]),
            histogram=HistogramEntry.of(t, unit=units.force, density_unit=units("1/N")),
            correlations={one.signal: one for one in t.correlations},
        ),
    )


def _log_errors(c: AxisComparison, log: str) -> LogErrorsEntry:
    force, position = c.force_error[log], c.position_error.get(log)
    return LogErrorsEntry(
        force_error=force,
        force_unit=c.units.force,
        force_ratio=force / c.floor,
        position_error=position,
        position_unit=c.units.position,
        position_ratio=position and position / max(c.position_drift_of_noise[log], 1e-300),
    )
