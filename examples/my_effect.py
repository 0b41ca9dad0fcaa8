"""A user's own effect: a magnetic detent that pulls the axis to one place.

F = -k d exp(-(d / w)^2), d = x - place. Try it: twin effects --effects my_effect.py my_effect
"""

from math import exp

from twin.effect import OUT, Effect, Kind, Parameter, X


def law(p, s, io):
    distance = io[X] - p[1]
    ratio = distance / p[2]
    io[OUT] = -p[0] * distance * exp(-ratio * ratio)


EFFECT = Effect(
    kind=Kind.FORCE,
    summary="magnetic detent that pulls the axis to one place",
    equation="F = -k d exp(-(d/w)^2),  d = x - place",
    source="this example",
    parameters=(
        Parameter("k", "N/m", 0.0, -1e5, 1e5, "stiffness at the place", strength=True),
        Parameter(
            "place", "m", 0.0, -10.0, 10.0, "where it pulls to",
            scan=lambda e: [e.position_low + e.travel * i / 16 for i in range(1, 16)],
        ),
        Parameter("w", "m", 0.01, 1e-4, 1.0, "width", scan=lambda e: (0.01, 0.03)),
    ),
    law=law,
    fingerprint="residual changes sign at one place, the same in both directions",
    excited_by="slow passes over the whole travel",
)  # fmt: skip
