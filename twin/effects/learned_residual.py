"""A small data-driven model of a force that depends on several coordinates together.

F = sum c_ijab cos(pi i q) T_j(v/speed) z1^a z2^b over the hyperbolic cross
(1 + i)(1 + j)(1 + a)(1 + b) <= 24, j <= 3, a, b <= 1: fine in one coordinate or coarse in several,
which is as much as few data determine. q is the place along the covered travel, 0..1; T_j a
Chebyshev polynomial; z1 and z2 the direction with a memory of the distance since the reversal,
short and long, dz/dt = (v - |v| z)/reach. It is not a physical law: it is learned from the logs, is
valid only within their motion, and its coefficients have no meaning one by one. Beyond the covered
travel it fades to zero within a 24th of it; beyond the covered speed it holds its value. A fit adds
``stiff``^2 times the squares of the c_ijab, each times its product above, to the mean square of the
residual (ridge).
D. Dung, V. Temlyakov, T. Ullrich, Hyperbolic Cross Approximation, Birkhaeuser (2018).
"""

from math import copysign, cos, expm1, pi
from typing import Any

from twin.curve import Part
from twin.effect import DT, LEAST, MOST, OUT, WHEN, Effect, Kind, Parameter, V, X
from twin.law_parts import COVERED_MOTION

CROSS = 24
SPEEDS = 4  # powers of speed, from 0


def remembered(s, i, io, reach):
    """Direction with the memory of a distance, at the wanted instant; steps the state."""
    change = -expm1(-abs(io[V]) * io[DT] / reach) * (copysign(1.0, io[V]) - s[i])
    s[i] += change
    return s[i] - (1.0 - io[WHEN]) * change


def series(p, first, count, wave):
    """Sum of p[first + i] cos(i t) over ``count`` terms, wave = cos(t)."""
    total, now, following = 0.0, 1.0, wave
    for i in range(count):
        total += p[first + i] * now
        now, following = following, 2.0 * wave * following - now
    return total


def law(p, s, io):
    place = (io[X] - p[0]) / p[1]
    inside = max(1.0 - CROSS * max(-place, place - 1.0, 0.0), 0.0)
    wave = cos(pi * min(max(place, 0.0), 1.0))
    speed = min(max(io[V] / p[2], -1.0), 1.0)
    short = remembered(s, 0, io, p[3])
    long = remembered(s, 1, io, p[4])
    at, force, now, following = 6, 0.0, 1.0, speed  # where the coefficients begin
    for j in range(SPEEDS):
        for a in range(2):
            for b in range(2):
                count = CROSS // ((1 + j) * (1 + a) * (1 + b))
                factor = now * (short if a else 1.0) * (long if b else 1.0)
                force += factor * series(p, at, count, wave)
                at += count
        now, following = following, 2.0 * speed * following - now
    io[OUT] = inside * force


ORDERS = {
    f"c_{i}_{j}_{a}_{b}": float((1 + i) * (1 + j) * (1 + a) * (1 + b))
    for j in range(SPEEDS)
    for a in range(2)
    for b in range(2)
    for i in range(CROSS // ((1 + j) * (1 + a) * (1 + b)))
}


def ridge(count: int) -> Any:
    """Penalty (count, count) of each coefficient, larger for finer and mixed terms."""
    import numpy as np  # the catalogue is listed without it

    return np.diag(list(ORDERS.values())[:count])


EFFECT = Effect(
    kind=Kind.FORCE,
    summary="small learned model of position, speed and reversals; not a physical law",
    equation="F = sum c_ijab cos(pi i q) T_j(v/speed) z1^a z2^b,  "
    "(1+i)(1+j)(1+a)(1+b) <= 24;  dz/dt = (v - |v| z)/reach",
    source="none; basis after Dung, Temlyakov, Ullrich, Hyperbolic Cross Approximation, 2018",
    parameters=(
        *COVERED_MOTION,
        Parameter(
            "reach1", "m", 3e-4, LEAST, MOST, "short memory of a reversal", fixed=True,
            start_rule=lambda e: 1e-3 * e.travel,
        ),
        Parameter(
            "reach2", "m", 0.015, LEAST, MOST, "long memory of a reversal", fixed=True,
            start_rule=lambda e: 0.05 * e.travel,
        ),
        Parameter("stiff", "1", 0.1, 1e-9, 1e9, "ridge on the coefficients", fixed=True),
        *(Parameter(n, "N", 0.0, -MOST, MOST, "a coefficient", strength=True) for n in ORDERS),
    ),
    states=("z1", "z2"),
    law=law,
    fingerprint="residual depends on several coordinates together",
    excited_by="varied motion over the whole range of position, speed and reversals",
    parts=(Part("all coordinates", tuple(ORDERS), "stiff", ridge),),
)  # fmt: skip
