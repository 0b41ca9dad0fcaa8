"""Why the logs do not prove a change, or not as that law: typed reasons.

They are put into words where they are shown (``identify.output.words.refusal``).
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, auto

from twin.knee import Imitated, Imitation
from twin.model.machine import AxisModel


@dataclass(frozen=True)
class TakesLittle:
    """It takes less of what is left than is asked; part: 0..1."""

    part: float


@dataclass(frozen=True)
class Uncertain:
    """Its gain is less sure than chance asks for; both as t."""

    t: float
    least: float


@dataclass(frozen=True)
class ByChance:
    """Shifted in time, where it cannot be real, it takes as much; part: 0..1."""

    part: float


@dataclass(frozen=True)
class OutsideKnee:
    """The motion does not pass a knee of the law, which is another one there.

    name: of the knee. size: of it, and edge: from which on it would be the law, both in unit. of:
    what the law is on this motion.
    """

    name: str
    size: float
    edge: float
    unit: str
    of: Imitated

    @classmethod
    def imitating(cls, imitation: Imitation, axis: AxisModel) -> OutsideKnee:
        """Of an effect of an axis that is another law there."""
        knee = imitation.knee
        unit = axis.units(knee.unit)
        return cls(knee.name, imitation.size, imitation.edge, unit, imitation.of)


@dataclass(frozen=True)
class EndsAtBound:
    """Values that ended at a bound belong to another law; labels: of these parameters."""

    labels: tuple[str, ...]


class Instead(Enum):
    """What explains as much, or whose place the law takes; or why it was not asked further."""

    NO_REFIT = auto()
    """One linear step promises too little."""
    ERROR_OF_ANOTHER_SIZE = auto()
    """Of noise: it is no good part of the error, or more than it."""
    ANY_FORCE_OF_THE_MOTION = auto()
    """The motion repeats with it."""
    WEIGHT_OF_BODIES = auto()
    """Their loads within the accuracy of the file."""
    ROTOR_OR_BODIES = auto()
    """Another rotor, or other values of the bodies within that accuracy."""
    CURVE_BETWEEN_KNOTS = auto()
    """A free curve beside it misses as much."""
    FRICTION = auto()
    """It takes the place of the friction."""
    FRICTION_OUT_OF_STEP = auto()
    """The friction alone, a moment earlier or later."""
    INERTIA = auto()
    """It takes the place of the inertia."""
    FORCE_BEFORE_ITS_STAMP = auto()
    """It would have the force act later, where it acts earlier."""
    LAW_WITHIN_BAND = auto()
    """Of a curve: its band holds the law everywhere."""


Refusal = TakesLittle | Uncertain | ByChance | OutsideKnee | EndsAtBound | Instead


def is_of_position(reason: Refusal | None) -> bool:
    """Whether what a law is instead is a force of position."""
    return isinstance(reason, OutsideKnee) and reason.of is Imitated.OF_POSITION
