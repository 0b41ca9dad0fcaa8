"""A force that no physical effect explains, as smooth curves of position, speed and time.

F = A(x) + z D(x) + v/speed E(x) + B(v) + C(t/T). It is not a physical law: it lowers the error and
shows the shape of the missing force, but is valid only within the motion of the logs. A, D and E
are piecewise linear over ``elements`` equal intervals along the track; B over 16 intervals of
sgn(v) sqrt(|v|/speed), finer near standstill; C over 12 intervals of the period T, closed to a
ring. z is the direction with a memory of the last ``turn`` metres, dz/dt = (v - |v| z)/turn, so
that the force does not jump at a reversal. Beyond the covered travel A, D and E fade to zero within
one interval; beyond the covered speed B and E hold their end value.

Each curve is smoothed by its ``stiff``: a fit adds stiff^2 times the squared second differences of
its knots, and their squares over the square of their number, to the mean square of the residual
(P-splines: P. H. C. Eilers, B. D. Marx, "Flexible smoothing with B-splines and penalties", Statist.
Sci. 11, 1996). T is the strongest line in the spectrum of the force; t counts from the start of
each log, so C only helps where the phase is the same in all logs.
"""

from functools import cache
from math import copysign, expm1, sqrt
from typing import Any

from twin.curve import Part
from twin.effect import DT, LEAST, MOST, OUT, TIME, WHEN, Effect, Kind, Parameter, V, X
from twin.law_parts import COVERED_MOTION, smooth

KNOTS = 11  # where the knots' parameters begin
SPEEDS = 17
PHASES = 12


def curve(p, first, intervals, place):
    """Piecewise-linear curve through even knots at a place 0..1; beyond, its end value."""
    along = min(max(place, 0.0), 1.0) * intervals
    left = min(int(along), intervals - 1)
    low = p[first + left]
    return low + (along - left) * (p[first + left + 1] - low)


def inside(place, margin):
    """1 at a place 0..1, falling to zero within a margin beyond."""
    return max(1.0 - max(-place, place - 1.0, 0.0) / margin, 0.0)


def ring(p, first, turns):
    """Closed piecewise-linear curve of a number of turns."""
    along = (turns % 1.0) * PHASES
    left = min(int(along), PHASES - 1)
    low = p[first + left]
    return low + (along - left) * (p[first + (left + 1) % PHASES] - low)


def law(p, s, io):
    count = int(p[0])
    place = (io[X] - p[1]) / p[2]
    relative = min(max(io[V] / p[3], -1.0), 1.0)
    change = -expm1(-abs(io[V]) * io[DT] / p[4]) * (copysign(1.0, io[V]) - s[0])
    direction = s[0] + io[WHEN] * change
    s[0] += change
    turning = KNOTS + count + 1
    braking = turning + count + 1
    speeds = braking + count + 1
    along = (
        curve(p, KNOTS, count, place)
        + direction * curve(p, turning, count, place)
        + relative * curve(p, braking, count, place)
    )
    io[OUT] = (
        inside(place, 1.0 / count) * along
        + curve(p, speeds, SPEEDS - 1, 0.5 + copysign(0.5 * sqrt(abs(relative)), relative))
        + ring(p, speeds + SPEEDS, io[TIME] / p[5])
    )


def smooth_ring(knots: int) -> Any:
    """The same for a closed curve."""
    import numpy as np

    own = np.eye(knots)
    bends = np.roll(own, 1, axis=0) - 2.0 * own + np.roll(own, -1, axis=0)
    return np.vstack([bends, own / knots])


@cache
def of_size(elements: int) -> Effect:
    """The map with that many intervals along the track."""
    counts = {**dict.fromkeys("xde", elements + 1), "v": SPEEDS, "t": PHASES}
    own = {key: tuple(f"{key}_{i}" for i in range(1, n + 1)) for key, n in counts.items()}
    return Effect(
        kind=Kind.FORCE,
        summary="fitted curves of position, direction, speed and time; not a physical law",
        equation="F = A(x) + z D(x) + v/speed E(x) + B(v) + C(t/T);  dz/dt = (v - |v| z)/turn",
        source="none; smoothing after Eilers, Marx 1996",
        parameters=(
            *_shared(elements),
            *_knots(own["x"], "A, force by position"),
            *_knots(own["d"], "D, force by position that turns with the direction"),
            *_knots(own["e"], "E, force by position that grows with speed"),
            *_knots(own["v"], "B, force by speed"),
            *_knots(own["t"], "C, force by phase of the period"),
        ),
        states=("direction",),
        law=law,
        fingerprint="whatever the physical effects leave that depends on one coordinate at a time",
        excited_by="passes over the whole travel at several speeds in both directions",
        of_size=of_size,
        parts=(
            Part("position", own["x"], "stiff_x", smooth),
            Part("direction and position", own["d"], "stiff_d", smooth),
            Part("speed and position", own["e"], "stiff_e", smooth),
            Part("speed", own["v"], "stiff_v", smooth),
            Part("time phase", own["t"], "stiff_t", smooth_ring),
        ),
    )


def _shared(elements: int) -> tuple[Parameter, ...]:
    return (
        Parameter("elements", "1", elements, elements, elements, "number of intervals in x"),
        *COVERED_MOTION,
        Parameter(
            "turn", "m", 3e-4, LEAST, MOST, "travel after which a reversal is forgotten",
            fixed=True, start_rule=lambda e: 1e-3 * e.travel,
        ),
        Parameter(
            "T", "s", 1.0, 1e-4, 1e4, "period of what repeats in time", fixed=True,
            start_rule=lambda e: 1.0 / e.lines[0] if e.lines else 1.0,
        ),
        *(
            Parameter(
                f"stiff_{key}", "N", 1e-3, LEAST, MOST, f"bend expected of {what}", fixed=True,
            )
            for key, what in (("x", "A"), ("d", "D"), ("e", "E"), ("v", "B"), ("t", "C"))
        ),
    )  # fmt: skip


def _knots(names: tuple[str, ...], meaning: str) -> tuple[Parameter, ...]:
    return tuple(Parameter(n, "N", 0.0, -MOST, MOST, meaning, strength=True) for n in names)


EFFECT = of_size(40)
