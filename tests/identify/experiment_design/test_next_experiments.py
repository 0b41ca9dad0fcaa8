"""A diagnosis is followed by an experiment where it leaves two explanations, and by none else."""

from __future__ import annotations

from dataclasses import replace

import built_results as made

from identify.experiment_design.plan import next_experiments
from identify.selection.diagnosis import Verdict

ALONE = replace(made.FOUND[0], tied=())


def test_of_one_explanation_and_of_none_no_experiment_is_asked() -> None:
    one = made.diagnosis_of(findings=(ALONE,), ranking=(made.BEST,))
    quiet = made.diagnosis_of(Verdict.NOTHING_MISSING, final=made.BASE)
    lost = made.diagnosis_of(Verdict.UNEXPLAINED, unexplained=made.STRUCTURE)
    for found in (one, quiet, lost):
        assert next_experiments({"x": found}, made.MODEL) == ({}, {})


def test_it_lasts_ten_seconds() -> None:
    """As the first experiment tells that a machine which hardly moves cannot run."""
    model = made.MODEL
    slow = replace(model.axes["x"].hardware, velocity=1e-6)
    crawls = model.with_axis("x", replace(model.axes["x"], hardware=slow))
    plans, why = next_experiments({"x": made.diagnosis_of()}, crawls)
    assert plans == {}
    assert why["x"].startswith("axis x can run none of the experiments; check its limits and ")
    assert "longest_plateau 0.25 s, dwell 0.162 s: axis x hardly moves" in why["x"]


def test_of_two_explanations_it_is_said_why_the_machine_can_run_none() -> None:
    model = made.MODEL
    still = replace(model.axes["x"].hardware, travel=None)
    held = model.with_axis("x", replace(model.axes["x"], hardware=still))
    plans, why = next_experiments({"x": made.diagnosis_of()}, held)
    assert plans == {}
    assert list(why) == ["x"]
    assert "travel" in why["x"]
