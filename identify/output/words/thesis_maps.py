"""Sentences about velocity-friction maps of a real machine."""

from __future__ import annotations

from identify.estimation.map_curve import LINE, NAMES, speeds_of
from identify.thesis.maps_of_logs import MapOfLogs, TrackOfLogs

SIDES = {1.0: "forwards", -1.0: "backwards"}
UNITS = dict(zip(NAMES, ("N", "N", "m/s", "N s/m"), strict=True))


def map_in_words(found: MapOfLogs) -> list[str]:
    """How many speeds, the curve of each direction, and which parameters differ by direction."""
    count = len(found.map)
    speeds = {way: len(speeds_of(found.map.towards(way))) for way in SIDES}
    said = [
        f"{count} plateaus at {speeds[1.0]} speeds forwards and {speeds[-1.0]} backwards",
        *(f"{side}: {_parameters(found, way)}" for way, side in SIDES.items()),
    ]
    if any(tuple(curve.half) == LINE for curve in found.curves.values()):
        said.append(
            "a straight line of Coulomb and viscous friction is drawn where these speeds show no "
            "Stribeck curve"
        )
    apart = differing(found)
    names = ", ".join(apart)
    return [*said, f"by direction {names} differ{'s' if len(apart) == 1 else ''} by more than the "
            "intervals" if apart else "the directions are alike within the intervals"]  # fmt: skip


def _parameters(found: MapOfLogs, way: float) -> str:
    curve = found.curves[way]
    return ", ".join(
        f"{n} {value:.4g} +- {curve.half[n]:.1g} {found.units(UNITS[n])}"
        for n, value in curve.values.items()
    )


def differing(found: MapOfLogs) -> list[str]:
    """Parameters whose two intervals, by direction, do not meet."""
    ahead, back = (found.curves[way] for way in SIDES)
    return [
        n for n in ahead.half
        if n in back.half and abs(ahead.values[n] - back.values[n]) > ahead.half[n] + back.half[n]
    ]  # fmt: skip


def map_headline(found: MapOfLogs) -> str:
    """The parameters, the mean of both directions."""
    values = ", ".join(f"{n} {v:.4g} {found.units(UNITS[n])}" for n, v in found.both.items())
    return f"Friction at constant speed: {values}"


def track_of_logs_in_words(found: TrackOfLogs) -> list[str]:
    """The level of dry friction from end to end."""
    said = []
    for way, side in SIDES.items():
        levels = [m.curves[way].values["Fc"] for m in found.maps]
        said.append(
            f"{side} Fc is {min(levels):.4g} to {max(levels):.4g} {found.maps[0].units('N')} at "
            f"{len(found.places)} places"
        )
    return said
