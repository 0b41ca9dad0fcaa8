"""Cable slab whose force levels off where its fold lies flat: F = -(offset + k1 fold tanh(x/fold)).

Offset and k1 mean what they mean for the cable of the model; no cubic has this curve.
"""

from math import tanh

from twin.curve import Coordinate, Curve
from twin.effect import OUT, Effect, Kind, Parameter, X


def law(p, s, io):
    io[OUT] = -(p[0] + p[1] * p[2] * tanh(io[X] / p[2]))


EFFECT = Effect(
    kind=Kind.FORCE,
    summary="cable slab whose force levels off",
    equation="F = -(offset + k1 fold tanh(x/fold))",
    source="this project's choice",
    parameters=(
        Parameter("offset", "N", 0.0, -1e4, 1e4, "force at x = 0", strength=True),
        Parameter("k1", "N/m", 0.0, -1e5, 1e5, "stiffness at x = 0", strength=True),
        Parameter("fold", "m", 0.07, 1e-3, 1.0, "travel until the fold lies flat"),
    ),
    law=law,
    curves=(Curve(Coordinate.POSITION),),
    fingerprint="none",
    excited_by="any motion",
)
