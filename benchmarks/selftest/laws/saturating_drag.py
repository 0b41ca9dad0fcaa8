"""Drag that levels off with speed: F = -c tanh(v / knee)."""

from math import tanh

from twin.curve import Coordinate, Curve
from twin.effect import OUT, Effect, Kind, Parameter, V


def law(p, s, io):
    io[OUT] = -p[0] * tanh(io[V] / p[1])


EFFECT = Effect(
    kind=Kind.FORCE,
    summary="drag that levels off with speed",
    equation="F = -c tanh(v/knee)",
    source="this project's choice",
    parameters=(
        Parameter("c", "N", 0.0, 0.0, 1e3, "drag", strength=True),
        Parameter("knee", "m/s", 0.06, 1e-3, 1.0, "speed where it levels off"),
    ),
    law=law,
    curves=(Curve(Coordinate.SPEED, by_direction=True),),
    fingerprint="none",
    excited_by="any motion",
)
