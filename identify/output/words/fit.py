"""Sentences about fits and comparisons of fits, about residuals, and about planned experiments."""

from __future__ import annotations

from collections.abc import Sequence

from identify.dataset.dataset import Dataset
from identify.dataset.floor import NoiseFloor
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
from identify.estimation.simulated_motion import MotionFit
from identify.experiment_design.candidate_experiments import NotRun
from identify.experiment_design.discrimination import SimulatedExperiment
from identify.experiment_design.missing_excitation import Gap
from identify.experiment_design.plan import Plan
from identify.experiment_design.rival_hypotheses import STRENGTH
from identify.output.numbers import Scale, change, number, percent, quantity, spaced, span
from identify.validation.agreement import AxisAgreement, Difference
from identify.validation.misfit_maps import Region
from identify.validation.whiteness import Correlation, Loop
from twin.experiments.file import in_short
from twin.model.units import AxisUnits, units_of

# --- how a fit ended -------------------------------------------------------------------------

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
    Outcome.CONVERGED: "The fit converged: no parameter change lowers the position error further.",
    Outcome.NOT_CONVERGED: OUTCOMES[Outcome.NOT_CONVERGED],
}
HELD_OUT_GREW = (
    "The error on logs that were not fitted grew, so the force fit is the better one: the noise of "
    "the measured command or what the model lacks adds up to a drift, and the parameters have "
    "followed it."
)


def outcome_in_words(outcome: Outcome) -> str:
    """How a fit ended."""
    return OUTCOMES[outcome]


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
    scale = Scale.of(unit, fit.starts)
    starts = ", ".join(number(error / scale.size) for error in fit.starts)
    return [
        said,
        *([HELD_OUT_GREW] if held is not None and held[1] > held[0] else []),
        MOTION_OUTCOMES[fit.outcome],
        f"position errors of the searches from {len(fit.starts)} starts when the best was chosen: "
        f"{starts} {scale.unit}",
        "no intervals: the error of a motion that nothing restarts is one long drift, whose "
        "scatter says little; `twin fit` without --objective gives them",
    ]


# --- values and intervals --------------------------------------------------------------------


def common_reason(found: Sequence[Estimate]) -> NoInterval | None:
    """Why a fit has no intervals at all; None where it has."""
    reasons = (e.reason for e in found)
    return next((r for r in reasons if isinstance(r, AlwaysAtRest | ModelWrong)), None)


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


def estimate_in_words(e: Estimate, common: NoInterval | None = None) -> tuple[str, str]:
    """A value with its unit; its 90 % interval, or why it has none. common: said of all already."""
    scale = Scale.of(e.unit, [e.value])
    if not e.free:
        return scale.text(e.value), "fixed"
    if e.low is None or e.high is None:
        why = no_interval_in_words(e.reason) if e.reason and e.reason != common else ""
        return scale.text(e.value), why
    low, value, high = scale.within(e.low, e.high, e.low, e.value, e.high)
    return f"{value} {scale.unit}".rstrip(), f"{low} to {high}"


# --- what was done to the logs ---------------------------------------------------------------

WORTH_SAYING = 0.05  # part of a log beyond the training logs that a reader should know of
HALF = 0.15  # samples, within which a shift of half a sample is told as such


def prepared_in_words(dataset: Dataset) -> tuple[str, ...]:
    """What was done to the logs before they were fitted, that a reader should know."""
    shifted, words = channel_delay_in_words(dataset), dataset.units.words
    own = dataset.force_noise
    noise = (
        f"axis {dataset.axis}: the noise floor holds {quantity(own, dataset.units.force)} of "
        f"{words('force')} that nothing measured foretells, beside what sensors make: noise of the "
        "drive or of what surrounds it"
    )
    return (
        *((shifted,) if shifted else ()),
        *((noise,) if own else ()),
        *(
            f"{log}: the first {quantity(end, 's')} of axis {dataset.axis} are left out, as its "
            f"{words('force')} there fits nothing that follows: the axis did not yet move freely. "
            "Cut the log, or begin it in motion"
            for log, end in dataset.begun.items()
        ),
        *(
            f"{log}: a {_role_of(log, dataset)} log, but {percent(part)} of it lies at positions "
            f"of axis {dataset.axis} where no training log has been; there it tests nothing and is "
            "left out"
            for log, part in dataset.beyond.items()
            if part > WORTH_SAYING
        ),
    )


def _role_of(log: str, dataset: Dataset) -> str:
    """What a log beside the training logs is given for."""
    return "test" if log in [own.motion.name for own in dataset.test] else "selection"


def channel_delay_in_words(dataset: Dataset) -> str | None:
    """By how much the force channel was corrected, or None."""
    if dataset.channel_delay == 0.0:
        return None
    samples = dataset.channel_delay / dataset.fit[0].motion.sample_period
    words = dataset.units.words
    why = (
        f"which no drive can do; the log was corrected. Check how {words('force and position')} "
        "are sampled"
    )
    if abs(samples - 0.5) < HALF:
        why = (
            f"as where {words('force and position')} are read at the same instant, while a command "
            "would be held over the sample; the log was corrected"
        )
    return (
        f"axis {dataset.axis}: the {words('force')} acts {1e6 * dataset.channel_delay:.0f} µs "
        f"({samples:.2f} samples) before its time stamp, {why}"
    )


def aliasing_in_words(noise: NoiseFloor, units: AxisUnits) -> str | None:
    """That thinning the log made most of its noise, and what to log; None where it did not."""
    folded = noise.parts.get("aliasing", 0.0)
    if folded**2 < 0.5 * noise.value**2 or folded == 0.0:
        return None
    return (
        f"{quantity(folded, units.force)} of the noise floor of "
        f"{quantity(noise.value, units.force)} is the command's fast part, which the log keeps "
        "only every few samples of the controller: log at the control rate, or the drive's "
        "averaged current"
    )


# --- where a model fails, and whether its residual is noise ----------------------------------

_WHITENESS = (
    " Only the force residual is tested for whiteness: a simulated-position residual is coloured "
    "even when the model is right"
)
_ONE_STEP = ", and a one-step-ahead residual is small even when the model is wrong."

LOOPS = {
    Loop.CLOSED: (
        "Closed loop: feedback carries position noise into the force. The free run therefore uses "
        "the logged command, and the residual is tested only against earlier values of command "
        f"and speed.{_WHITENESS}{_ONE_STEP}"
    ),
    Loop.OPEN: (
        "Open loop: the command does not depend on the measurement noise, so the residual is "
        f"tested against it at all lags.{_WHITENESS}{_ONE_STEP}"
    ),
    Loop.UNKNOWN: (
        "The logs hold no setpoint, so the loop is assumed to be closed: feedback may carry "
        "position noise into the force, and the residual is tested only against earlier values of "
        f"command and speed.{_WHITENESS}."
    ),
}


def loop_in_words(loop: Loop) -> str:
    """Which residual is tested against what, and why."""
    return LOOPS[loop]


def region_in_words(region: Region) -> str:
    """E.g. "position between 12.3 and 25.7 mm: 121 mN RMS, 14.3 times the noise floor, ..."."""
    return (
        f"{place_in_words(region)}: {quantity(region.rms, region.force_unit)} RMS, "
        f"{number(region.ratio)} times the noise floor, {percent(region.share)} of the squared "
        "error"
    )


def place_in_words(region: Region) -> str:
    """Where a region is."""
    if region.coordinate == "standstill":
        return "at standstill" if region.low > 0.0 else "in motion"
    if region.coordinate == "direction":
        return "moving forwards" if region.low > -0.5 else "moving backwards"
    coordinate = units_of(region.unit).words(spaced(region.coordinate))
    return f"{coordinate} between {span(region.low, region.high, region.unit)}"


def correlation_in_words(correlation: Correlation) -> str:
    """E.g. "force residual against command: 12 % of the lags beyond the 90 % bounds, ..."."""
    other = "its own past" if correlation.signal == "residual" else correlation.signal
    reach = f"±{correlation.limit:.2g} that chance can reach"
    verdict = (
        f"none beyond the {reach}"
        if correlation.passes
        else f"some beyond the {reach}, so the residual is not noise"
    )
    return (
        f"force residual against {other}: {percent(correlation.outside)} of the lags beyond the "
        f"90 % bounds of ±{correlation.bound:.2g}, {verdict}"
    )


# --- planned experiments ---------------------------------------------------------------------


def in_order(plan: Plan) -> list[SimulatedExperiment]:
    """The chosen experiment, then those that can be run, by falling evidence."""
    chosen, *others = plan.ranking
    runnable = (t for t in others if t.not_run is None)
    return [chosen, *sorted(runnable, key=lambda t: -t.gain)]


def question_in_words(plan: Plan) -> str:
    """What an experiment is to decide, and whether one can."""
    what = " or ".join(plan.between)
    if len(plan.between) < 2:
        return f"the parameters of {what}, best constrained by"
    if plan.decides:
        return f"{what}, decided by"
    return f"{what}, not decided by any experiment of this length; the nearest is"


def experiment_in_words(t: SimulatedExperiment, plan: Plan) -> str:
    """Which experiment it is, how long it takes, and what it is expected to show.

    Only the leading ones are refitted, and the best of these is chosen: one with more evidence than
    the chosen has it from one linear step.
    """
    tail = f"{number(t.gain)} nats of information on the parameters"
    if len(plan.between) > 1:
        linear = " by one linear step" if t.gain > plan.chosen.gain else ""
        what = "expected evidence (difference of BIC)" if t is plan.chosen else "evidence"
        tail = f"{what} {number(t.gain)}{linear}, {_rival(t)}"
    return f"{in_short(t.experiment, t.units)}; takes {quantity(t.duration, 's')}: {tail}"


def _rival(t: SimulatedExperiment) -> str:
    """What the explanation that is wrong would leave."""
    return (
        f"the rival leaves {quantity(t.difference, t.units.force)} RMS unexplained, "
        f"{number(t.difference / t.floor)} times the noise floor"
    )


def next_step_in_words(plan: Plan) -> str:
    """The experiment that an ambiguous diagnosis asks for, in one paragraph."""
    what = "decides" if plan.decides else "comes nearest to deciding, but is too short"
    return (
        f"The experiment that {what} (twin plan writes it): "
        f"{in_short(plan.chosen.experiment, plan.chosen.units)}; "
        f"takes {quantity(plan.chosen.duration, 's')}. There {_rival(plan.chosen)}; "
        f"{gap_in_words(plan.gap)}."
    )


def supposed_in_words(plan: Plan) -> str | None:
    """What is assumed of the explanations where there are no logs; None where there are some."""
    if not plan.supposed or len(plan.between) < 2:
        return None
    if any(name in plan.excited_by for name in plan.between):
        return (
            "no logs given: each effect that the model lacks is assumed at "
            f"{STRENGTH:g} times the noise floor"
        )
    return "no logs given: the models are compared with the values in their files"


def gap_in_words(gap: Gap) -> str:
    """Which motion the logs lack."""
    scale = Scale.of(gap.unit, [gap.low, gap.high])
    low, high = (number(value / scale.size) for value in (gap.low, gap.high))
    where = f"{gap.feature} {low} to {high} {scale.unit}".rstrip()
    if gap.share is None:
        return f"the explanations differ most at {where}"
    held = f"{100.0 * gap.share:.1f} % of the data is there"
    if gap.missing:
        return f"missing motion: {where}; {held}"
    return f"no motion is missing, but more of it is needed at {where}; {held}"


def not_run_in_words(not_run: NotRun) -> str:
    """Which experiment cannot be run, and why."""
    truth = f" (with {not_run.truth})" if not_run.truth else ""
    return f"{in_short(not_run.experiment, not_run.units)}: {not_run.reason}{truth}"


# --- whether two fits agree ------------------------------------------------------------------


def agreement_in_words(axis: str, found: AxisAgreement) -> str:
    """Whether two fits of an axis agree."""
    total, differing = len(found.differences), len(found.differing)
    if not differing:
        return f"axis {axis}: the fits agree in all {total} parameters that can be compared"
    return f"axis {axis}: the fits differ in {differing} of {total} parameters"


def difference_in_words(d: Difference) -> str:
    """One parameter that differs."""
    first, second = change(d.a, d.b, d.unit)
    return (
        f"{d.label} differs by {quantity(d.b - d.a, d.unit)} ({first} and {second}), "
        f"{number(abs(d.ratio))} joint standard errors; allowed are {number(d.limit)}"
    )


def causes_in_words(found: AxisAgreement) -> list[str]:
    """What the difference amounts to, what would make it, and what the answer is worth.

    Nothing where the fits agree.
    """
    words = units_of(found.unit).words
    only = (("first", found.only_a), ("second", found.only_b))
    said = [f"only the {which} fit has {', '.join(names)}" for which, names in only if names]
    if found.force is not None:
        force = quantity(found.force, found.unit)
        said.append(f"the parameters that differ amount to {force} RMS")
        if not found.causes:
            said.append(words("no absent effect with linear parameters has such a force"))
        said += [
            f"{' or '.join([c.effect, *c.alike])} would make {percent(c.share)} of this "
            f"difference ({words('squared force')})"
            for c in found.causes
        ]
    if found.of_wrong_models:
        first, second = found.above_floor
        said.append(
            f"the errors are {first:.1f} and {second:.1f} times the noise floor: the model is "
            "wrong, so this tells whether the machines are alike, not whether the values are right"
        )
    if found.not_compared:
        said.append(f"not compared, for lack of an interval: {', '.join(found.not_compared)}")
    return said
