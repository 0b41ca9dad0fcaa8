"""A user's own effect: a magnetic detent that pulls the axis to one place.

F = -k d exp(-(d / w)^2), d = x - place. Try it: twin effects --effects my_effect.py my_effect
Does it obey the laws of every effect? twin effects --effects my_effect.py --check

A file like this is tried as it is loaded, and what is wrong with it is said in one line:

* Parameter("k", "", 0.0, ...)       effect my_effect: parameter k has no unit; use '1' for a ratio
* Parameter("k", "N/m", 0.0, -1e5, "stiffness")
                                     ... a Parameter has a name, unit, start, lower, upper and
                                     meaning, in this order
* start 2e5 within [-1e5, 1e5]       start 200000.0 N/m of k is outside its bounds
* s[1] = ... with states=("own",)    its law uses s[1], but 1 states are declared; add a name to
                                     states=(...)
* io[OUT] = p[0] / io[V]             its law gives no finite number at v = 0 m/s
* io[OUT] never written              its law writes no result; a force effect writes io[OUT]
* float("%g" % p[0])                 its law cannot be compiled: ...; use only numbers, math
                                     functions and the arrays p, s, io
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
