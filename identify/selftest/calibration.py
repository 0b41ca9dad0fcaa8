"""Confidence against truth: its table from answers of the self-test, and whether it holds.

The table is fitted to machines of development seeds and judged on those of others.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identify.selection.confidence import Level
from identify.selftest.tally import Rate
from identify.selftest.trial import Answer, TrialResult

LEAST_ANSWERS = 30  # to a level: a rate of them is known to some 10 points
MOST_LEVELS = 5
TENTHS = 10


@dataclass(frozen=True)
class Tenth:
    """The answers whose stated confidence lies in one tenth. stated: its mean, 0..1."""

    stated: float
    right: Rate


def reliability(results: Sequence[TrialResult]) -> list[Tenth]:
    """Stated confidence against how often right, by tenths of it; empty tenths are left out."""
    answers = [a for a in answers_of(results) if np.isfinite(a.confidence)]  # no test contradicts
    out = []
    for i in range(TENTHS):
        inside = [a for a in answers if min(int(a.confidence * TENTHS), TENTHS - 1) == i]
        if inside:
            what = f"{100 * i // TENTHS} to {100 * (i + 1) // TENTHS} %"
            rate = Rate(what, sum(a.right for a in inside), len(inside))
            out.append(Tenth(float(np.mean([a.confidence for a in inside])), rate))
    return out


def answers_of(results: Sequence[TrialResult]) -> list[Answer]:
    """The answers that confidence speaks of.

    Less those where an effect was taken out of the catalogue: some laws contain that of another, so
    that another name need not be wrong.
    """
    return [a for o in results if o.case.known for a in o.answers]


def levels(answers: Sequence[Answer]) -> tuple[Level, ...]:
    """How often answers were right by the part they took: a falling staircase of a few levels.

    Levels hold equally many answers, at least LEAST_ANSWERS; one that is not below the one before
    is joined with it (isotonic regression: pool adjacent violators, R. E. Barlow et al.,
    Statistical Inference under Order Restrictions, 1972). The rate of a level is (right + 1) /
    (answers + 2), Laplace's rule, so that none is certain. The last has no end.
    """
    ordered = sorted(answers, key=lambda a: -a.part)
    count = min(max(len(ordered) // LEAST_ANSWERS, 1), MOST_LEVELS)
    pooled: list[list[Answer]] = []
    for part in np.array_split(np.arange(len(ordered)), count):
        pooled.append([ordered[i] for i in part])
        while len(pooled) > 1 and _rate(pooled[-1]) >= _rate(pooled[-2]):
            last = pooled.pop()
            pooled[-1] += last
    ends = [group[-1].part for group in pooled[:-1]] + [0.0]
    return tuple(Level(end, _rate(part)) for end, part in zip(ends, pooled, strict=True))


def _rate(answers: Sequence[Answer]) -> float:
    return (sum(a.right for a in answers) + 1) / (len(answers) + 2)
