"""A log that disagrees with the others of its axis."""

from __future__ import annotations

from dataclasses import dataclass

FEWEST = 3  # logs; of two, nobody can tell which of them is wrong


@dataclass(frozen=True)
class Disagreement:
    """A log that disagrees with the others.

    error, others: N RMS that a fit of the others leaves in it, and at most in any of them; of a
    moment its peaks. span: s, from when to when most of its error is; None where throughout.
    otherwise: the parameter that would be otherwise in it, "force" for a factor of all force; its
    value there and in the others; None where no single one explains it.
    """

    log: str
    error: float
    others: float
    span: tuple[float, float] | None = None
    otherwise: tuple[str, float, float] | None = None

    @property
    def times(self) -> float:
        """Its error over that of the others."""
        return self.error / self.others

    @property
    def is_sure(self) -> bool:
        """Whether it is told before the model has all that it lacks, which may look like it.

        Far out, with one value of its own or in a part of its time.
        """
        far = 4.0  # times the error of the others
        return self.times > far and (self.otherwise is not None or self.span is not None)
