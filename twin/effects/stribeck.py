"""Coulomb, Stribeck and viscous friction with stiction: friction falls as the axis picks up speed.

F = g(v) sgn(v) + sigma2 v,  g(v) = Fc + (Fs - Fc) exp(-|v/v0|^n); at rest any force up to
g(0) = Fs is held. A. Tustin, "The effects of backlash and of speed-dependent friction on the
stability of closed-cycle control systems", J. IEE 94 (1947), has n = 1; the form with n is that of
L. C. Bo, D. Pavelescu, Wear 82 (1982), as surveyed by B. Armstrong-Helouvry et al., Automatica 30
(1994); thesis eq. 2.4-2.5. Stepped as an impulse
(Moreau 1988): HOLD is the friction that would stop the axis within this sample; if the level
allows it, exactly that force acts, so the axis is at rest to rounding and never creeps.
"""

from math import copysign, exp

from twin.curve import STRIBECK_CURVES
from twin.effect import DRY, HOLD, LEAST, MOST, OUT, STATIC, VISCOUS, Effect, Kind, Parameter, V


def law(p, s, io):
    q = abs(io[V]) / p[2]
    fall = exp(-q * q) if p[4] == 2.0 else exp(-(q ** p[4]))
    level = max(io[DRY] * (p[0] + (p[1] * io[STATIC] - p[0]) * fall), 0.0)
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
        Parameter(
            "Fc", "N", 0.3, 0.0, MOST, "Coulomb friction", strength=True, dry=True,
            start_rule=lambda e: e.dry_level,
        ),
        Parameter(
            "Fs", "N", 0.35, 0.0, MOST, "static friction", strength=True, dry=True, at_least="Fc",
            start_rule=lambda e: 1.15 * e.dry_level,
        ),
        Parameter(
            "v0", "m/s", 0.01, LEAST, MOST, "Stribeck velocity",
            start_rule=lambda e: 0.05 * e.speed_max,
            scan=lambda e: tuple(share * e.speed_max for share in (0.01, 0.03, 0.1, 0.3)),
        ),
        Parameter("sigma2", "N s/m", 0.0, 0.0, MOST, "viscous friction", strength=True),
        Parameter("n", "1", 2.0, 0.5, 4.0, "Stribeck exponent", fixed=True),
    ),
    states=("at_rest",),
    sticks=True,
    law=law,
    curves=STRIBECK_CURVES,
    fingerprint="residual rises below the Stribeck velocity, with the sign of the direction",
    excited_by="constant-speed passes in both directions, most of them slow",
)  # fmt: skip
