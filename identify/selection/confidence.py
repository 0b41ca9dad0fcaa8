"""Confidence of a finding: how often such an answer was right, on machines with a known truth.

It is read from two figures of the score (``acceptance``), each the smaller of that on the training
logs and on others: the part of what was left that the finding takes, and t, how sure its gain is
over blocks. What takes nearly all of it was nearly always right, on own machines, on those of
another simulator and on real drives with a term withheld; what takes a third may stand for
something that is not in the catalogue. A gain that hardly differs from chance was that of a wrong
name half of the time, above all where a larger effect was found before it. What is left beside it,
how clearly it beats its controls and how many rivals it has told no more.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Level:
    """From which value on answers were right how often, 0..1."""

    least: float
    right: float


# As `python -m benchmarks confidence` fits it to 607 answers, of two seeds of the self-test, of two
# of the second simulator and of 13 real machines with a term withheld; fitted to a half of them it
# holds for the other half within 5 points.
BY_PART = (
    Level(0.96, 0.99),
    Level(0.92, 0.98),
    Level(0.81, 0.95),
    Level(0.59, 0.94),
    Level(0.0, 0.87),
)
# Of 206 answers, of 130 machines of the self-test, 48 drives of another simulator and the 13 real
# ones: with t below 3, 10 of 16 were right, below 4 16 of 17, beyond nearly all. The rates are
# (right + 1)/(answers + 2).
BY_T = (Level(4.0, 0.99), Level(3.0, 0.89), Level(0.0, 0.61))


def confidence(part: float, t: float) -> float:
    """How often answers that took such a part, and with such a t, were right, 0..1."""
    return min(read(BY_PART, part), read(BY_T, t))


def read(table: Sequence[Level], value: float) -> float:
    """The rate of the level that a value reaches."""
    return next((level.right for level in table if value >= level.least), table[-1].right)
