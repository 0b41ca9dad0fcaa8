"""The JSON object of a diagnosis: every documented key with the number it names."""

from __future__ import annotations

import sys
from dataclasses import replace

import built_results as made
import numpy as np
import pytest
from built_fits import built_fit
from report_cases import cogging_case
from strict_json import expected_refit, strict

from identify.output.as_json import _finding, add_json, diagnose_json, estimate_json, plan_json
from identify.output.report import sections
from identify.output.words.diagnosis import SEVERAL, remarks_on
from identify.output.words.findings import advice
from identify.selection.bends import Bend
from identify.selection.diagnosis import Verdict

# What runs compiled laws over logs, fits, or tells a noise floor.
COMPUTES = (
    "identify.estimation.force_balance", "identify.estimation.fit_problem",
    "identify.estimation.intervals", "identify.dataset.noise_floor",
    "identify.validation.free_run", "identify.selection.confounded", "twin.core",
)  # fmt: skip


def expected_candidate(c):
    return {
        "effect": c.effect.name, "delta_bic": c.delta_bic, "holdout_error_before": c.gain.before,
        "holdout_error_after": c.gain.after, "unit": "N", "supported": c.supported,
        "part": c.part, "why_not": c.refused,
        "parameters": dict(c.fit.axis[c.effect.name].values),
        "parameter_units": {p.name: p.unit for p in c.effect.parameters},
    }  # fmt: skip


@pytest.fixture
def missing():
    """A diagnosis that names effects: its leading axis, and the whole."""
    x = made.diagnosis_of(unexplained=made.STRUCTURE, repeat=made.REPEAT, small=("wear",))
    return x, made.diagnosed(x)


def test_a_diagnosis_is_that_of_its_leading_axis(missing):
    found = strict(diagnose_json(missing[1], ["run 1: a gap", "held 1: late"]))
    axes = found.pop("axes")
    assert list(axes) == ["y", "x"]
    assert found.pop("data_faults") == ["run 1: a gap", "held 1: late"]
    assert found == axes["x"]


def test_an_axis_where_effects_are_missing(missing):
    x, result = missing
    assert strict(diagnose_json(result))["axes"]["x"] == {
        **expected_answer(x), "findings": FINDINGS, "remainder": REMAINDER,
        "force_error": pytest.approx(8.37), "noise_floor": 2.03, "unit": "N",
        "force_error_with_found": pytest.approx(3.19),
        "noise_floors": {"training": 2.03, "selection": 2.17},
        "parameters": {e.label: strict(estimate_json(e)) for e in made.estimates(0.0)},
        "test_error_before": 7.81, "test_error_after": 2.39,
        "test_error_on": "selection",
        "force_shift": 0.000217, "force_shift_unit": "s",
        "repeats_not_general": {
            "period": 0.00253, "period_unit": "m", "amplitude": {"run 1": 1.07, "run 2": 0.93},
            "unit": "N", "phase": {"run 1": 0.31, "run 2": 2.13}, "phase_unit": "rad",
        },
        "refit": expected_refit(result.refits["x"]),
        "not_tried": [],
        "notes": list(remarks_on(result, "x")),
        "next_experiment": strict(plan_json(result.next_experiments["x"])),
        "next_experiment_refused": None,
    }  # fmt: skip


def expected_answer(x):
    """What is missing, and how it was found."""
    return {
        "verdict": "missing_effects", "explanation": SEVERAL, "axis": "x",
        "effect": "cogging", "ranking": [expected_candidate(c) for c in x.ranking],
        "ambiguous_with": ["quadratic_drag"], "missing": ["cogging", "lugre"],
        "steps": [
            {
                **expected_candidate(c), "change": c.effect.name, "dropped": dropped,
                "with_others": False, "not_named": None,
            }
            for c, dropped in ((made.BEST, []), (made.LATER, ["wear"]))
        ],
        "needed_together": [], "also_seen": ["wear"],
        "unexplained": {
            "share_of_error": 0.631, "depends_on": "other_axis_position", "period": 0.0273,
            "unit": "m",
        },
    }  # fmt: skip


FINDINGS = [
    {
        "effect": "cogging", "kind": "missing", "explains": 0.871,
        "indistinguishable_from": ["quadratic_drag"], "test_error_before": 7.17,
        "test_error_after": 2.19, "test_error_on": "selection", "unit": "N",
        "parameters": {"p": 0.0261, "a1": 0.127}, "parameter_units": {"p": "m", "a1": "N"},
        "part": 0.813, "t": 7.7, "control": 0.137, "together": [],
        "contradicted_by_test_logs": False, "shape": None, "bend": None,
        "confidence": made.FOUND[0].confidence,
    },
    {
        "effect": "lugre", "kind": "missing", "explains": 0.119,
        "indistinguishable_from": [], "test_error_before": 3.23, "test_error_after": 2.19,
        "test_error_on": "selection", "unit": "N", "parameters": {"Fc": 0.31},
        "parameter_units": {"Fc": "N"},
        "part": 0.417, "t": 4.3, "control": 0.071, "together": [],
        "contradicted_by_test_logs": False, "shape": None, "bend": None,
        "confidence": made.FOUND[1].confidence,
    },
]  # fmt: skip


def test_what_bends_a_frictions_curve_is_told_with_its_unit():
    bent = replace(made.FOUND[1], bend=Bend("n", 2.0, 0.66, "1"))
    told = strict(_finding(bent))
    assert told["bend"] == {"parameter": "n", "held": 2.0, "found": 0.66, "unit": "1"}


REMAINDER = {
    "error": pytest.approx(3.19), "over_noise_floor": pytest.approx(3.19 / 2.03),
    "unit": "N", "depends_on": "other_axis_position", "share_of_error": 0.631,
    "period": 0.0273, "period_unit": "m", "advice": advice(),
    "where": {
        "coordinate": "speed", "low": 0.0137, "high": 0.0291, "coordinate_unit": "m/s",
        "error": 4.71, "unit": "N", "over_noise_floor": 2.32, "share_of_error": 0.417,
    },
}  # fmt: skip


def test_an_axis_where_nothing_is_missing(missing):
    quiet = strict(diagnose_json(missing[1]))["axes"]["y"]
    assert (quiet["verdict"], quiet["effect"], quiet["missing"]) == ("nothing_missing", None, [])
    assert (quiet["findings"], quiet["remainder"]) == ([], None)
    assert (quiet["unexplained"], quiet["next_experiment"], quiet["steps"]) == (None, None, [])
    assert (quiet["repeats_not_general"], quiet["force_shift"]) == (None, 0.0)
    assert quiet["refit"] == expected_refit(missing[1].refits["y"])


def test_where_nothing_explains_the_remainder_is_of_the_model_as_it_was_given():
    lost = made.diagnosis_of(Verdict.UNEXPLAINED, unexplained=made.STRUCTURE)
    left = strict(diagnose_json(made.diagnosed(lost)))["remainder"]
    assert left["error"] == pytest.approx(8.37)
    assert left["over_noise_floor"] == pytest.approx(8.37 / 2.11)


def test_no_refit_no_experiment_and_an_experiment_refused(missing):
    bare = replace(missing[1], refits={}, next_experiments={})
    assert strict(diagnose_json(bare))["refit"] is None
    assert strict(diagnose_json(bare))["next_experiment"] is None
    refused = strict(diagnose_json(replace(bare, not_planned={"x": "no travel"})))
    assert refused["next_experiment"] is None
    assert refused["next_experiment_refused"] == "no travel"
    assert any("is proposed: no travel" in note for note in refused["notes"])
    assert refused["axes"]["y"]["next_experiment_refused"] is None


def test_a_residual_of_nothing_is_null_in_a_diagnosis():
    empty = built_fit(0.0, 1.0, residual=np.zeros(0))
    found = strict(diagnose_json(made.diagnosed(made.diagnosis_of(base=empty))))
    assert found["force_error"] is None


def test_writing_what_was_diagnosed_runs_no_law_and_no_fit():
    """Whatever is told has been computed before: a slow report would be a hidden computation."""
    case, ran = cogging_case(), set()

    def watch(frame, event, _):
        name = frame.f_globals.get("__name__", "")
        made = frame.f_code.co_name.startswith("__")  # a reason with the page's noise floor
        if event == "call" and name.startswith(COMPUTES) and not made:
            ran.add(f"{name}.{frame.f_code.co_name}")

    sys.setprofile(watch)
    try:
        diagnose_json(case.diagnosis), str(case.diagnosis), add_json(case.addition)
        subject = case.subject(case.diagnosis)
        sections(subject)
    finally:
        sys.setprofile(None)
    assert ran == set()
