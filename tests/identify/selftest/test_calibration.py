"""Confidence: a falling staircase, fitted to answers whose truth is known, and judged on others."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identify.selection import confidence as stated
from identify.selection.confidence import Level, confidence
from identify.selection.findings import FindingKind
from identify.selftest.calibration import LEAST_ANSWERS, MOST_LEVELS, levels, reliability
from identify.selftest.case import Case
from identify.selftest.trial import Answer, TrialResult


def answers(count: int, seed: int) -> list[Answer]:
    """Right with a chance that is the part they took."""
    rng = np.random.default_rng(seed)
    return [
        Answer(("a",), FindingKind.MISSING, bool(rng.random() < part), part)
        for part in rng.random(count)
    ]


def test_the_table_that_is_shipped_falls_and_has_no_end() -> None:
    right = [level.right for level in stated.LEVELS]
    assert right == sorted(right, reverse=True)
    assert all(0.0 < r < 1.0 for r in right)
    assert stated.LEVELS[-1].part == 0.0


def test_levels_fall_and_are_as_many_as_the_answers_allow() -> None:
    few, some, many = (levels(answers(n, 3)) for n in (LEAST_ANSWERS - 1, 65, 4000))
    assert len(few) == 1
    assert len(some) <= 2
    assert len(many) == MOST_LEVELS
    assert [v.right for v in many] == sorted((v.right for v in many), reverse=True)
    assert levels([]) == (Level(0.0, 0.5),)


def test_a_table_of_some_answers_holds_on_others(monkeypatch) -> None:
    monkeypatch.setattr(stated, "LEVELS", levels(answers(4000, 1)))
    judged = [replace(a, confidence=confidence(a.part)) for a in answers(4000, 2)]
    found = reliability([TrialResult(Case(("a",), 5.0, 1), answers=tuple(judged))])
    assert sum(t.right.trials for t in found) == 4000
    for tenth in found:
        # Both tables are of a sample: four standard deviations of each.
        allowed = 4.0 * 0.5 * np.sqrt(1.0 / 800 + 1.0 / tenth.right.trials)
        assert abs(tenth.stated - tenth.right.value) < allowed
