"""Drag that grows with the square of speed: F = -c v |v| (air, or lubricant churning).

Turbulent drag law, e.g. F. M. White, Fluid Mechanics, 7th ed., section 7.6.
"""

from twin.curve import Coordinate, Curve
from twin.effect import OUT, Effect, Kind, Parameter, V


def law(p, s, io):
    io[OUT] = -p[0] * io[V] * abs(io[V])


EFFECT = Effect(
    kind=Kind.FORCE,
    summary="drag proportional to the square of speed",
    equation="F = -c v |v|",
    source="White, Fluid Mechanics, section 7.6",
    parameters=(Parameter("c", "N s^2/m^2", 0.0, 0.0, 1e6, "drag coefficient", strength=True),),
    law=law,
    curves=(Curve(Coordinate.SPEED, by_direction=True),),
    fingerprint="residual curves with speed: nothing at low speed, much at high speed",
    excited_by="passes at several speeds, up to the highest",
)
