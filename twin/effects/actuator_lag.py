"""First-order lag of the current loop between command and force.

tau du_actual/dt = u - u_actual. The command is held over each sample, so the force approaches it
exponentially, and its mean over a sample of length h that begins at u0 is
u - (u - u0) (1 - exp(-h/tau)) tau/h.
K. J. Astrom, B. Wittenmark, Computer-Controlled Systems, 3rd ed., section 2.3 (zero-order hold).
"""

from math import expm1

from twin.effect import DT, INDEX, Effect, Kind, Parameter, U
from twin.knee import Imitated
from twin.law_parts import late_by


def law(p, s, io):
    command = io[U]
    if io[INDEX] == 0.0:  # before the log began the command was what it is at its start
        s[0] = command
    if p[0] > 0.0:
        turns = io[DT] / p[0]
        gone = -expm1(-turns)
        io[U] = command - (command - s[0]) * gone / turns
        s[0] += (command - s[0]) * gone
    else:
        s[0] = command


EFFECT = Effect(
    kind=Kind.ACTUATION,
    summary="first-order lag of the current loop",
    equation="tau du_actual/dt = u - u_actual",
    source="Astrom and Wittenmark, Computer-Controlled Systems, section 2.3",
    parameters=(Parameter("tau", "s", 0.0, 0.0, 0.1, "time constant", strength=True),),
    states=("force",),
    law=law,
    knees=(late_by("tau", Imitated.GAIN),),
    fingerprint="residual follows the rate of change of the command, and fades after a step of it",
    excited_by="moves with high jerk: the command must change fast",
)
