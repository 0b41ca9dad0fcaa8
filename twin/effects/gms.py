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
from twin.effect import DT, LEAST, MOST, OUT, VISCOUS, WHEN, Effect, Kind, Parameter, V
from twin.law_parts import (
    ELEMENTS_SLIP,
    PEAK,
    SPREAD,
    STRIBECK_CURVE,
    STRIBECK_EXPONENT,
    VISCOUS_PART,
    of_elements,
    relative_parts,
    stiffness_at_rest,
    stribeck_level,
    sums_of_parts,
)

SHARES = 9  # where the elements' own parameters begin


def advance(p, s, io, level):
    """Step the elements; their force at the wanted instant of the sample, N."""
    count, moves = int(p[0]), io[V] != 0.0
    direction = copysign(1.0, io[V])
    ratio = exp(-log(p[6]) / (count - 1)) if count > 1 else 1.0
    shares, springs = sums_of_parts(p, SHARES, count, ratio)
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
    level = stribeck_level(io, p[1], p[2], p[3], p[8])
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
            of_elements(elements),
            *STRIBECK_CURVE,
            VISCOUS_PART,
            stiffness_at_rest("stiffness of all elements together"),
            SPREAD,
            Parameter(
                "C", "N/s", 30.0, LEAST, MOST, "attraction to the Stribeck curve",
                start_rule=lambda e: 100.0 * e.dry_level,
            ),
            STRIBECK_EXPONENT,
            *relative_parts(elements),
        ),
        states=(*(f"F_{i}" for i in numbers), *(f"slip_{i}" for i in numbers)),
        law=law,
        knees=(ELEMENTS_SLIP, PEAK),
        curves=STRIBECK_CURVES,
        fingerprint="residual after a reversal that depends on where the axis turned before",
        excited_by="slow reversals, small ones within larger ones, and a velocity staircase",
        of_size=of_size,
    )  # fmt: skip


EFFECT = of_size(4)
