"""End stops: a spring and damper beyond each travel limit that can push, not pull.

F = -stiffness (d + relaxation v) where that pushes back, d = x - high or x - low, the depth.
Kelvin-Voigt contact without adhesion, as in the Modelica Standard Library's ElastoBacklash2 (its
ElastoGap bounds the damper another way). Within the step the depth is the one that this force leads
to (implicit Euler with the axis' mass), so that any stiffness is stable; along a measured motion,
which no force changes, the law is as printed.
"""

from collections.abc import Mapping

from twin.effect import DT, MASS, MOST, OUT, Effect, Excitation, Kind, Parameter, V, X
from twin.knee import Imitated, Knee

STOPS = (0.005, 0.01, 0.02, 0.035, 0.05)  # places tried, parts of what was reached, from its ends

# What is less than that imitates any force of position: a stop ends a travel, and stops what moves.
LEAST_FREE = 0.9  # part of the travel between the stops; what yields further is a cable or a spring
LEAST_PUSH = 0.25  # of the dry friction, where the travel reaches deepest


def push(values: Mapping[str, float], covered: Excitation) -> float:
    """Force, N, where the travel reaches deepest."""
    low, high = covered.been
    return values["stiffness"] * max(high - values["high"], values["low"] - low)


FREE = Knee(
    "free travel", "m", lambda v, e: v["high"] - v["low"],
    lambda v, e: (LEAST_FREE * (e.been[1] - e.been[0]), MOST), Imitated.OF_POSITION,
)  # fmt: skip
PUSH = Knee(
    "largest push", "N", push, lambda v, e: (LEAST_PUSH * e.dry_level, MOST), Imitated.NOTHING
)


def inwards(covered: Excitation, end: int) -> tuple[float, ...]:
    """Places to try, m, from one end of what was reached on: a travel may reach further."""
    low, high = covered.been
    return tuple(covered.been[end] + (1.0 - 2.0 * end) * k * (high - low) for k in STOPS)


def law(p, s, io):
    depth = 0.0
    if io[X] > p[1]:
        depth = io[X] - p[1]
    elif io[X] < p[0]:
        depth = io[X] - p[0]
    io[OUT] = 0.0
    push = depth + p[3] * io[V]
    if depth * push > 0.0:
        io[OUT] = -p[2] * push / (1.0 + p[2] * io[DT] * (io[DT] + p[3]) / io[MASS])


EFFECT = Effect(
    kind=Kind.FORCE,
    summary="spring and damper at the travel limits",
    equation="F = -stiffness (d + relaxation v) where it pushes back;  d = x - high, x - low",
    source="Kelvin-Voigt contact that does not pull; Modelica Standard Library, ElastoBacklash2",
    parameters=(
        Parameter(
            "low", "m", 0.0, -MOST, MOST, "lower stop",
            start_rule=lambda e: e.been[0],
            scan=lambda e: inwards(e, 0),
        ),
        Parameter(
            "high", "m", 0.0, -MOST, MOST, "upper stop",
            start_rule=lambda e: e.been[1],
            scan=lambda e: inwards(e, 1),
        ),
        Parameter("stiffness", "N/m", 0.0, 0.0, MOST, "stiffness of a stop", strength=True),
        Parameter(
            "relaxation", "s", 2e-3, 0.0, 0.1, "damping of a stop over its stiffness", fixed=True
        ),
    ),
    law=law,
    knees=(FREE, PUSH),
    fingerprint="residual pushes inwards at the ends of the travel and is zero between",
    excited_by="slow moves to both ends of the travel",
)  # fmt: skip
