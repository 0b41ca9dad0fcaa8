"""Confidence of a finding: how often such an answer was right, on machines with a known truth.

It is read from the part of what was left that the finding takes (``acceptance``), the smaller of
that on the training logs and on others. What takes nearly all of it was nearly always right, on own
machines, on those of another simulator and on real drives with a term withheld; what takes a third
may stand for something that is not in the catalogue. What is left beside it, how clearly it beats
its controls and how many rivals it has told no more.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Level:
    """From which part on answers were right how often, both 0..1."""

    part: float
    right: float


# As `python -m benchmarks confidence` fits it to all answers; fitted to a half of them it holds for
# the other half within 5 points. Answers of two seeds of the self-test, of two of the second
# simulator and of 13 real machines with a term withheld: 607.
LEVELS = (
    Level(0.96, 0.99),
    Level(0.92, 0.98),
    Level(0.81, 0.95),
    Level(0.59, 0.94),
    Level(0.0, 0.87),
)


def confidence(part: float) -> float:
    """How often answers that took such a part were right, 0..1."""
    return next((level.right for level in LEVELS if part >= level.part), LEVELS[-1].right)
