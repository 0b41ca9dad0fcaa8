"""A force as a free curve of position, of the phase of a pitch, or of speed: a law's shape, found.

F = w (E(q) + d O(q)): E is the same in both directions, O turns with the direction d. The
coordinate is q = x per_metre + sqrt(|v| per_speed) - offset, of which one part is used: along the
track q goes from 0 to 1 over the covered travel, and a root of speed is finer near standstill.
E and O are piecewise linear over ``elements`` equal intervals of q and hold their end values beyond
them; where ``closed`` is 1 the curve repeats after each whole number of q, as along a pitch, and
its last knot is not used. d follows the motion within ``turn`` metres of travel. At standstill the
curve lets go: w = min(|v|/rest, 1); where ``rest`` is 0 it stays as it was, w = 1.

``twin add --shape EFFECT`` puts it where the law of an effect has the wrong shape. E and O are
smoothed each by its ``stiff``: a fit adds stiff^2 times the squared second differences of its
knots, and their squares over the square of their number, to the mean square of the residual
(P-splines: P. H. C. Eilers, B. D. Marx, "Flexible smoothing with B-splines and penalties", Statist.
Sci. 11, 1996).
"""

from collections.abc import Mapping
from functools import cache
from math import floor, sqrt

from twin.curve import Coordinate, Curve, FreeShape, Part
from twin.effect import COLUMNS, LEAST, MOST, OUT, Effect, Excitation, Kind, Parameter, V, X
from twin.law_parts import smooth, turned

KNOTS = 9  # where the knots' parameters begin


def place(p, s, io):
    """Knots to the left and right, part of the way between, direction, and w; s advances."""
    count = int(p[0])
    closed = p[4] > 0.5
    speed = abs(io[V])
    direction = turned(s, io, p[5])
    q = p[1] * io[X] + sqrt(p[2] * speed) - p[3]
    q = q - floor(q) if closed else min(max(q, 0.0), 1.0)
    left = min(int(q * count), count - 1)
    right = 0 if closed and left == count - 1 else left + 1
    share = speed / p[6] if speed < p[6] else 1.0
    return left, right, q * count - left, direction, share


def law(p, s, io):
    left, right, part, direction, share = place(p, s, io)
    even, odd = KNOTS, KNOTS + int(p[0]) + 1
    force = (1.0 - part) * p[even + left] + part * p[even + right]
    force += direction * ((1.0 - part) * p[odd + left] + part * p[odd + right])
    io[OUT] = share * force


def columns(p, s, io):
    left, right, part, direction, share = place(p, s, io)
    odd = int(p[0]) + 1
    io[COLUMNS] = 4
    at = COLUMNS + 1
    for knot, weight in ((left, 1.0 - part), (right, part)):
        io[at], io[at + 1] = knot, share * weight
        io[at + 2], io[at + 3] = odd + knot, share * weight * direction
        at += 4


LETS_GO = 1e-3  # of the highest speed, below which a curve that lets go does
AT_ONCE = 1e-9  # m of travel
HELD = 1e-4  # of the covered travel, that turns the direction of one that stays


def laid(
    curve: Curve, period: float | None, covered: Excitation, lets_go: bool
) -> dict[str, float]:
    """Values that lay the curve over a coordinate; see FreeShape."""
    values = {
        "per_metre": 0.0, "per_speed": 0.0, "offset": 0.0, "closed": float(period is not None),
        "turn": AT_ONCE if lets_go else HELD * covered.travel,
        "rest": LETS_GO * covered.speed_max if lets_go else 0.0,
    }  # fmt: skip
    if curve.over is Coordinate.SPEED:
        return {**values, "per_speed": 1.0 / covered.speed_max}
    length = period or covered.travel
    begin = 0.0 if period else covered.position_low / length
    return {**values, "per_metre": 1.0 / length, "offset": begin}


def knots(values: Mapping[str, float]) -> tuple[list[float], list[int]]:
    """Coordinate (k,) of each knot, m or m/s, and which knot it is; see FreeShape."""
    count = int(values["elements"])
    index = [*range(count), 0 if values["closed"] else count]
    along = [i / count for i in range(count + 1)]
    if values["per_speed"]:
        return [q * q / values["per_speed"] for q in along], index
    return [(q + values["offset"]) / values["per_metre"] for q in along], index


@cache
def of_size(elements: int) -> Effect:
    """The curve with that many intervals."""
    even, odd = (tuple(f"{c}_{i}" for i in range(1, elements + 2)) for c in "eo")
    return Effect(
        kind=Kind.FORCE,
        summary="free curve of position, phase or speed in a law's place; not a physical law",
        equation="F = w (E(q) + d O(q)),  q = x per_metre + sqrt(|v| per_speed) - offset;  "
        "w = min(|v|/rest, 1)",
        source="none; smoothing after Eilers, Marx 1996",
        parameters=(
            Parameter("elements", "1", elements, elements, elements, "number of intervals"),
            Parameter(
                "per_metre", "1/m", 3.0, 0.0, MOST, "coordinate by position", fixed=True,
                start_rule=lambda e: 1.0 / e.travel,
            ),
            Parameter("per_speed", "s/m", 0.0, 0.0, MOST, "coordinate by speed", fixed=True),
            Parameter(
                "offset", "1", 0.0, -1e9, 1e9, "coordinate where the curve begins", fixed=True,
                start_rule=lambda e: e.position_low / e.travel,
            ),
            Parameter("closed", "1", 0.0, 0.0, 1.0, "1 where the curve repeats", fixed=True),
            Parameter(
                "turn", "m", 3e-5, AT_ONCE, MOST, "travel that turns the direction", fixed=True,
                start_rule=lambda e: HELD * e.travel,
            ),
            Parameter(
                "rest", "m/s", 0.0, 0.0, MOST, "speed below which the curve lets go", fixed=True,
            ),
            *(
                Parameter(f"stiff_{c}", "N", 1e-3, LEAST, MOST, f"bend expected of {c.upper()}",
                          fixed=True)
                for c in "eo"
            ),
            *(Parameter(n, "N", 0.0, -MOST, MOST, "E, in both directions", strength=True)
              for n in even),
            *(Parameter(n, "N", 0.0, -MOST, MOST, "O, that turns with the direction", strength=True)
              for n in odd),
        ),
        states=("direction",),
        several=True,
        law=law,
        columns=columns,
        fingerprint="what a law leaves whose shape differs from that of the machine's force",
        excited_by="passes over the whole range of the coordinate in both directions",
        of_size=of_size,
        free_shape=FreeShape(laid, ("per_metre", "per_speed", "closed"), knots),
        parts=(
            Part("both directions", even, "stiff_e", smooth),
            Part("direction", odd, "stiff_o", smooth),
        ),
    )  # fmt: skip


EFFECT = of_size(40)
