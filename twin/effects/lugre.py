"""LuGre friction: bristles of stiffness sigma0 that deflect before the axis slides.

dz/dt = v - sigma0 |v| z / g(v),  g(v) = Fc + (Fs - Fc) exp(-|v/v0|^n)
F = sigma0 z + sigma1 dz/dt + sigma2 v
C. Canudas de Wit et al., "A new model for control of systems with friction", IEEE TAC 40 (1995),
written as in the thesis, eq. 2.6-2.9. The state is integrated exactly over the sample for constant
v, so any stiffness is stable.
"""

from math import copysign, exp, expm1

from twin.curve import STRIBECK_CURVES
from twin.effect import DRY, DT, OUT, STATIC, VISCOUS, WHEN, Effect, Kind, V
from twin.law_parts import (
    BRISTLE_DAMPING,
    DEFLECTION,
    PEAK,
    STRIBECK_CURVE,
    STRIBECK_EXPONENT,
    VISCOUS_PART,
    dry_and_viscous,
    stiffness_at_rest,
)

GONE = 40.0  # exp(-40) is below the rounding of what it is added to


def law(p, s, io):
    coulomb, static, stribeck, viscous, sigma0, sigma1 = p[0], p[1], p[2], p[3], p[4], p[5]
    v = io[V]
    speed = abs(v)
    q = speed / stribeck
    depth = q * q if p[6] == 2.0 else q ** p[6]
    fall = exp(-depth) if depth < GONE else 0.0
    level = io[DRY] * (coulomb + (static * io[STATIC] - coulomb) * fall)
    if level <= 0.0:
        s[0] = 0.0
        io[OUT] = viscous * io[VISCOUS] * v
        return
    a = speed * (sigma0 * io[DT] / level)
    if a < 0.05:  # below it the series of 1 - exp(-a) to a^8 is exact to rounding
        b = a * a
        sinh = a * (1.0 + b * (1 / 6 + b * (1 / 120 + b * (1 / 5040))))
        grown = sinh - b * (1 / 2 + b * (1 / 24 + b * (1 / 720 + b * (1 / 40320))))
    else:
        grown = -expm1(-a)
    change = (copysign(level / sigma0, v) - s[0]) * grown
    z = s[0] + io[WHEN] * change
    s[0] += change
    io[OUT] = sigma0 * z + sigma1 / io[DT] * change + viscous * io[VISCOUS] * v


def motor_attributes(values, gear):
    if values["n"] != 2.0:
        return {}
    turns = {"sigma0": gear**-2, "sigma1": gear**-2, "Fc": 1.0 / gear, "Fs": 1.0 / gear, "v0": gear}
    return {"lugre": [values[name] * turn for name, turn in turns.items()]}


EFFECT = Effect(
    kind=Kind.FRICTION,
    summary="bristle friction: Stribeck curve, pre-sliding stiffness and damping",
    equation="dz/dt = v - sigma0 |v| z / g(v);  F = sigma0 z + sigma1 dz/dt + sigma2 v;  "
    "g(v) = Fc + (Fs - Fc) exp(-|v/v0|^n)",
    source="Canudas de Wit et al. 1995, as in L. Jia 2023, eq. 2.6-2.9",
    parameters=(
        *STRIBECK_CURVE,
        VISCOUS_PART,
        stiffness_at_rest("bristle stiffness"),
        BRISTLE_DAMPING,
        STRIBECK_EXPONENT,
    ),
    states=("z",),
    law=law,
    knees=(DEFLECTION, PEAK),
    joint_attributes=dry_and_viscous,
    motor_attributes=motor_attributes,
    curves=STRIBECK_CURVES,
    fingerprint="residual after every reversal over a few bristle deflections of travel",
    excited_by="slow reversals of a few micrometres to millimetres, and a velocity staircase",
)
