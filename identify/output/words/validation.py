"""Sentences about where a model fails, and about the tests of its residual."""

from __future__ import annotations

from identify.output.words.numbers import PLAIN, Numbers
from identify.validation.misfit_maps import Region
from identify.validation.whiteness import Correlation, Loop
from twin.model.units import units_of

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


def region_in_words(region: Region, numbers: Numbers = PLAIN) -> str:
    """E.g. "position between 12 and 26 mm: 0.12 N RMS, 14 times the noise floor, ..."."""
    return (
        f"{_place(region, numbers)}: {numbers.amount(region.rms, region.force_unit)} RMS, "
        f"{numbers.ratio(region.ratio)} times the noise floor, {100 * region.share:.0f} % of the "
        "squared error"
    )


def _place(region: Region, numbers: Numbers) -> str:
    if region.coordinate == "standstill":
        return "at standstill" if region.low > 0.0 else "in motion"
    if region.coordinate == "direction":
        return "moving forwards" if region.low > -0.5 else "moving backwards"
    span = numbers.span(region.low, region.high, region.unit)
    coordinate = units_of(region.unit).words(region.coordinate.replace("_", " "))
    return f"{coordinate} between {span}"


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
        f"force residual against {other}: {100 * correlation.outside:.0f} % of the lags beyond the "
        f"90 % bounds of ±{correlation.bound:.2g}, {verdict}"
    )
