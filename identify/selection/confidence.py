"""Confidence of a finding: how often such an answer was right on machines of the self-test.

It is read from what all findings together leave, of the training logs or of those that chose,
whichever is less: where that is noise, names were nearly always right; where error is left on both,
one of them may stand for what is not in the catalogue. How clearly an effect beats its decoys says
no more: small margins were right as often as large ones. The table is not fitted to the machines on
which it is judged: `twin selftest --full` draws those with the seed of the release and prints
stated confidence beside how often right.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf


@dataclass(frozen=True)
class Level:
    """Up to which error left, over the noise floor, answers were right how often, 0..1."""

    left: float
    right: float


# 525 answers on some 600 machines of seeds 808, 909 and 1010 (0 to 5 floors, all variations, pairs,
# effects outside the catalogue): 433 of 439 that left noise were right, 77 of 86 of the others.
# `python -m benchmarks.confidence --seed 1` fits the table anew.
LEVELS = (Level(1.3, 0.98), Level(inf, 0.89))


def confidence(left: float) -> float:
    """How often answers that left so much error, over the noise floor, were right, 0..1."""
    return next((level.right for level in LEVELS if left <= level.left), LEVELS[-1].right)
