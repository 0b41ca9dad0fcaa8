"""Modified Leuven friction: a bristle whose spring is a bundle of N Maxwell-slip elements.

dz/dt = v (1 - sgn(r) |r|^m) with r = F_h/s(v);  friction = F_h + sigma1 dz/dt + sigma2 v;
F_h = sum F_i,  dF_i/dz = k_i until |F_i| = W_i;  s(v) = g(v) sgn(v),
g(v) = Fc + (Fs - Fc) exp(-|v/v0|^n).
V. Lampaert, J. Swevers, F. Al-Bender, "Modification of the Leuven integrated friction model
structure", IEEE TAC 47 (2002); thesis eq. 2.13-2.14. Against the Leuven model it removes the jump
of the force where an inner loop closes, and the stacks. s(v) carries the sign of v; with an
unsigned g, z would run away while moving backwards. Two things are this project's choice: m = 16
at the start (the larger, the less a biased vibration creeps: by about 2 r^m of its amplitude a
cycle; but while the level falls, z goes back at v (r^m - 1), and with a large sigma1 the friction
dips), and sum W_i = reserve max(Fs, Fc), for below Fs the friction could not follow s(v).

Unless given one by one, elements share sum W_i equally and yield after deflections in geometric
progression, the last after ``spread`` times the deflection of the first: W_i ~ share_i and k_i ~
stiff_i spread^(-(i-1)/(N-1)), with sum k_i = sigma0; only ratios of share_i and of stiff_i count.
F_h is piecewise linear in z; on each piece the gap 1 - r shrinks exponentially, at the mean of the
rates at both ends of the step, so it never changes sign and any stiffness is stable.
"""

from functools import cache
from math import copysign, exp, expm1, log, log1p

from twin.curve import STRIBECK_CURVES
from twin.effect import DRY, DT, OUT, STATIC, VISCOUS, WHEN, Effect, Kind, Parameter, V
from twin.law_parts import (
    BRISTLE_DAMPING,
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

SHARES = 11  # where the elements' own parameters begin
FULL = 1.0 - 1e-12  # part of a limit, or of a gap, that counts as all of it


def deflect(p, s, count, share, spring, ratio, step):
    """Move z by a step, m; the sum of the elements' forces, N."""
    force = 0.0
    for i in range(count):
        limit = share * p[SHARES + i]
        s[i] = min(max(s[i] + spring * p[SHARES + count + i] * step, -limit), limit)
        spring *= ratio
        force += s[i]
    return force


def sticking(p, s, count, share, spring, ratio, way):
    """Stiffness that z meets that way, N/m, and how far it goes until one more element slips, m."""
    stiffness, room = 0.0, 1e300
    for i in range(count):
        limit = share * p[SHARES + i]
        if way * s[i] < FULL * limit:
            own = spring * p[SHARES + count + i]
            stiffness += own
            room = min(room, (limit - way * s[i]) / own)
        spring *= ratio
    return stiffness, room


def slope(gap, m):
    """(1 - sgn(r)|r|^m)/(1 - r) with 1 - r = gap."""
    r = min(max(1.0 - gap, -1e3), 1e3)
    if abs(gap) < 1e-7:  # gap below which its slope is that at its end
        return m
    return (1.0 - r**m if r > 0.0 else 1.0 + (-r) ** m) / gap


def advance(p, s, io, level):
    """Step the bristle; its spring's force at the wanted instant, N, and its mean speed, m/s."""
    count = int(p[0])
    ratio = exp(-log(p[7]) / (count - 1)) if count > 1 else 1.0
    shares, springs = sums_of_parts(p, SHARES, count, ratio)
    share = p[9] * io[DRY] * max(p[2] * io[STATIC], p[1]) / shares
    spring = p[5] / springs
    direction = copysign(1.0, io[V])
    path = abs(io[V]) * io[DT]
    before = deflect(p, s, count, share, spring, ratio, 0.0)
    force, deflected = before, 0.0
    for _ in range(2 * count + 1):
        gap = 1.0 - direction * force / level
        if path <= 0.0 or gap == 0.0:
            break
        way = direction if gap > 0.0 else -direction
        stiffness, room = sticking(p, s, count, share, spring, ratio, way)
        rate = slope(gap, p[8])
        rate = 0.5 * (rate + slope(gap * exp(-rate * stiffness / level * path), p[8]))
        decay = rate * stiffness / level
        if stiffness == 0.0:
            step = abs(gap) * rate * path
        else:
            step = -abs(gap) * expm1(-decay * path) * level / stiffness
        if step < room:
            path = 0.0
        else:
            step = room
            path += log1p(-min(step * stiffness / (level * abs(gap)), FULL)) / decay
        deflected += way * step
        force = deflect(p, s, count, share, spring, ratio, way * step)
    return before + io[WHEN] * (force - before), deflected / io[DT]


def law(p, s, io):
    level = stribeck_level(io, p[1], p[2], p[3], p[10])
    io[OUT] = p[4] * io[VISCOUS] * io[V]
    if level > 0.0:
        force, bristle_speed = advance(p, s, io, level)
        io[OUT] += force + p[6] * bristle_speed
    else:
        for i in range(int(p[0])):
            s[i] = 0.0


@cache
def of_size(elements: int) -> Effect:
    """Modified Leuven friction with that many elements."""
    return Effect(
        kind=Kind.FRICTION,
        summary="bristle with Maxwell-slip elements: hysteresis with memory, smooth into sliding",
        equation="dz/dt = v (1 - sgn(r) |r|^m), r = F_h/(g(v) sgn v);  F_h = sum F_i, "
        "dF_i/dz = k_i until |F_i| = W_i;  F = F_h + sigma1 dz/dt + sigma2 v;  "
        "g(v) = Fc + (Fs - Fc) exp(-|v/v0|^n)",
        source="Lampaert, Swevers, Al-Bender 2002; L. Jia 2023, eq. 2.13-2.14",
        parameters=(
            of_elements(elements),
            *STRIBECK_CURVE,
            VISCOUS_PART,
            stiffness_at_rest("stiffness of all elements together"),
            BRISTLE_DAMPING,
            SPREAD,
            Parameter("m", "1", 16.0, 1.0, 50.0, "sharpness of the onset of sliding", fixed=True),
            Parameter(
                "reserve", "1", 1.2, 1.0, 10.0, "sum of the W_i over max(Fs, Fc)", fixed=True
            ),
            STRIBECK_EXPONENT,
            *relative_parts(elements),
        ),
        states=tuple(f"F_{i}" for i in range(1, elements + 1)),
        law=law,
        knees=(ELEMENTS_SLIP, PEAK),
        curves=STRIBECK_CURVES,
        fingerprint="residual after a reversal that depends on where the axis turned before",
        excited_by="slow reversals, small ones within larger ones, and a velocity staircase",
        of_size=of_size,
    )


EFFECT = of_size(4)
