"""Drag that grows with the square of speed: F = -c v |v| (air, or lubricant churning).

Turbulent drag law, e.g. F. M. White, Fluid Mechanics, 7th ed., section 7.6. The exponent n is 2 by
design; where turbulence has not set in, or a lubricant thins with shear, it is another.
"""

from math import copysign

from twin.curve import Coordinate, Curve
from twin.effect import LEAST, MOST, OUT, Effect, Kind, Parameter, V


def law(p, s, io):
    ratio = abs(io[V]) / p[2]
    power = ratio * ratio if p[1] == 2.0 else ratio ** p[1]
    io[OUT] = -p[0] * p[2] * p[2] * copysign(power, io[V])


EFFECT = Effect(
    kind=Kind.FORCE,
    summary="drag proportional to the square of speed",
    equation="F = -c vc^2 |v/vc|^n sgn(v);  with n = 2: -c v |v|",
    source="White, Fluid Mechanics, section 7.6",
    parameters=(
        Parameter("c", "N s^2/m^2", 0.0, 0.0, MOST, "drag coefficient", strength=True),
        Parameter("n", "1", 2.0, 1.2, 4.0, "exponent of the speed", fixed=True),
        Parameter(
            "vc", "m/s", 0.1, LEAST, MOST, "speed at which c holds whatever n is", fixed=True,
            start_rule=lambda e: e.speed_max,
        ),
    ),
    law=law,
    curves=(Curve(Coordinate.SPEED, by_direction=True, bent_by="n"),),
    fingerprint="residual curves with speed: nothing at low speed, much at high speed",
    excited_by="passes at several speeds, up to the highest",
)  # fmt: skip
