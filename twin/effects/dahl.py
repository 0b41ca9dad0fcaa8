"""Dahl friction: a spring that yields gradually, as far as it moves and whatever its speed.

dF/dx = sigma0 sgn(r) |r|^n with r = 1 - F sgn(v)/Fc; the friction is F + sigma2 v.
P. R. Dahl, "A solid friction model", Aerospace Corp. TOR-0158(3107-18)-1 (1968), and "Solid
friction damping of mechanical vibrations", AIAA J. 14 (1976), where n < 1 stands for brittle and
n >= 1 for ductile contacts; the sign and modulus matter only after the level has dropped, else
r >= 0. There is no static friction and no Stribeck curve, and the reversal points are forgotten.
r falls along the path as dr/d|x| = -sigma0/Fc r^n, which is integrated exactly over the sample.
"""

from math import copysign, exp, expm1, log, log1p

from twin.curve import FRICTION_CURVES
from twin.effect import DRY, DT, OUT, VISCOUS, WHEN, Effect, Kind, Parameter, V
from twin.law_parts import (
    COULOMB_LEVEL,
    DEFLECTION,
    VISCOUS_PART,
    dry_and_viscous,
    stiffness_at_rest,
)


def law(p, s, io):
    v = io[V]
    level = io[DRY] * p[0]
    viscous = p[1] * io[VISCOUS] * v
    if level <= 0.0:
        s[0] = 0.0
        io[OUT] = viscous
    else:
        left = 1.0 - s[0] * copysign(1.0, v) / level
        path = p[2] * abs(v) * io[DT] / level
        m = p[3] - 1.0
        shrunk = path  # -log of the factor by which ``left`` shrinks
        if m != 0.0 and path > 0.0 and left != 0.0:
            grown = m * path * exp(min(m * log(abs(left)), 600.0))
            # for n < 1 the friction is fully there after a finite path
            shrunk = log1p(grown) / m if grown > -1.0 else 1e3
        change = copysign(level, v) * left * -expm1(-shrunk)
        io[OUT] = s[0] + io[WHEN] * change + viscous
        s[0] += change


EFFECT = Effect(
    kind=Kind.FRICTION,
    summary="pre-sliding like that of a yielding spring, the same at every speed",
    equation="dF/dx = sigma0 sgn(r) |r|^n,  r = 1 - F sgn(v)/Fc;  friction = F + sigma2 v",
    source="Dahl 1968; Dahl 1976; with the viscous part added",
    parameters=(
        COULOMB_LEVEL,
        VISCOUS_PART,
        stiffness_at_rest("stiffness at F = 0", (0.03, 3e-3, 3e-4, 3e-5)),
        Parameter("n", "1", 1.0, 0.0, 4.0, "shape of the yield", fixed=True),
    ),
    states=("F",),
    law=law,
    knees=(DEFLECTION,),
    joint_attributes=dry_and_viscous,
    curves=FRICTION_CURVES,
    fingerprint="residual after every reversal over a fixed distance, the same at every speed",
    excited_by="reversals at several speeds, with travel of micrometres to millimetres after each",
)
