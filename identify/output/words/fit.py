"""Sentences about fits: how they ended, values, changes, what they leave, whether two agree."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from identify.dataset.dataset import Dataset, Role
from identify.dataset.noise_floor import NoiseFloor
from identify.estimation.confounded import MovedParameter, ParameterShift, Refit
from identify.estimation.fit import Outcome
from identify.estimation.intervals import (
    AlwaysAtRest,
    Estimate,
    Inseparable,
    ModelWrong,
    NoInterval,
    NotExcited,
    OpenSided,
)
from identify.estimation.residual_dependence import Dependence, Repeat, Varying
from identify.estimation.simulated_motion import MotionFit
from identify.output.numbers import (
    DisplayUnit,
    arrow,
    change,
    each_with_unit,
    number,
    percent,
    quantity,
    spaced,
    span,
)
from identify.output.words.odd import odd_in_words
from identify.results.results import FitResult, SimulationFit
from identify.selection.nonparametric import followed
from identify.validation.agreement import AxisAgreement, Difference
from identify.validation.misfit_maps import Region
from identify.validation.whiteness import Correlation, Feedback
from twin.model.machine import Fitted
from twin.model.units import AxisUnits, units_of

LEAST_SHARE = 0.005  # of a squared error that is not printed as 0 %

# --- how a fit ended --------------------------------------------------------------------------

OUTCOMES = {
    Outcome.CONVERGED: "The fit converged: no parameter change lowers the force error further.",
    Outcome.NOT_CONVERGED: (
        "The fit did not converge within the allowed number of evaluations; start from nearer "
        "values or fix some parameters."
    ),
    Outcome.AT_BOUND: (
        "The fit converged with a parameter at its bound; the data favour a value beyond it."
    ),
}
MOTION_OUTCOMES = {
    ended: said.replace("force error", "position error") for ended, said in OUTCOMES.items()
}
HELD_OUT_GREW = (
    "The error on logs that were not fitted grew, so the force fit is the better one: noise of the "
    "command, or what the model lacks, adds up to a drift that the parameters have followed."
)


def over_floor(unit: str, floor: float, *errors: float) -> str:
    """E.g. "noise floor 12.7 mN (ratio 4.04)", in the unit of the errors before it."""
    ratio = " -> ".join(f"{error / floor:.2f}" for error in errors)
    return f"noise floor {DisplayUnit.of(unit, errors).text(floor)} (ratio {ratio})"


def fit_in_words(result: FitResult, axis: str) -> Iterator[str]:
    """What is said of the fit of an axis before its parameters."""
    fit = result.fits[axis]
    unit, words = fit.axis.units.force, fit.axis.units.words
    others = {Role.SELECTION: result.holdout_error[axis], Role.TEST: result.test_error[axis]}
    known = {role: e for role, e in {Role.TRAINING: fit.error, **others}.items() if e is not None}
    scale = DisplayUnit.of(unit, fit.error)
    errors = (f"on the {role.value} logs {scale.text(e)}" for role, e in known.items())
    floor = over_floor(unit, fit.noise.known, fit.error)
    yield f"axis {axis}: {words('force error')} {', '.join(errors)}, {floor}"
    yield words(OUTCOMES[fit.ended])
    yield from (f"at its bound: {label}" for label in fit.at_bound)
    yield from prepared_in_words(result.datasets[axis])
    yield from (f"{name} is left out: {why}" for name, why in result.left_out[axis].items())
    if changed := refit_in_words(result.refits[axis]):
        yield changed
    if common := common_reason(result.estimates[axis]):
        yield no_interval_in_words(common)


def motion_fit_in_words(axis: str, fit: MotionFit, held: tuple[float, float] | None) -> list[str]:
    """The position error before and after, how the search ended, and what it does not say.

    held: before and after, on logs that were not fitted.
    """
    unit = fit.axis.units.position
    said = (
        f"axis {axis}: fitted to simulated motion without a restart: position error "
        f"{quantity(fit.error_begun, unit)} with the force fit, {quantity(fit.error, unit)} now"
    )
    if held is not None:
        first, after = (quantity(error, unit) for error in held)
        said += f"; on logs that were not fitted {first}, {after} now"
    scale = DisplayUnit.of(unit, fit.errors_of_starts)
    starts = ", ".join(number(error / scale.size) for error in fit.errors_of_starts)
    return [
        said,
        *([HELD_OUT_GREW] if held is not None and held[1] > held[0] else []),
        MOTION_OUTCOMES[fit.outcome],
        f"position errors of the searches from {len(fit.errors_of_starts)} starts when the best "
        f"was chosen: {starts} {scale.unit}",
        "no intervals: the error of a motion that nothing restarts is one long drift, whose "
        "scatter says little; `twin fit` without --objective gives them",
    ]


def objectives_in_words(result: SimulationFit) -> list[str]:
    """A sentence for each parameter that the two objectives give far apart."""
    said = []
    for axis, label, before, after in result.disagreeing:
        own = result.axes[axis].axis
        effect, _, name = label.rpartition(".")
        unit = own.parameter_units(effect)[name] if effect else own.units.mass
        said.append(
            f"alarm: axis {axis}: {label} is {after:.4g} {unit}, and {before:.4g} {unit} by the "
            "fit of the force; where two objectives disagree so, the model lacks something or "
            "the logs do not tell the parameter: use neither value before `twin diagnose` has "
            "said which"
        )
    return said


# --- values and intervals ---------------------------------------------------------------------


def common_reason(found: Sequence[Estimate]) -> NoInterval | None:
    """Why a fit has no intervals at all; None where it has."""
    common = (e.reason for e in found if isinstance(e.reason, AlwaysAtRest | ModelWrong))
    return next(common, None)


def no_interval_in_words(reason: NoInterval) -> str:
    """Why a value has no interval."""
    match reason:
        case AlwaysAtRest():
            why = "the axis comes to rest within every test function of these logs"
        case ModelWrong(error, floor, unit):
            why = (
                f"the {units_of(unit).words('force error')} {quantity(error, unit)} is "
                f"{error / floor:.1f} times the noise floor {quantity(floor, unit)}, so the model "
                "is wrong by more than noise"
            )
        case NotExcited():
            why = "the motion in these logs does not excite the parameter"
        case Inseparable(label):
            why = f"these data cannot separate it from {label}"
        case OpenSided(side):
            why = f"a {side.name.lower()} value fits as well; the motion does not reach it"
    return f"no interval: {why}"


def estimate_in_words(e: Estimate) -> tuple[str, str]:
    """A value with its unit; its 90 % interval, or why it has none."""
    wide = 0.0 if e.low is None or e.high is None else 0.05 * (e.high - e.low)  # far beyond it
    scale = DisplayUnit.of(e.unit, [e.value, wide])
    if not e.free:
        return scale.text(e.value), "fixed"
    if e.low is None or e.high is None:
        return scale.text(e.value), no_interval_in_words(e.reason) if e.reason else ""
    low, value, high = scale.within(e.low, e.high, e.low, e.value, e.high)
    return f"{value} {scale.unit}".rstrip(), f"{low} to {high}"


def nonparametric_in_words(fitted: Fitted) -> str:
    """What a nonparametric effect depends on, and that it is no physical law."""
    used = followed(fitted)
    what = f"depends on {', '.join(used)}" if used else "found nothing to depend on"
    return (
        f"{fitted.effect.name} is a fitted curve, not a physical law: it {what}, and is valid only "
        "within the motion of the training logs"
    )


# --- what was done to the logs ----------------------------------------------------------------


def prepared_in_words(dataset: Dataset) -> tuple[str, ...]:
    """What was done to the logs before they were fitted, that a reader should know."""
    words, tests = dataset.units.words, {log.motion.name for log in dataset.test}
    said = [words(delay)] if (delay := channel_delay_in_words(dataset)) else []
    if own := dataset.force_noise:
        said.append(
            f"{quantity(own, dataset.units.force)} of {words('force')} is left that nothing "
            "measured predicts and no sensor makes. Its origin is not known: it counts as noise, "
            "of the drive or of its surroundings"
        )
    if dataset.looks > 1:
        said.append(
            f"the {words('force')} is averaged over {quantity(dataset.test_function_length, 's')}: "
            "a length asked besides, as it shows what the one hides that the noise asks for; a "
            "model that is written keeps it, other commands tell the same errors with "
            f"--test-function {dataset.length:g}"
        )
    if dataset.odd:
        said.append(odd_in_words(dataset))
    said += [
        f"{log}: the first {quantity(end, 's')} are left out, as their {words('force')} fits "
        "nothing that follows: the axis did not yet move freely. Cut the log, or begin it in motion"
        for log, end in dataset.begun.items()
    ]
    said += [
        f"{log}: {percent(part)} of this {'test' if log in tests else 'selection'} log is left "
        "out: it lies at positions where no training log has been"
        for log, part in dataset.beyond.items()
        if part > 0.05  # part of a log beyond the training logs that a reader should know of
    ]
    said += [
        f"{log}: {percent(part)} of this log is left out: its {words('force')} stays at its "
        "extreme there, where the motion asks for more: record the force that acts"
        for log, part in dataset.clipped.items()
    ]
    return tuple(said)


def channel_delay_in_words(dataset: Dataset) -> str | None:
    """By how much the force channel was corrected, or None."""
    if dataset.channel_delay == 0.0:
        return None
    samples = dataset.channel_delay / dataset.training[0].motion.sample_period
    why = "no drive can do that, so check how force and position are sampled"
    if abs(samples - 0.5) < 0.15:  # samples, within which a shift of half a sample is told as such
        why = "force and position seem to be read at the same instant"
    return (
        f"the force acts {quantity(dataset.channel_delay, 's')} ({samples:.2f} samples) before its "
        f"time stamp, and was moved by as much: {why}"
    )


MOSTLY = {
    "aliasing": (
        "the command's fast part, of which the log keeps single samples: log at the control rate, "
        "or the drive's averaged current"
    ),
    "path": (
        "what its friction makes of the path that the readings do not tell: log at a higher rate, "
        "or with a finer encoder"
    ),
}


def noise_in_words(noise: NoiseFloor, units: AxisUnits) -> str | None:
    """What made most of its noise, and what to log; None where that is no matter of logging."""
    most = max(MOSTLY, key=lambda part: noise.parts.get(part, 0.0))
    size = noise.parts.get(most, 0.0)
    if size**2 < 0.5 * noise.value**2 or size == 0.0:
        return None
    floor = quantity(noise.value, units.force)
    return f"{quantity(size, units.force)} of the noise floor of {floor} is {MOSTLY[most]}"


# --- what a fit changed -----------------------------------------------------------------------


def change_in_words(change: ParameterShift) -> str:
    """E.g. "mass 15 -> 15.6 kg changes the force by 0.57 N (payload_mass gives the same force)"."""
    force = units_of(change.force_unit).words("force")
    values = arrow(change.before, change.after, change.unit)
    size = quantity(change.force, change.force_unit)
    said = f"{change.parameter} {values} changes the {force} by {size}"
    if not change.same_force_as:
        return said
    verb = "give" if len(change.same_force_as) > 1 else "gives"
    return f"{said} ({' and '.join(change.same_force_as)} {verb} the same {force})"


def refit_in_words(refit: Refit) -> str | None:
    """What fitting changed of the given model, or None where its values were good."""
    if not refit.changed:
        return None
    error = units_of(refit.force_unit).words("force error")
    before, after = each_with_unit(refit.force_error_as_given, refit.force_error, refit.force_unit)
    changes = ", ".join(map(change_in_words, refit.changed))
    return f"with the given values the {error} is {before}, after the fit {after}: {changes}"


def moved_in_words(moved: MovedParameter) -> str:
    """How a parameter of the base changed when an effect was added."""
    values = f"from {' to '.join(change(moved.before, moved.after, moved.unit))}"
    if moved.collapsed:
        return f"{moved.label} collapsed {values}: it had taken over the missing effect's force"
    return f"{moved.label} moved {values}: more than its uncertainty"


# --- whether two fits agree -------------------------------------------------------------------


def agreement_in_words(axis: str, found: AxisAgreement) -> str:
    """Whether two fits of an axis agree."""
    total = len(found.parameters)
    if found.differing:
        return f"axis {axis}: the fits differ in {len(found.differing)} of {total} parameters"
    return f"axis {axis}: the fits agree in all {total} parameters that can be compared"


def difference_in_words(label: str, d: Difference) -> str:
    """One parameter that differs."""
    first, second = change(d.a, d.b, d.unit)
    return (
        f"{label} differs by {quantity(d.difference, d.unit)} ({first} and {second}), "
        f"{number(abs(d.in_standard_errors))} joint standard errors; allowed are {number(d.limit)}"
    )


def causes_in_words(found: AxisAgreement) -> list[str]:
    """What the difference amounts to, what would make it, and what the answer is worth.

    Nothing where the fits agree.
    """
    words = units_of(found.force_unit).words
    only = (("first", found.only_in_a), ("second", found.only_in_b))
    said = [f"only the {which} fit has {', '.join(names)}" for which, names in only if names]
    if found.force is not None:
        force = quantity(found.force, found.force_unit)
        said.append(f"the parameters that differ amount to {force} RMS")
        if not found.causes:
            said.append(words("no absent effect with linear parameters has such a force"))
        said += [
            f"{' or '.join([c.effect, *c.or_])} would make {percent(c.share)} of this "
            f"difference ({words('squared force')})"
            for c in found.causes
        ]
    if found.of_wrong_models:
        first, second = found.error_over_noise_floor
        said.append(
            f"the errors are {first:.1f} and {second:.1f} times the noise floor: the model is "
            "wrong, so this tells whether the machines are alike, not whether the values are right"
        )
    if found.not_compared:
        said.append(f"not compared, for lack of an interval: {', '.join(found.not_compared)}")
    return said


# --- what a model leaves: where, on what it depends, whether it is noise -----------------------


def region_in_words(region: Region) -> str:
    """E.g. "moving backwards: 121 mN RMS, 14.3 times the noise floor, 37 % of the ...".

    Beside the share of the error that of the time, or of a band that of the squared force: regions
    are in the order of the difference.
    """
    rms, share = quantity(region.error, region.unit), percent(region.share_of_error)
    over = f"{number(region.over_noise_floor)} times the noise floor"
    of = "squared force" if region.coordinate == "frequency" else "time"
    part = f"{share} of the squared error in {percent(region.visited)} of the {of}"
    return f"{place_in_words(region)}: {rms} RMS, {over}, {part}"


def worst_in_words(region: Region) -> str:
    """E.g. "It is largest at position between 12.3 and 25.7 mm: ..."."""
    at = "" if region.coordinate in ("standstill", "direction") else "at "
    return f"It is largest {at}{region_in_words(region)}."


def place_in_words(region: Region) -> str:
    """Where a region is."""
    if region.coordinate == "standstill":
        return "at standstill" if region.low > 0.0 else "in motion"
    if region.coordinate == "direction":
        return "moving forwards" if region.low > -0.5 else "moving backwards"
    coordinate = units_of(region.coordinate_unit).words(spaced(region.coordinate))
    return f"{coordinate} between {span(region.low, region.high, region.coordinate_unit)}"


def dependence_in_words(dependence: Dependence) -> str:
    """On which coordinate an unexplained error depends, and its period where it has one."""
    if dependence.share_of_error < LEAST_SHARE:
        return "The error depends on nothing that was measured."
    period = ""
    if dependence.period is not None:
        period = f", with a period of {quantity(dependence.period, dependence.unit)}"
    on = units_of(dependence.unit).words(spaced(dependence.depends_on))
    return (
        f"The error depends most on {on}, which accounts for "
        f"{percent(dependence.share_of_error)} of the squared error{period}"
        f"{VARIES[dependence.varies] if dependence.varies else ''}."
    )


VARIES = {
    Varying.INERTIA: ", as of an inertia that changes with it",
    Varying.GAIN: ", as of a motor's gain that changes with it",
}


def repeat_in_words(repeat: Repeat) -> str:
    """E.g. "a force repeats every 2.5 mm: 1.0 N in run, 0.9 N in pulses; ..."."""
    words = units_of(repeat.unit).words
    sizes = ", ".join(f"{quantity(a, repeat.unit)} in {n}" for n, a in repeat.amplitude.items())
    turns = np.ptp(np.unwrap(list(repeat.phase.values())))
    apart = 2.0 * np.sin(0.5 * min(turns, np.pi)) >= Repeat.same  # of two that are alike in size
    other = f"phase differs between the logs by {np.degrees(turns):.0f} degrees"
    return (
        f"a {words('force')} repeats every {quantity(repeat.period, repeat.period_unit)} of travel "
        f"({sizes}), but its {other if apart else 'size differs between the logs'}: it is present "
        f"in each log, but no function of {words('position')} holds for all of them, so no effect "
        "is named"
    )


# Which residual is tested against what, and why.
EARLIER = "so the residual is tested only against earlier values of command and speed"
LOOPS = {
    Feedback.CLOSED: (
        f"Closed loop: feedback carries position noise into the force, {EARLIER}; the free run "
        "uses the logged command."
    ),
    Feedback.OPEN: (
        "Open loop: the command does not depend on the measurement noise, so the residual is "
        "tested against it at all lags."
    ),
    Feedback.UNKNOWN: (
        "The logs hold no setpoint, so the loop is taken to be closed: feedback may carry position "
        f"noise into the force, {EARLIER}."
    ),
}


def correlation_in_words(correlation: Correlation) -> str:
    """E.g. "correlation of the force residual with command: 12 % of the lags exceed ..."."""
    what = "autocorrelation of the force residual"
    if correlation.signal != "residual":
        what = f"correlation of the force residual with {correlation.signal}"
    said = (
        f"{what}: {percent(correlation.share_outside)} of the lags exceed the 90 % bounds of "
        f"±{correlation.bound_90:.2g} (noise alone: 10 %)"
    )
    reach = f"exceeds ±{correlation.limit_all_99:.2g}, the most that noise reaches"
    if correlation.passed:
        return f"{said}, none {reach}"
    return f"{said}, and the largest {reach}: the residual is not noise"
