"""Confidence of a finding: how often such an answer was right."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

from identify.selection.acceptance import Score


@dataclass(frozen=True)
class Level:
    """Up to which error left, over the noise floor, answers were right how often, 0..1."""

    left: float
    right: float


LEVELS = (Level(1.3, 0.98), Level(inf, 0.89))


def confidence(left: float, score: Score) -> float:
    """How often answers that left so much error, over the noise floor, were right, 0..1."""
    return 0.98 if left <= 1.3 else 0.89
