"""The curves that laws assume, and how a free curve is laid over their coordinates."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any

from twin.excitation import Excitation


class Coordinate(Enum):
    """What a curve is drawn over."""

    POSITION = "position"
    SPEED = "speed"


@dataclass(frozen=True)
class Curve:
    """The curve that a law assumes, which on a machine may have another shape.

    over: its coordinate. period: name of the parameter that is the length after which it repeats;
    None where it does not. by_direction: whether each direction of motion has a curve of its own.
    rubs: whether it is a level of friction, so that only a curve that turns with the direction is
    another shape of it. bent_by: name of a parameter, held by design, that bends the law's own
    curve, such as an exponent; None where the law has none.
    """

    over: Coordinate
    period: str | None = None
    by_direction: bool = False
    rubs: bool = False
    bent_by: str | None = None


# What a friction law assumes: its level over speed, and one level all along the track.
FRICTION_CURVES = (
    Curve(Coordinate.SPEED, by_direction=True, rubs=True),
    Curve(Coordinate.POSITION, by_direction=True, rubs=True),
)
# The same with a Stribeck exponent, between what bearings and greases show (0.5 to 4).
STRIBECK_CURVES = (replace(FRICTION_CURVES[0], bent_by="n"), FRICTION_CURVES[1])


@dataclass(frozen=True)
class Part:
    """Strengths of a nonparametric effect that belong to one curve, and how it is smoothed.

    strengths: names, in order along the curve. stiffness: name of the parameter (a ratio) that
    weighs the smoothing; chosen from the data. rows: number of strengths n -> (m, n) such that a
    fit adds the square of stiffness x rows @ strengths to the mean square of the residual.
    """

    name: str
    strengths: tuple[str, ...]
    stiffness: str
    rows: Callable[[int], Any]


@dataclass(frozen=True)
class FreeShape:
    """How a nonparametric effect is laid over the coordinate of a law, in whose place it stands.

    Its first part is the same in both directions of motion, its second turns with the direction.
    laid: (curve, its period in m or None, the motion covered, whether it lets go at standstill) ->
    values by parameter name. over: names of those that say which coordinate it is. knots: values ->
    the coordinate (k,) of each knot to draw, in m or m/s, and which strength (k,) of a part it is.
    """

    laid: Callable[[Curve, float | None, Excitation, bool], dict[str, float]]
    over: tuple[str, ...]
    knots: Callable[[Mapping[str, float]], tuple[list[float], list[int]]]
