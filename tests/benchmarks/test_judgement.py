"""What the judges count as right: on a diagnosis of planted logs, and on findings as given."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from planted_logs import SLIDE, asked, few, having

from benchmarks.judgement import Expected, in_line, row_of, stated_wrong
from benchmarks.withheld import CASES, judge
from identify.selection.diagnosis import AxisDiagnosis
from identify.selection.findings import Finding, FindingKind

FEW = few("asymmetric_friction", "cogging", "quadratic_drag")


@pytest.fixture(scope="module")
def found() -> AxisDiagnosis:
    """A machine with cogging that its model lacks."""
    return asked(SLIDE, having(SLIDE, "cogging", p=0.021, a1=0.03, b1=0.02), FEW)


def test_a_row_holds_the_answer_and_whether_it_is_right(found: AxisDiagnosis) -> None:
    row = json.loads(json.dumps(row_of("a machine", Expected(("cogging",)), found, 1.0)))
    (finding,) = row["findings"]
    assert (row["mark"], row["named"], finding["effect"]) == ("right", True, "cogging")
    assert finding["part"] > 0.5 > finding["control"]
    before, after = row["errors"]["selection"]
    assert after < before
    assert row["errors"]["test"] == [None, None]
    assert {c["effect"] for c in row["ranking"]} == {*FEW}
    assert "right: missing cogging" in in_line(row)


def test_the_same_answer_is_wrong_where_another_effect_or_nothing_is_hidden(
    found: AxisDiagnosis,
) -> None:
    rows = [
        row_of("a machine", expected, found, 1.0)
        for expected in (Expected(("wear",)), Expected(), Expected(known=("cogging",)))
    ]
    assert [(r["mark"], r["named"]) for r in rows] == [
        ("wrong", False), ("wrong", False), ("right", False),
    ]  # fmt: skip
    (sure,) = found.findings
    assert sure.confidence is not None
    assert sure.confidence > 0.9
    assert stated_wrong(rows) == ["a machine: cogging"] * 2


def test_a_diagnosis_without_findings_is_silent_unless_there_is_nothing(
    found: AxisDiagnosis,
) -> None:
    nothing = replace(found, findings=())
    marks = [row_of("", e, nothing, 0.0)["mark"] for e in (Expected(("cogging",)), Expected())]
    assert marks == ["silent", "right"]


@pytest.mark.parametrize(
    ("effect", "tied", "kind", "mark"),
    [
        ("cogging_3", (), "missing", "right"),
        ("wear", ("cogging",), "missing", "equivalent"),
        ("actuator_lag", (), "missing", "equivalent"),
        ("thermal_drift", (), "missing", "known"),
        ("wear", (), "missing", "wrong"),
        ("cogging", (), "wrong_shape", "wrong"),
        ("spring", (), "wrong_shape", "right"),
        ("lugre", (), "wrong_shape", "known"),
        ("spring", (), "missing", "wrong"),
    ],
)
def test_each_finding_is_held_against_what_was_declared(
    found: AxisDiagnosis, effect: str, tied: tuple[str, ...], kind: str, mark: str
) -> None:
    expected = Expected(
        ("cogging",), ("actuator_lag",), ("spring",), ("thermal_drift",), ("lugre",)
    )
    finding: Finding = replace(found.findings[0], effect=effect, tied=tied, kind=FindingKind(kind))
    assert expected.mark(finding) == mark


def test_without_the_measurements_nothing_is_judged(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert judge(CASES, tmp_path / "absent") == []
    assert capsys.readouterr().err.count("\n") == 1


@pytest.mark.slow
def test_each_real_machine_is_read_with_its_axis_and_its_motion(shared_data: Path) -> None:
    for given in {c.given: c for c in CASES}.values():
        roles = given.given(shared_data)
        for log in (log for logs in roles for log in logs.values()):
            signals = log.axes[given.axis]
            assert np.isfinite(signals.position).all()
            assert np.std(signals.force) > 0.0
            assert log.sample_rate == pytest.approx(given.model.sample_rate)
