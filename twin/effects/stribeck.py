"""Coulomb, Stribeck and viscous friction with stiction: friction falls as the axis picks up speed.

F = g(v) sgn(v) + sigma2 v,  g(v) = Fc + (Fs - Fc) exp(-|v/v0|^n); at rest any force up to
g(0) = Fs is held. A. Tustin, "The effects of backlash and of speed-dependent friction on the
stability of closed-cycle control systems", J. IEE 94 (1947), has n = 1; the form with n is that of
L. C. Bo, D. Pavelescu, Wear 82 (1982), as surveyed by B. Armstrong-Helouvry et al., Automatica 30
(1994); thesis eq. 2.4-2.5. Stepped as an impulse
(Moreau 1988): HOLD is the friction that would stop the axis within this sample; if the level
allows it, exactly that force acts, so the axis is at rest to rounding and never creeps.
"""

from dataclasses import replace
from math import copysign

from twin.curve import STRIBECK_CURVES
from twin.effect import HOLD, OUT, VISCOUS, Effect, Kind, V
from twin.knee import Imitated
from twin.law_parts import (
    COULOMB_LEVEL,
    STATIC_LEVEL,
    STRIBECK_EXPONENT,
    STRIBECK_VELOCITY,
    VISCOUS_PART,
    at_speed,
    dry_and_viscous,
    stribeck_level,
)


def law(p, s, io):
    level = max(stribeck_level(io, p[0], p[1], p[2], p[4]), 0.0)
    viscous = p[3] * io[VISCOUS] * io[V]
    needed = io[HOLD] - viscous
    if abs(needed) <= level:
        s[0] = 1.0
        io[OUT] = io[HOLD]
    else:
        s[0] = 0.0
        io[OUT] = copysign(level, needed) + viscous


EFFECT = Effect(
    kind=Kind.FRICTION,
    summary="Stribeck curve: friction falls with speed before viscosity takes over; sticks at rest",
    equation="F = g(v) sgn(v) + sigma2 v;  g(v) = Fc + (Fs - Fc) exp(-|v/v0|^n);  "
    "|F| <= Fs at rest",
    source="Tustin 1947 (n = 1); Bo, Pavelescu 1982 (n); L. Jia 2023, eq. 2.4-2.5",
    parameters=(
        COULOMB_LEVEL,
        STATIC_LEVEL,
        replace(
            STRIBECK_VELOCITY,
            scan=lambda e: tuple(share * e.speed_max for share in (0.01, 0.03, 0.1, 0.3)),
        ),
        VISCOUS_PART,
        STRIBECK_EXPONENT,
    ),
    states=("at_rest",),
    sticks=True,
    law=law,
    knees=(at_speed("v0", Imitated.DRY_FRICTION),),
    joint_attributes=dry_and_viscous,
    curves=STRIBECK_CURVES,
    fingerprint="residual rises below the Stribeck velocity, with the sign of the direction",
    excited_by="constant-speed passes in both directions, most of them slow",
)
