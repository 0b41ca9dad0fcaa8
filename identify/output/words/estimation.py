"""Sentences about fits: how one ended, why a value has no interval, a channel delay."""

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
from identify.output.words.numbers import PLAIN, Numbers
from twin.model.units import AxisUnits, units_of

WORTH_SAYING = 0.05  # part of a held-out log beyond the fit logs that a reader should know of
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

HALF = 0.15  # samples, within which a shift of half a sample is told as such


def outcome_in_words(outcome: Outcome) -> str:
    """How a fit ended."""
    return OUTCOMES[outcome]


def motion_fit_in_words(axis: str, fit: MotionFit, held: tuple[float, float] | None) -> list[str]:
    """The position error before and after, how the search ended, and what it does not say."""
    unit = fit.axis.units.position
    said = (
        f"axis {axis}: fitted to simulated motion without a restart: position error "
        f"{fit.error_begun:.4g} {unit} with the force fit, {fit.error:.4g} {unit} now"
    )
    if held is not None:
        said += f"; held out {held[0]:.4g} {unit}, {held[1]:.4g} {unit} now"
    starts = ", ".join(f"{error:.3g}" for error in fit.starts)
    worse = held is not None and held[1] > held[0]
    return [
        said,
        *([HELD_OUT_GREW] if worse else []),
        MOTION_OUTCOMES[fit.outcome],
        f"position errors of the searches from {len(fit.starts)} starts when the best was chosen: "
        f"{starts} {unit}",
        "no intervals: the error of a motion that nothing restarts is one long drift, whose "
        "scatter says little; `twin fit` without --objective gives them",
    ]


HELD_OUT_GREW = (
    "The held-out error grew, so the force fit is the better one: the noise of the measured "
    "command or what the model lacks adds up to a drift, and the parameters have followed it."
)
MOTION_OUTCOMES = {
    Outcome.CONVERGED: "The fit converged: no parameter change lowers the position error further.",
    Outcome.NOT_CONVERGED: OUTCOMES[Outcome.NOT_CONVERGED],
}


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
            words = units_of(unit).words
            why = (
                f"the {words('force error')} {error:.3g} {unit} is {error / floor:.1f} times the "
                f"noise floor {floor:.3g} {unit}, so the model is wrong by more than noise"
            )
        case NotExcited():
            why = "the motion in these logs does not excite the parameter"
        case Inseparable(label):
            why = f"these data cannot separate it from {label}"
        case OpenSided(side):
            why = f"a {side.name.lower()} value fits as well; the motion does not reach it"
    return f"no interval: {why}"


def prepared_in_words(dataset: Dataset) -> tuple[str, ...]:
    """What was done to the logs before they were fitted, that a reader should know."""
    shifted, words = channel_delay_in_words(dataset), dataset.units.words
    own = dataset.force_noise
    noise = (
        f"axis {dataset.axis}: the noise floor holds {own:.4g} {dataset.units.force} of "
        f"{words('force')} that nothing measured foretells, beside what sensors make: noise of the "
        "drive or of what surrounds it"
    )
    return (
        *((shifted,) if shifted else ()),
        *((noise,) if own else ()),
        *(
            f"{log}: the first {end:.2g} s of axis {dataset.axis} are left out, as its "
            f"{words('force')} there fits nothing that follows: the axis did not yet move freely. "
            "Cut the log, or begin it in motion"
            for log, end in dataset.begun.items()
        ),
        *(
            f"{log}: a {_role_of(log, dataset)} log, but {100 * part:.0f} % of it lies at "
            f"positions of axis {dataset.axis} where no fit log has been; there it tests nothing "
            "and is left out"
            for log, part in dataset.beyond.items()
            if part > WORTH_SAYING
        ),
    )


def _role_of(log: str, dataset: Dataset) -> str:
    """What a log beside the fit logs is given for."""
    return "test" if log in [own.motion.name for own in dataset.test] else "held-out"


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
        f"axis {dataset.axis}: the {words('force')} acts {1e6 * dataset.channel_delay:.0f} us "
        f"({samples:.2f} samples) before its time stamp, {why}"
    )


def aliasing_in_words(noise: NoiseFloor, units: AxisUnits, numbers: Numbers = PLAIN) -> str | None:
    """That thinning the log made most of its noise, and what to log; None where it did not."""
    folded = noise.parts.get("aliasing", 0.0)
    if folded**2 < 0.5 * noise.value**2 or folded == 0.0:
        return None
    return (
        f"{numbers.amount(folded, units.force)} of the noise floor of "
        f"{numbers.amount(noise.value, units.force)} is the command's fast part, which the log "
        "keeps only every few samples of the controller: log at the control rate, or the drive's "
        "averaged current"
    )
