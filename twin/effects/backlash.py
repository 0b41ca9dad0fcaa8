"""Play between drive and load; motor and encoder are on the drive's side.

s'' + 2 damping w s' + w^2 (s - clip(s, -play/2, play/2)) = -a;  F_added = -load m s''.
s is the load's displacement from the drive, a the drive's acceleration; within the play only the
damper (a lubricant film) acts, at its ends a contact on which the load swings at ``frequency``
(w = 2 pi frequency) with the drive held. Dead-zone model of backlash with the film's damping in
place of the shaft's: M. Nordin, J. Galic, P.-O. Gutman, "New models for backlash and gear play",
Int. J. Adaptive Control and Signal Processing 11 (1997), who show why damping must not go through
the dead zone. The step is that of a load on a spring (flexible mode) but for the play.
"""

from twin.effect import LEAST, MOST, Effect, Kind, Parameter
from twin.knee import Imitated
from twin.law_parts import at, hung_load, swings_at


def law(p, s, io):
    depth = s[0] - min(max(s[0], -0.5 * p[1]), 0.5 * p[1])
    hung_load(s, io, p[0], p[2], p[3], depth)


def attach(mount, values):
    mount.hang(values["load"], values["frequency"], values["damping"], values["play"])


EFFECT = Effect(
    kind=Kind.STRUCTURE,
    summary="play between drive and load",
    equation="s'' + 2 damping w s' + w^2 (s - clip(s, -play/2, play/2)) = -a;  F = -load m s''",
    source="Nordin, Galic, Gutman 1997 (dead-zone model); film damping is an assumption",
    parameters=(
        Parameter("load", "1", 0.0, 0.0, 0.9, "part of the mass behind the play", strength=True),
        Parameter(
            "play", "m", 2e-5, LEAST, MOST, "full width of the play",
            scan=lambda e: tuple(6e-6 * e.travel * 1.5**k for k in range(16)),
        ),
        Parameter(
            "frequency", "Hz", 100.0, 1.0, 2000.0, "of the load on the contact, drive held",
            scan=lambda e: tuple(20.0 * 1.25**k for k in range(11)),
        ),
        Parameter("damping", "1", 0.1, 1e-4, 0.5, "damping ratio of film and contact"),
    ),
    states=("displacement", "speed"),
    law=law,
    knees=(
        at(
            "play", "m", lambda e: (e.shortest, e.travel), Imitated.LOAD_ON_SPRING,
            Imitated.INERTIA,
        ),
        swings_at("frequency", Imitated.INERTIA, None),
    ),
    attach=attach,
    fingerprint="residual is a free flight and a knock after each change of sign of the force",
    excited_by="moves that accelerate and brake in turn, gently enough to cross the play slowly",
)  # fmt: skip
