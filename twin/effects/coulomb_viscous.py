"""Coulomb and viscous friction with stiction.

While sliding F = Fc sgn(v) + sigma2 v; at rest any force up to Fs is held (thesis eq. 2.1-2.2 and
section 2.1.3). Stepped as an impulse (Moreau, "Unilateral contact and dry friction in finite
freedom dynamics", 1988): HOLD is the friction that would stop the axis within this sample; if the
level allows it, exactly that force acts and the axis is at rest to rounding, so it never creeps.
"""

from dataclasses import replace
from math import copysign

from twin.curve import FRICTION_CURVES
from twin.effect import DRY, HOLD, INDEX, OUT, STATIC, VISCOUS, Effect, Kind, V
from twin.law_parts import COULOMB_LEVEL, STATIC_LEVEL, VISCOUS_PART, dry_and_viscous


def law(p, s, io):
    viscous = p[2] * io[VISCOUS] * io[V]
    sliding = p[0] * io[DRY]
    level = sliding
    if s[0] > 0.5 or io[INDEX] == 0.0:  # at rest, as at the start: the static level holds
        level = max(sliding, p[1] * io[DRY] * io[STATIC])
    needed = io[HOLD] - viscous
    if abs(needed) <= level:
        s[0] = 1.0
        io[OUT] = io[HOLD]
    else:
        s[0] = 0.0
        io[OUT] = copysign(sliding, needed) + viscous


EFFECT = Effect(
    kind=Kind.FRICTION,
    summary="Coulomb and viscous friction, sticks at rest",
    equation="F = Fc sgn(v) + sigma2 v;  |F| <= Fs at rest",
    source="L. Jia 2023, eq. 2.1-2.2, section 2.1.3",
    parameters=(
        COULOMB_LEVEL,
        replace(STATIC_LEVEL, start=0.3, fixed=True, start_rule=lambda e: e.dry_level),
        VISCOUS_PART,
    ),
    states=("at_rest",),
    sticks=True,
    law=law,
    joint_attributes=dry_and_viscous,
    of_joint=lambda attributes: {
        "Fc": attributes["frictionloss"],
        "Fs": attributes["frictionloss"],
        "sigma2": attributes["damping"],
    },
    curves=FRICTION_CURVES,
    fingerprint="force steps at every reversal, and grows in proportion to speed",
    excited_by="constant-speed passes in both directions at several speeds",
)
