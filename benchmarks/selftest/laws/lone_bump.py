"""One bump on the track, the same both ways: F = a exp(-((x - place) / width)^2)."""

from math import exp

from twin.curve import Coordinate, Curve
from twin.effect import OUT, Effect, Kind, Parameter, X


def law(p, s, io):
    r = (io[X] - p[1]) / p[2]
    io[OUT] = p[0] * exp(-min(r * r, 40.0))


EFFECT = Effect(
    kind=Kind.FORCE,
    summary="one bump on the track",
    equation="F = a exp(-((x - place)/width)^2)",
    source="this project's choice",
    parameters=(
        Parameter("a", "N", 0.0, -1e3, 1e3, "height", strength=True),
        Parameter("place", "m", 0.0, -1.0, 1.0, "where it is"),
        Parameter("width", "m", 0.012, 1e-3, 0.1, "half width at 1/e"),
    ),
    law=law,
    curves=(Curve(Coordinate.POSITION),),
    fingerprint="none",
    excited_by="any motion",
)
