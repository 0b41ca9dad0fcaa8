"""Generalized Maxwell-slip (GMS) friction: N massless blocks on springs, side by side.

An element sticks, dF_i/dt = k_i v, until |F_i| = a_i g(v) in the direction of motion; then it
slips, dF_i/dt = C (a_i sgn(v) - F_i/g(v)), until v passes through zero. Friction = sum F_i +
sigma2 v, with sum a_i = 1 and g(v) = Fc + (Fs - Fc) exp(-|v/v0|^n).
F. Al-Bender, V. Lampaert, J. Swevers, "The generalized Maxwell-slip model: a novel model for
friction simulation and compensation", IEEE TAC 50 (2005); thesis eq. 2.16-2.18. The slip equation
is usually printed as sgn(v) C (a_i - F_i/s(v)). That needs s(v) = g(v) sgn(v), which is followed
here: with an unsigned g an element would never settle while moving backwards. One limit is added:
a slipping element's force rises by no more than k_i |v| dt, what its spring is stretched by;
without it a level that rises near standstill (C does not see v) would load the springs from
nothing, and a reversal would give that energy out.

Unless given one by one, elements share the force equally and yield after deflections in geometric
progression, the last after ``spread`` times the deflection of the first: a_i ~ share_i and k_i ~
stiff_i spread^(-(i-1)/(N-1)), with sum k_i = sigma0. Only the ratios of share_i and of stiff_i
count; for published a_i and k_i, give those with spread = 1 and sigma0 = sum k_i. Both phases are
integrated exactly over the sample for constant v, so any stiffness and C are stable.
"""

from functools import cache
from math import copysign, exp, expm1, log

from twin.curve import STRIBECK_CURVES
from twin.effect import DRY, DT, LEAST, MOST, OUT, STATIC, VISCOUS, WHEN, Effect, Kind, Parameter, V

SHARES = 9  # where the elements' own parameters begin


def totals(p, count, ratio):
    """Sums that share_i and the tapered stiff_i are parts of."""
    shares, springs, taper = 0.0, 0.0, 1.0
    for i in range(count):
        shares += p[SHARES + i]
        springs += p[SHARES + count + i] * taper
        taper *= ratio
    return shares, springs


def advance(p, s, io, level):
    """Step the elements; their force at the wanted instant of the sample, N."""
    count, moves = int(p[0]), io[V] != 0.0
    direction = copysign(1.0, io[V])
    ratio = exp(-log(p[6]) / (count - 1)) if count > 1 else 1.0
    shares, springs = totals(p, count, ratio)
    settled = -expm1(-p[7] * io[DT] / level)  # part of the way to the curve gone while slipping
    stretch = p[5] / springs * io[V] * io[DT]
    force = 0.0
    for i in range(count):
        limit = level * p[SHARES + i] / shares
        change = p[SHARES + count + i] * stretch
        stretch *= ratio
        slips = moves and (s[count + i] == direction or direction * s[i] >= limit)
        if slips:  # towards the curve, but rising no faster than the spring is stretched
            change = direction * min((limit - direction * s[i]) * settled, direction * change)
        elif moves and direction * (s[i] + change) >= limit:
            slips = True
            change = direction * limit - s[i]
        force += s[i] + io[WHEN] * change
        s[i] += change
        s[count + i] = direction if slips else 0.0
    return force


def law(p, s, io):
    q = abs(io[V]) / p[3]
    fall = exp(-q * q) if p[8] == 2.0 else exp(-(q ** p[8]))
    level = io[DRY] * (p[1] + (p[2] * io[STATIC] - p[1]) * fall)
    io[OUT] = p[4] * io[VISCOUS] * io[V]
    if level > 0.0:
        io[OUT] += advance(p, s, io, level)
    else:
        for i in range(2 * int(p[0])):
            s[i] = 0.0


@cache
def of_size(elements: int) -> Effect:
    """GMS friction with that many elements."""
    numbers = range(1, elements + 1)
    return Effect(
        kind=Kind.FRICTION,
        summary="N Maxwell-slip elements: hysteresis with memory, Stribeck curve, frictional lag",
        equation="stick: dF_i/dt = k_i v until |F_i| = a_i g(v);  "
        "slip: dF_i/dt = C (a_i sgn v - F_i/g(v));  F = sum F_i + sigma2 v;  "
        "g(v) = Fc + (Fs - Fc) exp(-|v/v0|^n)",
        source="Al-Bender, Lampaert, Swevers 2005; L. Jia 2023, eq. 2.16-2.18",
        parameters=(
            *_shared(elements),
            *_own("share", "force", numbers),
            *_own("stiff", "stiffness", numbers),
        ),
        states=(*(f"F_{i}" for i in numbers), *(f"slip_{i}" for i in numbers)),
        law=law,
        curves=STRIBECK_CURVES,
        fingerprint="residual after a reversal that depends on where the axis turned before",
        excited_by="slow reversals, small ones within larger ones, and a velocity staircase",
        of_size=of_size,
    )


def _shared(elements: int) -> tuple[Parameter, ...]:
    return (
        Parameter(
            "elements", "1", elements, elements, elements, "number N, from the model file"
        ),
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
            scan=lambda e: (0.02 * e.speed_max, 0.1 * e.speed_max),
        ),
        Parameter("sigma2", "N s/m", 0.0, 0.0, MOST, "viscous friction", strength=True),
        Parameter(
            "sigma0", "N/m", 300.0, LEAST, MOST, "stiffness of all elements together",
            start_rule=lambda e: 300.0 * e.dry_level / e.travel,
            scan=lambda e: tuple(e.dry_level / (z * e.travel) for z in (3e-3, 3e-4, 3e-5)),
        ),
        Parameter("spread", "1", 10.0, 1.0, 1e6, "last yield deflection over the first"),
        Parameter(
            "C", "N/s", 30.0, LEAST, MOST, "attraction to the Stribeck curve",
            start_rule=lambda e: 100.0 * e.dry_level,
        ),
        Parameter("n", "1", 2.0, 0.5, 4.0, "Stribeck exponent", fixed=True),
    )  # fmt: skip


def _own(part: str, what: str, numbers: range) -> tuple[Parameter, ...]:
    return tuple(
        Parameter(
            f"{part}_{i}", "1", 1.0, 1e-6, 1e6, f"element {i}: relative part of the {what}",
            fixed=True,
        )
        for i in numbers
    )  # fmt: skip


EFFECT = of_size(4)
