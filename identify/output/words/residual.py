"""Sentences about the force residual: where it is, on what it depends, whether it is noise."""

from __future__ import annotations

import numpy as np

from identify.estimation.residual_dependence import Dependence, Repeat
from identify.output.numbers import number, percent, quantity, spaced, span
from identify.validation.misfit_maps import Region
from identify.validation.whiteness import Correlation, Loop
from twin.model.units import units_of

LEAST_SHARE = 0.005  # of a squared error that is not printed as 0 %


def region_in_words(region: Region) -> str:
    """E.g. "moving backwards: 121 mN RMS, 14.3 times the noise floor, 37 % of the ...".

    Beside the share of the error that of the time, or of a band that of the squared force: regions
    are in the order of the difference.
    """
    rms, share = quantity(region.rms, region.force_unit), percent(region.share)
    over = f"{number(region.ratio)} times the noise floor"
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
    coordinate = units_of(region.unit).words(spaced(region.coordinate))
    return f"{coordinate} between {span(region.low, region.high, region.unit)}"


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
        f"{percent(dependence.share_of_error)} of the squared error{period}."
    )


def repeat_in_words(repeat: Repeat) -> str:
    """E.g. "a force repeats every 2.5 mm: 1.0 N in run, 0.9 N in pulses; ..."."""
    units, words = repeat.units, repeat.units.words
    sizes = ", ".join(f"{quantity(a, units.force)} in {n}" for n, a in repeat.amplitude.items())
    turns = np.degrees(np.ptp(np.unwrap(list(repeat.phase.values()))))
    return (
        f"a {words('force')} repeats every {quantity(repeat.period, units.position)} of travel "
        f"({sizes}), but its phase differs between the logs by {turns:.0f} degrees: it is present "
        f"in each log, but no function of {words('position')} holds for all of them, so no effect "
        "is named"
    )


# Which residual is tested against what, and why.
EARLIER = "so the residual is tested only against earlier values of command and speed"
LOOPS = {
    Loop.CLOSED: (
        f"Closed loop: feedback carries position noise into the force, {EARLIER}; the free run "
        "uses the logged command."
    ),
    Loop.OPEN: (
        "Open loop: the command does not depend on the measurement noise, so the residual is "
        "tested against it at all lags."
    ),
    Loop.UNKNOWN: (
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
        f"{what}: {percent(correlation.outside)} of the lags exceed the 90 % bounds of "
        f"±{correlation.bound:.2g} (noise alone: 10 %)"
    )
    reach = f"exceeds ±{correlation.limit:.2g}, the most that noise reaches"
    if correlation.passes:
        return f"{said}, none {reach}"
    return f"{said}, and the largest {reach}: the residual is not noise"
