"""Confidence: a falling staircase, fitted to answers whose truth is known, and judged on others."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from built_fits import built_dataset, built_fit
from built_results import errors

from identify.selection import confidence as stated
from identify.selection.confidence import Level, confidence
from identify.selection.findings import Finding, FindingKind, as_a_whole
from identify.selftest.calibration import LEAST_ANSWERS, MOST_LEVELS, levels, reliability
from identify.selftest.case import Case
from identify.selftest.trial import Answer, TrialResult

MADE = Finding("a", (), 0.9, *errors(2.0, 1.0), "N", {}, None)


def answers(count: int, seed: int) -> list[Answer]:
    """Right with a chance that falls with the error left: exp(1 - left), from the floor on."""
    rng = np.random.default_rng(seed)
    return [
        Answer(("a",), FindingKind.MISSING, bool(rng.random() < np.exp(1.0 - left)), left)
        for left in 1.0 + rng.exponential(1.0, count)
    ]


def test_confidence_falls_with_the_error_that_is_left(monkeypatch) -> None:
    monkeypatch.setattr(stated, "LEVELS", (Level(1.3, 0.9), Level(np.inf, 0.6)))
    assert [confidence(left) for left in (0.8, 1.3, 1.31, 99.0)] == [0.9, 0.9, 0.6, 0.6]
    told = [
        replace(MADE, left=left, left_fitted=fitted).confidence
        for left, fitted in ((1.2, 1.2), (1.2, 1.4), (1.4, 1.2), (1.4, 1.4))
    ]
    assert told == [0.9, 0.9, 0.9, 0.6]  # where it is noise on some of the logs


def test_all_findings_together_leave_the_least_that_the_shapes_among_them_leave() -> None:
    final = built_fit(2.0, 0.5)
    shape = replace(MADE, kind=FindingKind.WRONG_SHAPE, chosen=errors(2.0, 0.7)[1])
    dataset = built_dataset("one", held=())
    alone, among = as_a_whole((MADE,), final, dataset), as_a_whole((MADE, shape), final, dataset)
    assert {f.left_fitted for f in (*alone, *among)} == {final.ratio}
    assert [f.left for f in alone] == pytest.approx([2.0 / 0.5])
    assert [f.left for f in among] == pytest.approx([0.7 / 0.5] * 2)


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


def test_a_table_of_some_answers_holds_on_others(monkeypatch) -> None:
    monkeypatch.setattr(stated, "LEVELS", levels(answers(4000, 1)))
    judged = [replace(a, confidence=confidence(a.left)) for a in answers(4000, 2)]
    found = reliability([TrialResult(Case(("a",), 5.0, 1), answers=tuple(judged))])
    assert sum(t.right.trials for t in found) == 4000
    for tenth in found:
        # Both tables are of a sample: four standard deviations of each.
        allowed = 4.0 * 0.5 * np.sqrt(1.0 / 800 + 1.0 / tenth.right.trials)
        assert abs(tenth.stated - tenth.right.value) < allowed
