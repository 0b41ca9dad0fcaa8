"""Drag in proportion to the cube of the speed: F = -c v^3."""

from twin.curve import Coordinate, Curve
from twin.effect import OUT, Effect, Kind, Parameter, V


def law(p, s, io):
    io[OUT] = -p[0] * io[V] * io[V] * io[V]


EFFECT = Effect(
    kind=Kind.FORCE,
    summary="drag in proportion to the cube of the speed",
    equation="F = -c v^3",
    source="this project's choice",
    parameters=(Parameter("c", "N s^3/m^3", 0.0, 0.0, 1e6, "drag", strength=True),),
    law=law,
    curves=(Curve(Coordinate.SPEED, by_direction=True),),
    fingerprint="none",
    excited_by="any motion",
)
