"""Weight of what turns about an axis that is not vertical: an arm, an unbalanced rotor.

F = -(sine sin q + cosine cos q) = -m g l sin(q - q0), a torque, with q the angle: m l is the
unbalance, q0 where it hangs; sine = m g l cos q0, cosine = -m g l sin q0. M. W. Spong,
S. Hutchinson, M. Vidyasagar, Robot Modeling and Control (2006), section 6.4 (single link). A slide
that is tilted has a constant force instead.
"""

from math import cos, sin

from twin.effect import MOST, OUT, Effect, Kind, Parameter, X


def law(p, s, io):
    io[OUT] = -(p[0] * sin(io[X]) + p[1] * cos(io[X]))


EFFECT = Effect(
    kind=Kind.FORCE,
    summary="weight of an arm, or of an unbalanced rotor",
    equation="F = -(sine sin q + cosine cos q) = -m g l sin(q - q0)",
    source="Spong, Hutchinson, Vidyasagar, Robot Modeling and Control, section 6.4",
    parameters=(
        Parameter("sine", "N", 0.0, -MOST, MOST, "m g l cos q0", strength=True),
        Parameter("cosine", "N", 0.0, -MOST, MOST, "-m g l sin q0", strength=True),
    ),
    law=law,
    fingerprint="residual is a sine of the angle, the same in both directions",
    excited_by="slow moves over a large part of a turn",
    suits=lambda present, turns: turns,
)
