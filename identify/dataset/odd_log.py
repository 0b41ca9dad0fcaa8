"""A log that disagrees with the others of its axis."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from enum import Enum

FEWEST = 3  # logs; of two, nobody can tell which of them is wrong


class Recorded(Enum):
    """What may be otherwise in a recording and is no parameter of a model."""

    GAIN = "gain"  # of the force that was recorded, over what acted
    CONSTANT = "constant"  # N, that acts in it alone
    DELAY = "delay"  # s, by which its force came later


@dataclass(frozen=True)
class Otherwise:
    """One value that explains how a log disagrees: it in the log, and in the others.

    what: the parameter by its label, or what is of the recording.
    """

    what: str | Recorded
    there: float
    elsewhere: float

    @property
    def effect(self) -> str | None:
        """The effect whose parameter it is; None of the mass, and of what is of the recording."""
        return None if isinstance(self.what, Recorded) else self.what.partition(".")[0]


@dataclass(frozen=True)
class Disagreement:
    """A log that disagrees with the others.

    error, others: N RMS that a fit of the others leaves in it, and at most in any of them; of a
    moment its peaks. span: s, from when to when most of its error is; None where throughout.
    otherwise: None where no single value explains it. at_rest: whether it is at rest then, which
    says nothing of the model: the log serves it as it is.
    """

    log: str
    error: float
    others: float
    span: tuple[float, float] | None = None
    otherwise: Otherwise | None = None
    at_rest: bool = False

    @property
    def times(self) -> float:
        """Its error over that of the others."""
        return self.error / self.others

    @property
    def is_of_recording(self) -> bool:
        """Whether its own value is one of the recording, and no parameter of a model."""
        return self.otherwise is not None and isinstance(self.otherwise.what, Recorded)

    @property
    def is_sure(self) -> bool:
        """Whether it is told before the model has all that it lacks, which may look like it.

        Far out, with one value of its own or in a part of its time.
        """
        far = 4.0  # times the error of the others
        return self.times > far and (self.otherwise is not None or self.span is not None)

    def is_sure_beside(self, laws: Collection[str]) -> bool:
        """Whether it is sure, and its own value is of none of these laws, by names of effects."""
        return self.is_sure and (self.otherwise is None or self.otherwise.effect not in laws)
