"""Confidence: a falling staircase, fitted to answers whose truth is known, and judged on others."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from built_results import errors, score_of

from identify.selection import confidence as stated
from identify.selection.confidence import Level
from identify.selection.findings import Finding, FindingKind
from identify.selftest.calibration import LEAST_ANSWERS, MOST_LEVELS, levels, reliability
from identify.selftest.case import Case
from identify.selftest.trial import Answer, TrialResult

MADE = Finding("a", (), 0.9, *errors(2.0, 1.0), "N", {}, score_of(0.9, 9.0, 0.1))


def answers(count: int, seed: int) -> list[Answer]:
    """Right with a chance that falls with the error left: exp(1 - left), from the floor on."""
    rng = np.random.default_rng(seed)
    return [
        Answer(("a",), FindingKind.MISSING, bool(rng.random() < np.exp(1.0 - left)), left)
        for left in 1.0 + rng.exponential(1.0, count)
    ]


def test_confidence_falls_with_the_error_that_is_left() -> None:
    told = [
        replace(MADE, left=left, left_fitted=fitted).confidence
        for left, fitted in ((1.2, 1.2), (1.2, 1.4), (1.4, 1.2), (1.4, 1.4), (99.0, 99.0))
    ]
    assert told == [told[0]] * 3 + [told[3]] * 2  # where it is noise on some of the logs
    assert told[0] > told[3]


def test_the_table_that_is_shipped_falls_and_has_no_end() -> None:
    right = [level.right for level in stated.LEVELS]
    assert right == sorted(right, reverse=True)
    assert all(0.0 < r < 1.0 for r in right)
    assert stated.LEVELS[-1].left == np.inf


def test_levels_fall_and_are_as_many_as_the_answers_allow() -> None:
    few, some, many = (levels(answers(n, 3)) for n in (LEAST_ANSWERS - 1, 65, 4000))
    assert len(few) == 1
    assert len(some) <= 2
    assert len(many) == MOST_LEVELS
    assert [v.right for v in many] == sorted((v.right for v in many), reverse=True)
    assert levels([]) == (Level(np.inf, 0.5),)


def stated_by(table: tuple[Level, ...], left: float) -> float:
    """What a table says of an answer that left so much."""
    return next(level.right for level in table if left <= level.left)


def test_a_table_of_some_answers_holds_on_others() -> None:
    table = levels(answers(4000, 1))
    judged = [replace(a, confidence=stated_by(table, a.left)) for a in answers(4000, 2)]
    found = reliability([TrialResult(Case(("a",), 5.0, 1), answers=tuple(judged))])
    assert sum(t.right.trials for t in found) == 4000
    for tenth in found:
        # Both tables are of a sample: four standard deviations of each.
        allowed = 4.0 * 0.5 * np.sqrt(1.0 / 800 + 1.0 / tenth.right.trials)
        assert abs(tenth.stated - tenth.right.value) < allowed


def test_an_answer_without_a_confidence_is_in_no_tenth() -> None:
    """Test logs contradict it."""
    sure, unsure = (replace(answers(1, 1)[0], confidence=c) for c in (0.9, np.nan))
    (tenth,) = reliability([TrialResult(Case(("a",), 5.0, 1), answers=(sure, unsure))])
    assert tenth.right.trials == 1
