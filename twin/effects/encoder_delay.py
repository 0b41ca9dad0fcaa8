"""Reading older than its stamp.

reading(t) = x(t - tau), a straight line between the samples.
A dead time, as the actuator's (K. J. Astrom, B. Wittenmark, Computer-Controlled Systems, 3rd ed.,
section 2.3, where the input is held instead); the straight line is a choice.
"""

from twin.effect import READING, Effect, Kind, Parameter
from twin.knee import Imitated
from twin.law_parts import PAST_STATES, delayed, late_by


def law(p, s, io):
    io[READING] = delayed(s, io, READING, p[0])


EFFECT = Effect(
    kind=Kind.SENSING,
    summary="reading older than its stamp",
    equation="reading(t) = x(t - tau)",
    source="Astrom and Wittenmark, Computer-Controlled Systems, section 2.3",
    parameters=(Parameter("tau", "s", 0.0, 0.0, 6e-3, "age of the reading", strength=True),),
    states=PAST_STATES,
    law=law,
    knees=(late_by("tau", Imitated.INERTIA),),
    fingerprint="residual follows the jerk: the force comes before the acceleration it causes",
    dead_time=True,
    excited_by="moves with high jerk: the acceleration must change fast",
)
