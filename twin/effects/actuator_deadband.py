"""Dead zone of the amplifier: no force below a threshold, and the threshold is lost above it.

u_actual = 0 for |u| <= width, else u - width sgn(u).
G. Tao, P. V. Kokotovic, "Adaptive control of plants with unknown dead-zones", IEEE TAC 39 (1994),
with slope 1 and equal breakpoints.
"""

from twin.effect import MOST, Effect, Kind, Parameter, U
from twin.knee import Imitated
from twin.law_parts import at


def law(p, s, io):
    io[U] -= min(max(io[U], -p[0]), p[0])


EFFECT = Effect(
    kind=Kind.ACTUATION,
    summary="no force below a threshold of the command",
    equation="u_actual = 0 for |u| <= width, else u - width sgn u",
    source="Tao, Kokotovic 1994, dead-zone of slope 1",
    parameters=(Parameter("width", "N", 0.0, 0.0, MOST, "threshold", strength=True),),
    law=law,
    knees=(at("width", "N", lambda e: (0.0, e.force_usual), above=Imitated.GAIN),),
    fingerprint="residual opposes the command with one size, whichever way the axis moves",
    excited_by="commands of both signs in each direction of motion: acceleration and braking",
)
