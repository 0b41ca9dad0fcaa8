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
    """The curve that a law assumes, which on a machine may have another shape."""

    over: Coordinate
    """What it is drawn over."""
    period: str | None = None
    """Name of the parameter (m) after which it repeats; None where it does not."""
    by_direction: bool = False
    """Whether each direction of motion has a curve of its own."""
    rubs: bool = False
    """Whether it is a level of friction: only a curve that turns with the direction is another
    shape of it."""
    bent_by: str | None = None
    """Name of a parameter, held by design, that bends the law's own curve, such as an exponent."""


# What a friction law assumes: its level over speed, and one level all along the track.
FRICTION_CURVES = (
    Curve(Coordinate.SPEED, by_direction=True, rubs=True),
    Curve(Coordinate.POSITION, by_direction=True, rubs=True),
)
# The same with a Stribeck exponent, between what bearings and greases show (0.5 to 4).
STRIBECK_CURVES = (replace(FRICTION_CURVES[0], bent_by="n"), FRICTION_CURVES[1])


@dataclass(frozen=True)
class Part:
    """Strengths of a nonparametric effect that belong to one curve, and how it is smoothed."""

    name: str
    """What the curve is drawn over, in words."""
    strengths: tuple[str, ...]
    """Names of its n strengths, in order along the curve."""
    stiffness: str
    """Name of the parameter that weighs the smoothing; chosen from the data."""
    rows: Callable[[int], Any]
    """n -> (m, n): a fit adds the square of stiffness x rows @ strengths to the mean square of the
    residual."""


@dataclass(frozen=True)
class FreeShape:
    """How a nonparametric effect is laid over the coordinate of a law, in whose place it stands.

    Its first part is the same in both directions of motion, its second turns with the direction.
    """

    laid: Callable[[Curve, float | None, Excitation, bool], dict[str, float]]
    """(curve, its period in m or None, the motion covered, whether it lets go at standstill) ->
    values by parameter name."""
    over: tuple[str, ...]
    """Names of the parameters that say which coordinate it is laid over."""
    knots: Callable[[Mapping[str, float]], tuple[list[float], list[int]]]
    """Values by name -> the coordinate (k,) of each knot to draw, m or m/s, and which strength
    (k,) of a part it is."""
