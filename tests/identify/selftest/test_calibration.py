"""Confidence: a rising staircase, fitted to answers whose truth is known, and judged on others."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from built_results import errors

from identify.selection import confidence as stated
from identify.selection.confidence import Level, confidence
from identify.selection.decoys import Proof
from identify.selection.findings import Finding, FindingKind
from identify.selftest.calibration import LEAST_ANSWERS, MOST_LEVELS, levels, reliability
from identify.selftest.case import Case
from identify.selftest.trial import Answer, TrialResult

MADE = Finding("a", (), 0.9, *errors(2.0, 1.0), "N", {}, Proof(0.75, 0.5))


def answers(count: int, seed: int) -> list[Answer]:
    """Right with a chance that grows with the margin: 1 - exp(-margin)."""
    rng = np.random.default_rng(seed)
    return [
        Answer(("a",), FindingKind.MISSING, bool(rng.random() < 1.0 - np.exp(-m)), m)
        for m in rng.exponential(1.0, count)
    ]


def test_a_margin_is_how_many_times_less_is_left_than_by_the_best_decoy() -> None:
    assert MADE.margin == pytest.approx(np.log(2.0))
    assert replace(MADE, proof=None).margin == pytest.approx(np.log(4.0))
    assert np.isfinite(replace(MADE, proof=Proof(1.0, 0.3)).margin)
    assert replace(MADE, proof=Proof(0.5, -0.5)).margin > 0.0 > replace(
        MADE, proof=Proof(0.5, 0.6)
    ).margin  # fmt: skip


def test_confidence_rises_with_the_margin(monkeypatch) -> None:
    monkeypatch.setattr(stated, "BESIDE_DECOYS", (Level(0.2, 0.6), Level(1.0, 0.9)))
    found = [confidence(m, beside_decoys=True) for m in (-1.0, 0.2, 0.99, 1.0, 9.0)]
    assert found == [0.6, 0.6, 0.6, 0.9, 0.9]


def test_the_table_that_is_shipped_rises() -> None:
    for table in (stated.BESIDE_DECOYS, stated.WITHOUT_DECOYS):
        right = [level.right for level in table]
        assert right == sorted(right)
        assert all(0.0 < r < 1.0 for r in right)


def test_levels_rise_and_are_as_many_as_the_answers_allow() -> None:
    few, some, many = (levels(answers(n, 3)) for n in (LEAST_ANSWERS - 1, 65, 4000))
    assert len(few) == 1
    assert len(some) <= 2
    assert len(many) == MOST_LEVELS
    assert [v.right for v in many] == sorted(v.right for v in many)
    assert levels([]) == (Level(0.0, 0.5),)


def test_a_table_of_some_answers_holds_on_others(monkeypatch) -> None:
    monkeypatch.setattr(stated, "BESIDE_DECOYS", levels(answers(4000, 1)))
    judged = [
        replace(a, confidence=confidence(a.margin, beside_decoys=True)) for a in answers(4000, 2)
    ]
    found = reliability([TrialResult(Case(("a",), 5.0, 1), answers=tuple(judged))])
    assert sum(t.right.trials for t in found) == 4000
    for tenth in found:
        # Both tables are of a sample: four standard deviations of each.
        allowed = 4.0 * 0.5 * np.sqrt(1.0 / 800 + 1.0 / tenth.right.trials)
        assert abs(tenth.stated - tenth.right.value) < allowed
