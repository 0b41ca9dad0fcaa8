"""What a loop's functions hand on, and which parameters are said to have moved."""

from __future__ import annotations

from dataclasses import replace

import built_results as made
import pytest
from built_fits import CATALOGUE, built, built_fit
from report_cases import Case, cogging_case

from identify import workflow
from identify.dataset.dataset import Role
from identify.selection.diagnosis import Verdict


def axis_with(verdict: Verdict, bic: float = 1.0, ratio: float = 2.0):
    ranking = (built("wear", bic=bic),)
    return made.diagnosis_of(verdict, ranking=ranking, base=built_fit(ratio, 1.0))


def leading(**axes) -> str:
    found = workflow.Diagnosis(made.MODEL, axes, made.Comparison(made.MODEL, {}), {})
    return next(name for name, d in axes.items() if d is found.leading)


def test_the_answer_is_about_the_axis_with_the_strongest_verdict():
    names = ("NOTHING_MISSING", "UNEXPLAINED", "WRONG_SHAPE", "MISSING_EFFECTS")
    order = [Verdict[name] for name in names]
    for i, weak in enumerate(order):
        for strong in order[i + 1 :]:
            axes = {"a": axis_with(weak, bic=900.0, ratio=9.0), "b": axis_with(strong)}
            assert leading(**axes) == "b"
            assert leading(**dict(reversed(axes.items()))) == "b"


@pytest.mark.parametrize("verdict", list(Verdict))
def test_of_like_verdicts_evidence_or_else_the_error_decides(verdict):
    named = verdict is Verdict.MISSING_EFFECTS
    a = axis_with(verdict, bic=90.0, ratio=2.0)
    b = axis_with(verdict, bic=80.0, ratio=3.0)
    assert leading(a=a, b=b) == ("a" if named else "b")
    assert leading(a=a, b=replace(b, ranking=())) == ("a" if named else "b")


@pytest.fixture(scope="module")
def case() -> Case:
    return cogging_case()


def test_the_comparison_of_a_diagnosis_is_of_its_dataset_over_the_floor_of_its_final_model(case):
    x, told, compared = case.x, case.diagnosis.summaries["x"], case.diagnosis.comparison.axes["x"]
    assert compared.logs is x.dataset.fit
    assert compared.total_error == pytest.approx(x.base.error)
    assert compared.floor == told.floor
    assert told.floor <= x.final.error, "noise is part of what is left"
    assert set(told.floors) == {Role.TRAINING, Role.SELECTION}
    assert told.floors[Role.SELECTION] <= told.chosen.after
    assert case.diagnosis.model.axes["x"] is x.base.axis
    labels = {e.label for e in told.after} - {e.label for e in told.before}
    assert labels == {f"cogging.{p.name}" for p in CATALOGUE["cogging"].parameters}
    assert {m.label for m in told.moved} >= {"coulomb_viscous.Fc"}


def test_what_a_diagnosis_names_is_added_as_it_was_fitted(case):
    made_of_it = workflow.add_named(case.diagnosis)
    assert made_of_it.candidate is case.x.best
    assert made_of_it.kept
    assert made_of_it.model.axes["x"] is case.x.best.fit.axis
    assert made_of_it.model.history[-1] == made_of_it.step
    assert set(made_of_it.step.notes) < set(made_of_it.notes)
    assert workflow.add_named(case.diagnosis.__class__(
        case.diagnosis.model, {"x": case.quiet}, case.diagnosis.comparison, {}
    )) is None  # fmt: skip
