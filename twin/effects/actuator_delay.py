"""Dead time between command and force, also a fraction of a sample.

u_actual(t) = u(t - tau). The command is held over each sample, so its mean over a sample, delayed
by n + f samples, is exactly (1 - f) u[k-n] + f u[k-n-1].
K. J. Astrom, B. Wittenmark, Computer-Controlled Systems, 3rd ed., section 2.3 (sampling a delay).
"""

from twin.effect import Effect, Kind, Parameter, U
from twin.knee import Imitated
from twin.law_parts import PAST_STATES, delayed, late_by


def law(p, s, io):
    io[U] = delayed(s, io, U, p[0])


EFFECT = Effect(
    kind=Kind.ACTUATION,
    summary="dead time between command and force",
    equation="u_actual(t) = u(t - tau)",
    source="Astrom and Wittenmark, Computer-Controlled Systems, section 2.3",
    parameters=(Parameter("tau", "s", 0.0, 0.0, 6e-3, "dead time", strength=True),),
    states=PAST_STATES,
    law=law,
    knees=(late_by("tau", Imitated.INERTIA),),
    fingerprint="residual follows the rate of change of the command, at every speed and place",
    dead_time=True,
    excited_by="moves with high jerk: the command must change fast",
)
