"""Cable slab that tightens towards one end: F = -(offset + k1 fold (exp(x/fold) - 1)).

Offset and k1 mean what they mean for the cable of the model; no cubic has this curve.
"""

from math import expm1

from twin.curve import Coordinate, Curve
from twin.effect import OUT, Effect, Kind, Parameter, X


def law(p, s, io):
    io[OUT] = -(p[0] + p[1] * p[2] * expm1(min(io[X] / p[2], 10.0)))


EFFECT = Effect(
    kind=Kind.FORCE,
    summary="cable slab that tightens towards one end",
    equation="F = -(offset + k1 fold (exp(x/fold) - 1))",
    source="this project's choice",
    parameters=(
        Parameter("offset", "N", 0.0, -1e4, 1e4, "force at x = 0", strength=True),
        Parameter("k1", "N/m", 0.0, -1e5, 1e5, "stiffness at x = 0", strength=True),
        Parameter("fold", "m", 0.13, 1e-3, 1.0, "travel in which it grows e-fold"),
    ),
    law=law,
    curves=(Curve(Coordinate.POSITION),),
    fingerprint="none",
    excited_by="any motion",
)
