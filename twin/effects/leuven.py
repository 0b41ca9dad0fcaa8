"""Leuven friction: hysteresis that remembers where it turned, joined to the Stribeck curve.

dz/dt = v (1 - sgn(r) |r|^m) with r = F_d/(s(v) - F_b);  F_h = F_b + F_d;
friction = F_h + sigma1 dz/dt + sigma2 v;  s(v) = g(v) sgn(v),
g(v) = Fc + (Fs - Fc) exp(-|v/v0|^n). F_b is the hysteresis force F_h where the present branch
began and F_d(z), odd and growing, the transition curve along it; both at work since the last
reversal. A reversal begins a branch and is put on a stack; when a branch comes back to where the
branch before it began, the inner loop is closed and forgotten, and the branch before that goes on.
s(v) carries the sign of v: with an unsigned g, z would run away while moving backwards.
J. Swevers, F. Al-Bender, C. G. Ganseman, T. Prajogo, "An integrated friction model structure with
improved presliding behavior for accurate friction compensation", IEEE TAC 45 (2000); thesis
eq. 2.10-2.12. dz/dt jumps where a loop closes, because F_b does: a property of the model, which
its modification of 2002 removes. While the level falls, r > 1 and z goes back at v (r^m - 1), so a
large m with a large sigma1 makes the friction dip.

The model leaves F_d and m open. Here m = 16 at the start; the stiffness along F_d falls as
sigma0 exp(-b |F_d|/2 Fs), and on the first branch, from rest or from sliding (F_b = 0), twice as
fast (Masing's rule), so that loops are symmetric. Once F_h reaches s(v) the axis slides and the
stack is emptied. It holds TURNS reversals; when one more comes, the last two, which bound the
smallest loop, are dropped: the force does not jump, only that loop is not closed any more. As F_h
fixes z on a branch, F_h is the state. Within a sample F_d nears its end s(v) - F_b exponentially,
at the mean of the rates at both ends of the step: any stiffness is stable.
"""

from math import copysign, exp, expm1, log1p

from twin.curve import STRIBECK_CURVES
from twin.effect import DRY, DT, OUT, STATIC, VISCOUS, WHEN, Effect, Kind, Parameter, V
from twin.law_parts import (
    BRISTLE_DAMPING,
    DEFLECTION,
    PEAK,
    STRIBECK_CURVE,
    STRIBECK_EXPONENT,
    VISCOUS_PART,
    stiffness_at_rest,
    stribeck_level,
)

TURNS = 16  # reversals remembered
FULL = 1.0 - 1e-12  # part of a gap that counts as all of it
SLIDES = 1.0 - 1e-9  # part of the level that is all of it: nearer, rounding would decide
NEAR = 1e-7  # gap below which its slope is that at its end
SOFTEST = 100.0  # exponent beyond which the stiffness is as good as gone
FORCE, DIRECTION, DEPTH, STACK = range(4)  # states; the stack comes last


def turn(s, direction):
    """Begin a branch where the direction of motion has changed."""
    depth = int(s[DEPTH])
    if s[DIRECTION] == -direction:
        if depth == TURNS:
            depth -= 2
        s[STACK + depth] = s[FORCE]
        s[DEPTH] = depth + 1.0
    s[DIRECTION] = direction


def slope(gap, m, softening):
    """Stiffness (1 - sgn(r)|r|^m)/(1 - r), with 1 - r = gap, over the stiffness at r = 0.

    softening: exponent by which the stiffness falls up to r = 1.
    """
    r = min(max(1.0 - gap, 0.0), 1e3)
    ratio = m if abs(gap) < NEAR else (1.0 - r**m) / gap
    return ratio * exp(-min(softening * r, SOFTEST))


def advance(p, s, io, level):
    """Step the hysteresis along the path of a sample; its deflection, m."""
    direction = copysign(1.0, io[V])
    path = abs(io[V]) * io[DT]
    soft = p[6] / (io[DRY] * max(p[1] * io[STATIC], p[0]))  # b/Fs
    deflected = 0.0
    for _ in range(TURNS):
        if direction * s[FORCE] >= SLIDES * level:  # the axis slides
            s[DEPTH] = 0.0
        depth = int(s[DEPTH])
        base = s[STACK + depth - 1] if depth > 0 else 0.0
        reach = level - direction * base
        along = direction * (s[FORCE] - base)
        gap = 1.0 - along / reach
        if path <= 0.0 or gap == 0.0:
            break
        own = soft if depth == 0 else 0.5 * soft
        rate = p[4] / reach * slope(gap, p[7], own * reach)
        ahead = slope(gap * exp(-rate * path), p[7], own * reach)
        rate = 0.5 * (rate + p[4] / reach * ahead)
        change = -reach * gap * expm1(-rate * path)
        # a loop closes where the branch before began; the first, at the mirror image of its start
        closing = s[STACK + depth - 2] if depth > 1 else -base
        left = direction * (closing - s[FORCE])
        if depth > 0 and change >= left:
            change = left
            path += log1p(-min(left / (reach * gap), FULL)) / rate
            s[FORCE] = closing
            s[DEPTH] = max(depth - 2.0, 0.0)
        else:
            path = 0.0
            s[FORCE] += direction * change
        softened = exp(min(own * (along + 0.5 * change), SOFTEST))
        deflected += direction * change / p[4] * softened
    return deflected


def law(p, s, io):
    v = io[V]
    level = stribeck_level(io, p[0], p[1], p[2], p[8])
    io[OUT] = p[3] * io[VISCOUS] * v
    if level > 0.0:
        if v != 0.0:
            turn(s, copysign(1.0, v))
        before = s[FORCE]
        deflected = advance(p, s, io, level)
        io[OUT] += before + io[WHEN] * (s[FORCE] - before) + p[5] * deflected / io[DT]
    else:
        for i in range(STACK + TURNS):
            s[i] = 0.0


EFFECT = Effect(
    kind=Kind.FRICTION,
    summary="hysteresis with memory of its reversals, joined to the Stribeck curve",
    equation="dz/dt = v (1 - sgn(r) |r|^m), r = F_d/(g(v) sgn v - F_b);  F_h = F_b + F_d(z), "
    "dF_d/dz = sigma0 exp(-b |F_d|/2 Fs);  F = F_h + sigma1 dz/dt + sigma2 v;  "
    "g(v) = Fc + (Fs - Fc) exp(-|v/v0|^n)",
    source="Swevers et al. 2000; L. Jia 2023, eq. 2.10-2.12",
    parameters=(
        *STRIBECK_CURVE,
        VISCOUS_PART,
        stiffness_at_rest("stiffness after a reversal"),
        BRISTLE_DAMPING,
        Parameter("b", "1", 1.5, 0.0, 10.0, "log of the factor the stiffness falls by up to Fs"),
        Parameter("m", "1", 16.0, 1.0, 50.0, "sharpness of the onset of sliding", fixed=True),
        STRIBECK_EXPONENT,
    ),
    states=("F_h", "direction", "depth", *(f"turn_{i + 1}" for i in range(TURNS))),
    law=law,
    knees=(DEFLECTION, PEAK),
    curves=STRIBECK_CURVES,
    fingerprint="residual after a reversal that depends on where the axis turned before",
    excited_by="slow reversals, small ones within larger ones, and a velocity staircase",
)
