"""Conservative force that is smooth in position: a spring, a bellows, a hose, a magnet.

F(x) = -(offset + k1 d + k2 d^2 + k3 d^3), d = x - middle. The power series of a force about the
middle of the travel; with k3 > 0 the hardening spring of G. Duffing, Erzwungene Schwingungen bei
veranderlicher Eigenfrequenz (1918). The force of a cable slab is the same law.
"""

from twin.curve import Coordinate, Curve
from twin.effect import MOST, OUT, Effect, Kind, Parameter, X
from twin.law_parts import without_a_cable


def law(p, s, io):
    d = io[X] - p[0]
    io[OUT] = -(p[1] + d * (p[2] + d * (p[3] + d * p[4])))


def linear_part(values):
    k = values["k1"]
    return {"stiffness": k, "springref": values["middle"] - values["offset"] / k} if k > 0 else {}


EFFECT = Effect(
    kind=Kind.FORCE,
    summary="conservative force, smooth in position",
    equation="F = -(offset + k1 d + k2 d^2 + k3 d^3);  d = x - middle",
    source="power series; Duffing 1918 (cubic spring)",
    parameters=(
        Parameter(
            "middle", "m", 0.0, -MOST, MOST, "middle of the travel", fixed=True,
            start_rule=lambda e: 0.5 * (e.position_low + e.position_high),
        ),
        Parameter("offset", "N", 0.0, -MOST, MOST, "force in the middle", strength=True),
        Parameter("k1", "N/m", 0.0, -MOST, MOST, "stiffness", strength=True),
        Parameter("k2", "N/m^2", 0.0, -MOST, MOST, "quadratic term", strength=True),
        Parameter("k3", "N/m^3", 0.0, -MOST, MOST, "cubic term", strength=True),
    ),
    law=law,
    joint_attributes=linear_part,
    of_joint=lambda attributes: {"middle": attributes["springref"], "k1": attributes["stiffness"]},
    curves=(Curve(Coordinate.POSITION),),
    fingerprint="residual is one smooth curve of position, the same in both directions",
    excited_by="slow passes over the whole travel in both directions",
    suits=without_a_cable,
)  # fmt: skip
