"""Force of the cable slab: smooth in position and conservative.

F(x) = -(offset + k1 x + k2 x^2 + k3 x^3); it falls with x because the fold of the slab widens
(L. Jia 2023, cable measurement: F_cable = -(F_pos + F_neg)/2). The polynomial is this project's
choice: the thesis prints a measured curve, no formula.
"""

from twin.curve import Coordinate, Curve
from twin.effect import MOST, OUT, Effect, Kind, Parameter, X
from twin.law_parts import on_a_cable


def law(p, s, io):
    x = io[X]
    io[OUT] = -(p[0] + x * (p[1] + x * (p[2] + x * p[3])))


EFFECT = Effect(
    kind=Kind.FORCE,
    summary="conservative force of the cable slab, smooth in position",
    equation="F = -(offset + k1 x + k2 x^2 + k3 x^3)",
    source="L. Jia 2023, cable pass; the polynomial form is an assumption",
    parameters=(
        Parameter("offset", "N", 0.0, -MOST, MOST, "force at x = 0", strength=True),
        Parameter("k1", "N/m", 0.0, -MOST, MOST, "stiffness", strength=True),
        Parameter("k2", "N/m^2", 0.0, -MOST, MOST, "quadratic term", strength=True),
        Parameter("k3", "N/m^3", 0.0, -MOST, MOST, "cubic term", strength=True),
    ),
    law=law,
    curves=(Curve(Coordinate.POSITION),),
    fingerprint="residual is one smooth curve of position, the same in both directions",
    excited_by="slow passes over the whole travel in both directions",
    suits=on_a_cable,
)
