"""Sentences about the reproduced result."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from identify.output.words.numbers import with_unit
from identify.thesis.cable import CableOfLogs, CableResult
from identify.thesis.chapter import Recovered
from identify.thesis.printed import ROLLER_PITCH
from identify.thesis.residuals import ResidualResult
from identify.thesis.simulation import STATIC, SimulationResult
from identify.thesis.track import Along, TrackResult

Array = NDArray[np.float64]

ALLOWED = 1e-3  # of the planted value, by which a mean may be off


def recovered_in_words(name: str, r: Recovered) -> str:
    """One parameter: planted, found and printed."""
    printed = "" if r.printed is None else f", thesis {r.printed:.7g}"
    return (
        f"{name}: planted {with_unit(f'{r.true:.7g}', r.unit)}, found {r.mean:.7g} +- {r.sd:.1g} "
        f"({100.0 * r.error:+.4f} %){printed}"
    )


def worst(result: SimulationResult) -> tuple[str, Recovered]:
    """The parameter whose mean is furthest from the planted value, in parts of it."""
    return max(result.parameters.items(), key=lambda item: abs(item[1].error))


def simulation_headline(result: SimulationResult) -> str:
    """Whether every mean is as near to the planted value as it should be."""
    name, r = worst(result)
    if abs(r.error) <= ALLOWED:
        return f"Every mean is within {100.0 * ALLOWED:g} % of the planted value"
    return f"The mean of {name} is more than {100.0 * ALLOWED:g} % from the planted value"


def simulation_in_words(result: SimulationResult) -> list[str]:
    """The largest error of a mean, the printed one, and what the cost reacts to."""
    name, r = worst(result)
    said = [
        f"of the means of {result.trials} trials at {result.snr:g} dB none is further than "
        f"{100.0 * abs(r.error):.2g} % from the planted value ({name})"
    ]
    printed = {
        k: p.printed / p.true - 1.0 for k, p in result.parameters.items() if p.printed is not None
    }
    if printed:
        furthest = max(printed, key=lambda k: abs(printed[k]))
        said.append(
            f"of the thesis's printed means {furthest} is furthest: "
            f"{100.0 * printed[furthest]:+.2f} %"
        )
    most, least = reactions(result)
    said.append(f"of the static parameters the cost reacts most to {most}, least to {least}")
    return said


def reactions(result: SimulationResult) -> tuple[str, str]:
    """The static parameters to which the force on the map reacts most and least."""
    ends = {p: float(result.sensitivity.force[p].max()) for p in STATIC}
    return max(ends, key=lambda p: ends[p]), min(ends, key=lambda p: ends[p])


def cable_in_words(result: CableResult) -> list[str]:
    """How well the cable's force was recovered, and the pitch of the spikes."""
    said = [
        f"cable force from {result.repeats} passes each way: {result.rms_error:.2g} N RMS from the "
        f"planted one, at most {result.largest_error:.2g} N; {100.0 * result.within_band:.0f} % of "
        "it inside its 90 % band",
        f"with the spikes left in, as in the thesis: {result.rms_error_with_all:.2g} N RMS",
    ]
    if result.pitch is None or result.found.pitch is None:
        return [*said, "fewer than three spikes were found, so there is no pitch"]
    return [
        *said,
        f"{len(result.found.spikes)} spikes, pitch {1e3 * result.pitch.mean:.4f} +- "
        f"{1e3 * result.found.pitch.standard_error:.2g} mm "
        f"(planted {1e3 * result.pitch.true:g} mm)",
    ]


def cable_of_logs_in_words(result: CableOfLogs) -> list[str]:
    """The cable's force, its band, and the pitch of the spikes, of a real machine."""
    found = result.found
    said = [
        f"cable force from {len(found.passes.alike)} passes each way over "
        f"{1e3 * np.ptp(found.position):.0f} mm: {found.force.min():.4g} to "
        f"{found.force.max():.4g} N, 90 % band +- {np.median(found.band):.2g} N (median)"
    ]
    if found.pitch is None:
        return [*said, "fewer than three spikes were found, so there is no pitch"]
    return [
        *said,
        f"{len(found.spikes)} spikes, pitch {1e3 * found.pitch.value:.4f} +- "
        f"{1e3 * found.pitch.standard_error:.2g} mm (the thesis's stage: "
        f"{1e3 * ROLLER_PITCH:g} mm)",
    ]


def track_in_words(result: TrackResult) -> list[str]:
    """How far the levels found are from those planted, by the thesis's way and by ours."""
    said = []
    for way, by_direction in (("the curve through the map", result.maps), ("the fit", result.fits)):
        for name in LEVELS:
            both = [found[name] for found in by_direction.values()]
            off = max(a.largest_error for a in both)
            held = sum(float(a.within) for a in both) / len(both)
            said.append(
                f"by {way} {name} is within {100.0 * off:.2g} % of the planted level at "
                f"{len(result.places)} places; {100.0 * held:.0f} % of the 90 % intervals hold it"
            )
    for name in ("v0", "sigma2"):
        slopes = [trend(result.places, found[name]) for found in result.fits.values()]
        seen = any(abs(slope) > TREND * error for slope, error in slopes)
        said.append(f"along the track {name} shows {'a' if seen else 'no'} trend")
    return [
        *said,
        "the map's own intervals hold its scatter, not that bristles which have not settled brake "
        "less",
    ]


LEVELS = ("Fc", "Fs")
TREND = 3.0  # standard errors of a slope, from which there is a trend


def trend(places: Array, found: Along) -> tuple[float, float]:
    """Slope of a parameter along the track, per m, and its standard error by the scatter."""
    if len(places) < 4:
        return 0.0, 1.0
    (slope, _), spread = np.polyfit(places, found.found, 1, cov=True)
    return float(slope), float(np.sqrt(spread[0, 0]))


def residuals_in_words(result: ResidualResult) -> list[str]:
    """What the tests say of the first friction, what the diagnosis names, and what is left."""
    white = {True: "white", False: "not white"}
    named = ", ".join(result.named) or "nothing"
    return [
        f"with {result.first} fitted to a machine with {result.planted} the test error is "
        f"{result.error_before:.3g} N, {result.error_before / result.floor:.1f} times the noise "
        f"floor, and its residual is {white[result.before.passes]}",
        f"the diagnosis names {named} ({result.verdict.name.lower().replace('_', ' ')})",
        f"with it the test error is {result.error_after:.3g} N, "
        f"{result.error_after / result.floor:.2f} times the noise floor, and the residual is "
        f"{white[result.after.passes]}",
    ]
