"""What a loop's functions hand on, and which parameters are said to have moved."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import built_results as made
import numpy as np
import pytest
from built_fits import CATALOGUE, PLAIN, axis_of, built, built_fit, fitted

from identify import workflow
from identify.diagnose import Verdict
from identify.workflow import _addition, add, moved_parameters
from twin.errors import InputError
from twin.model import StageModel

# The rules as they were decided.
LEAST_FORCE, AT_FLOOR, MOST_TOLD = 0.1, 1.3, 3


# --- the axis of the answer -----------------------------------------------------------------


def axis_with(verdict: Verdict, bic: float = 1.0, ratio: float = 2.0):
    steps = made.diagnosis_of().steps[:1] if verdict.name in ("MISSING_EFFECT", "AMBIGUOUS") else ()
    ranking = (built("wear", bic=bic),)
    return made.diagnosis_of(verdict, steps=steps, ranking=ranking, base=built_fit(ratio, 1.0))


def leading(**axes) -> str:
    found = workflow.Diagnosis(made.MODEL, axes, made.Comparison(made.MODEL, {}))
    return next(name for name, d in axes.items() if d is found.leading)


def test_the_answer_is_about_the_axis_with_the_strongest_verdict():
    order = [
        Verdict.NOTHING_MISSING,
        Verdict.UNEXPLAINED,
        Verdict.AMBIGUOUS,
        Verdict.MISSING_EFFECT,
    ]
    for i, weak in enumerate(order):
        for strong in order[i + 1 :]:
            axes = {"a": axis_with(weak, bic=900.0, ratio=9.0), "b": axis_with(strong)}
            assert leading(**axes) == "b"
            assert leading(**dict(reversed(axes.items()))) == "b"


@pytest.mark.parametrize("verdict", list(Verdict))
def test_of_like_verdicts_evidence_or_else_the_error_decides(verdict):
    named = verdict in (Verdict.MISSING_EFFECT, Verdict.AMBIGUOUS)
    a = axis_with(verdict, bic=90.0, ratio=2.0)
    b = axis_with(verdict, bic=80.0, ratio=3.0)
    assert leading(a=a, b=b) == ("a" if named else "b")
    assert leading(a=a, b=replace(b, ranking=())) == ("a" if named else "b")


# --- parameters that moved ------------------------------------------------------------------


def moved(monkeypatch, old: dict, new: dict, width: float = 0.03):
    before = built_fit(1.0, axis=axis_of(fitted("constant_force", **old)))
    after = built_fit(1.0, axis=axis_of(fitted("wear"), fitted("constant_force", **new)))
    widths = {before: 0.04, after: width}
    monkeypatch.setattr(
        workflow, "half_widths", lambda fit: np.full(len(fit.scaling.where), widths[fit])
    )
    return moved_parameters(before, after)


@pytest.mark.parametrize(("f0", "told"), [(1.049, False), (1.051, True), (0.949, True)])
def test_a_parameter_moved_where_it_leaves_both_intervals(monkeypatch, f0, told):
    found = moved(monkeypatch, {"F0": 1.0}, {"F0": f0})
    assert bool(found) is told
    if told:
        assert found == (
            f"constant_force.F0 moved from 1 to {f0:.4g} N: more than its interval",
        )  # fmt: skip


@pytest.mark.parametrize(("f0", "said"), [(0.29, "collapsed"), (0.31, "moved")])
def test_a_strength_collapsed_where_less_than_a_third_is_left(monkeypatch, f0, said):
    (found,) = moved(monkeypatch, {"F0": 1.0}, {"F0": f0})
    assert found.startswith(f"constant_force.F0 {said} from 1 to {f0} N")
    assert ("stood in for" in found) is (said == "collapsed")
    wide = moved(monkeypatch, {"F0": 1.0}, {"F0": f0}, width=5.0)
    assert bool(wide) is (said == "collapsed")
    assert moved(monkeypatch, {"F0": 0.039}, {"F0": 0.0}) == ()


# --- add ------------------------------------------------------------------------------------


def test_an_effect_is_added_where_it_helps_most(monkeypatch):
    both = SimpleNamespace(
        fits={"x": built_fit(3.0), "y": built_fit(4.0)}, studies={"x": "sx", "y": "sy"}
    )
    tried = []

    def attempt(fit, study, effect):
        tried.append((fit, study, effect.name))
        return built(effect, bic={"sx": 40.0, "sy": 70.0}[study], axis=study[1])

    seen = []
    monkeypatch.setattr(workflow, "fit", lambda *a, **k: seen.append((a, k)) or both)
    monkeypatch.setattr(workflow, "try_effect", attempt)
    monkeypatch.setattr(workflow, "_addition", lambda best, before, logs, given: (best, given))
    wear = CATALOGUE["wear"]
    best, _ = add(wear, made.MODEL, "logs", "held", window=0.07)
    assert best.axis == "y"
    assert [t[1:] for t in tried] == [("sx", "wear"), ("sy", "wear")]
    assert [t[0] for t in tried] == list(both.fits.values())
    assert seen[0][0][1:] == ("logs", "held")
    assert seen[0][1]["window"] == 0.07
    assert add(wear, made.MODEL, "logs", axis="x")[0].axis == "x"
    with pytest.raises(InputError, match="already"):
        add(CATALOGUE["coulomb_viscous"], made.MODEL, "logs")
    with pytest.raises(InputError, match="no axis"):
        add(wear, made.MODEL, "logs", axis="z")
    both.fits.pop("y")
    with pytest.raises(InputError, match="does not move"):
        add(wear, made.MODEL, "logs", axis="y")


@pytest.mark.parametrize("kept", [True, False])
def test_an_addition_records_errors_before_and_after(monkeypatch, kept):
    base = built_fit(7.3)
    best = built("cogging", fit=built_fit(2.9, axis=axis_of(fitted("cogging"))), t=9 if kept else 1)
    study = replace(made.STUDY, holdout=("held",))
    before = SimpleNamespace(
        fits={"x": base}, studies={"x": study},
        model=StageModel("m", {"x": PLAIN, "y": replace(PLAIN, mass=3.0)}),
    )  # fmt: skip
    runs = []

    def run(model, log, stage="reduced"):
        effects = len(model.axes["x"].effects)
        runs.append((tuple(model.axes), effects, log, getattr(stage, "__name__", stage)))
        return effects, stage

    errors = {(1, "reduced"): 5.1, (2, "reduced"): 1.7}
    monkeypatch.setattr(workflow, "free_run", run)
    monkeypatch.setattr(workflow, "rms_error", lambda r, axis: errors.get(r, 1.9))
    monkeypatch.setattr(
        workflow, "holdout_error", lambda fit, s: {7.3: 8.1, 2.9: 3.3}[round(fit.error, 9)]
    )
    monkeypatch.setattr(workflow, "moved_parameters", lambda a, b: (f"{a.error > b.error}",))
    whole = before.model.with_axis("x", axis_of(fitted("empirical_map")))
    found = _addition(best, before, {"first": "log 1", "second": "log 2"}, whole)
    step = found.step
    assert (step.action, step.effect, step.axis) == ("add", "cogging", "x")
    assert (step.fit_error_before, step.fit_error_after) == pytest.approx((7.3, 2.9))
    assert (step.holdout_error_before, step.holdout_error_after) == (8.1, 3.3)
    assert (found.position_error, found.replayed) == ((5.1, 1.7), 1.9)
    assert {r[0] for r in runs} == {("x",)}
    assert {r[2] for r in runs} == {"log 1"}
    assert [r[3] for r in runs].count("MujocoStage") == 1
    assert next(r[1] for r in runs if r[3] == "MujocoStage") == 2
    assert found.notes[0] == "True"
    assert "empirical_map made way" in found.notes[1]
    assert found.model.axes["x"] is best.fit.axis
    assert found.model.history == (step,)
    assert found.kept is kept
