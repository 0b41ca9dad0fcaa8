"""What makes a law itself: a knee, reach, limit, play, period or delay that the motion passes.

Where the motion does not pass it, the law makes the force of another one: a saturation whose limit
lies below every command is a gain, a friction that does not slip within the travel is a spring.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum

from twin.excitation import Excitation

Values = Mapping[str, float]
REACH = "reach"  # the name of a knee: how far contacts bend before they slide, m


class Imitated(Enum):
    """What a law is where the motion does not pass its knee, in words of the field."""

    NOTHING = "nothing"
    GAIN = "a gain of the motor"
    INERTIA = "an inertia"
    LOAD_ON_SPRING = "a load on a spring"
    SPRING = "a spring"
    OF_POSITION = "a force of position"
    CONSTANT = "a constant force"
    DRY_FRICTION = "dry friction"
    WITHOUT_PEAK = "a friction without a static peak"
    OF_SPEED = "a friction of the speed alone"
    OF_THIS_JOINT = "a friction of this joint alone"
    DRIFT = "a slow drift"
    ROUNDING = "the rounding of the readings"


@dataclass(frozen=True)
class Knee:
    """One size of a law, and between which sizes a motion shows it."""

    name: str
    """What it is called: the parameter that it is, else a word such as "reach"."""
    unit: str
    """Its SI unit on a linear axis."""
    size: Callable[[Values, Excitation], float]
    """(values by name, the motion covered) -> its size, in ``unit``."""
    shown: Callable[[Values, Excitation], tuple[float, float]]
    """(values by name, the motion covered) -> the smallest and the largest that the motion shows,
    in ``unit``."""
    below: Imitated | None = None
    """What the law is where the size is smaller; None: still itself."""
    above: Imitated | None = None
    """What it is where the size is larger; None: still itself."""

    def bounds(self, values: Values, covered: Excitation) -> tuple[float, float]:
        """Between which sizes, in ``unit``, the law is itself."""
        low, high = self.shown(values, covered)
        return (low if self.below else float("-inf")), (high if self.above else float("inf"))

    def imitation(self, values: Values, covered: Excitation) -> Imitation | None:
        """What the law is with these values where it is not itself; None where it is."""
        size, (low, high) = self.size(values, covered), self.bounds(values, covered)
        imitated = self.below if size < low else self.above if size > high else None
        return imitated and Imitation(self, size, low if size < low else high, imitated)


@dataclass(frozen=True)
class Imitation:
    """A law that is another one on some motion: by which knee, of what size, beyond which."""

    knee: Knee
    size: float
    """Of the knee, in its unit."""
    edge: float
    """The size nearest to it with which the law would be itself, in the same unit."""
    of: Imitated
    """What it is."""
