"""What a loop's functions hand on, and which parameters are said to have moved."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import built_results as made
import numpy as np
import pytest
from built_fits import axis_of, built, built_fit, fitted

from identify import workflow
from identify.dataset.given_logs import Role
from identify.estimation import errors
from identify.output import results
from identify.output.words.selection import moved_in_words
from identify.selection import confounded
from identify.selection.confounded import moved_parameters
from identify.selection.diagnosis import Verdict

# The rules as they were decided.
LEAST_FORCE, AT_FLOOR, MOST_TOLD = 0.1, 1.3, 3


# --- the axis of the answer -----------------------------------------------------------------


def axis_with(verdict: Verdict, bic: float = 1.0, ratio: float = 2.0):
    steps = made.diagnosis_of().steps[:1] if verdict is Verdict.MISSING_EFFECTS else ()
    ranking = (built("wear", bic=bic),)
    return made.diagnosis_of(verdict, steps=steps, ranking=ranking, base=built_fit(ratio, 1.0))


def leading(**axes) -> str:
    found = workflow.Diagnosis(made.MODEL, axes, made.Comparison(made.MODEL, {}))
    return next(name for name, d in axes.items() if d is found.leading)


def test_the_answer_is_about_the_axis_with_the_strongest_verdict():
    order = [
        Verdict.NOTHING_MISSING,
        Verdict.UNEXPLAINED,
        Verdict.WRONG_SHAPE,
        Verdict.MISSING_EFFECTS,
    ]
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


# --- parameters that moved ------------------------------------------------------------------


def moved(monkeypatch, old: dict, new: dict, width: float = 0.03):
    before = built_fit(1.0, axis=axis_of(fitted("constant_force", **old)))
    after = built_fit(1.0, axis=axis_of(fitted("wear"), fitted("constant_force", **new)))
    widths = {before: 0.04, after: width}
    monkeypatch.setattr(
        confounded, "half_widths", lambda fit: np.full(len(fit.scaling.where), widths[fit])
    )
    return moved_parameters(before, after)


@pytest.mark.parametrize(("f0", "told"), [(1.049, False), (1.051, True), (0.949, True)])
def test_a_parameter_moved_where_it_leaves_both_intervals(monkeypatch, f0, told):
    found = moved(monkeypatch, {"F0": 1.0}, {"F0": f0})
    assert bool(found) is told
    if told:
        (only,) = found
        assert moved_in_words(only) == (
            f"constant_force.F0 moved from 1 to {f0:.4g} N: more than it scatters between "
            "blocks of the logs"
        )


@pytest.mark.parametrize(("f0", "said"), [(0.29, "collapsed"), (0.31, "moved")])
def test_a_strength_collapsed_where_less_than_a_third_is_left(monkeypatch, f0, said):
    (found,) = moved(monkeypatch, {"F0": 1.0}, {"F0": f0})
    words = moved_in_words(found)
    assert words.startswith(f"constant_force.F0 {said} from 1 to {f0} N")
    assert ("had taken over" in words) is found.collapsed is (said == "collapsed")
    wide = moved(monkeypatch, {"F0": 1.0}, {"F0": f0}, width=5.0)
    assert bool(wide) is (said == "collapsed")
    assert moved(monkeypatch, {"F0": 0.039}, {"F0": 0.0}) == ()


# --- fit, compare, diagnose -----------------------------------------------------------------


def handed(monkeypatch):
    """The loop's parts stubbed: each says what it was given."""
    datasets = {a: replace(made.DATASET, axis=a) for a in ("x", "y")}
    seen = {}

    def read(*asked):
        seen["datasets"] = asked
        return dict(datasets)

    def aligned(axis, dataset):
        aligned_dataset = replace(dataset, channel_delay=axis.mass / 1e4)
        return aligned_dataset, built_fit(axis.mass, axis=replace(axis, mass=2 * axis.mass))

    monkeypatch.setattr(workflow, "datasets", read)
    monkeypatch.setattr(workflow, "fit_aligned", aligned)
    monkeypatch.setattr(workflow, "with_own_noise", lambda fit, dataset: (dataset, fit))
    monkeypatch.setattr(workflow, "estimates", lambda fit: ("estimates", fit))
    monkeypatch.setattr(workflow, "intervals_to_keep", lambda fit, found: (fit.error, found))
    monkeypatch.setattr(workflow, "usable", lambda catalogue, model: catalogue)
    monkeypatch.setattr(errors, "error_on", lambda axis, logs: np.full(5, axis.mass * len(logs)))
    monkeypatch.setattr(results, "refit", lambda *given: given)
    monkeypatch.setattr(workflow, "telling", lambda dataset, sticks: dataset)
    monkeypatch.setattr(workflow, "require_residual", lambda axis, dataset: None)
    return seen


def test_a_fit_takes_over_the_values_and_the_shift_of_each_axis(monkeypatch):
    seen, bars = handed(monkeypatch), []
    found = workflow.fit(
        made.MODEL, "logs", "held", "test", catalogue="known", test_function=0.07,
        progress=lambda *done: bars.append(done),
    )  # fmt: skip
    assert seen["datasets"] == (made.MODEL, "logs", "held", 0.07, "test")
    assert bars == [("fitting", 1, 2), ("fitting", 2, 2)]
    assert {a: m.mass for a, m in found.model.axes.items()} == {"x": 10.6, "y": 15.8}
    assert {a: s.channel_delay for a, s in found.datasets.items()} == {"x": 5.3e-4, "y": 7.9e-4}
    assert found.holdout_error == pytest.approx({"x": 10.6, "y": 15.8})
    assert found.model.intervals == {a: (f.error, ("estimates", f)) for a, f in found.fits.items()}
    assert all(found.estimates[a] == ("estimates", found.fits[a]) for a in "xy")
    assert found.refits == {a: (made.MODEL.axes[a], found.fits[a], "known") for a in "xy"}
    assert found.test_error == {"x": None, "y": None}
    bare = replace(made.DATASET, holdout=())
    assert workflow.error_if_any(Role.SELECTION, found.fits["x"], bare) is None
    assert len(workflow.fit(made.MODEL, "logs").catalogue) == 0
    assert seen["datasets"][2] == {}


def test_a_comparison_is_of_the_axes_that_move(monkeypatch):
    moving = {"y": "dataset y"}
    monkeypatch.setattr(workflow, "datasets", lambda *given: moving if given[1:] == (
        "logs", {}, 0.07) else None)  # fmt: skip
    monkeypatch.setattr(workflow, "telling", lambda dataset, sticks: dataset)
    monkeypatch.setattr(workflow, "require_residual", lambda axis, dataset: None)
    monkeypatch.setattr(workflow, "aligned", lambda axis, dataset: (axis.mass, dataset))
    monkeypatch.setattr(workflow, "noise_known", lambda axis, dataset: (*dataset, axis.mass + 1))
    asked = []

    def errors(model, found, progress):
        progress(3, 4)
        asked.append((model, dict(found)))
        return {"y": "errors of y"}, {"y": "floors of y"}

    monkeypatch.setattr(workflow, "position_errors", errors)
    monkeypatch.setattr(workflow, "compare_axis", lambda *given: given)
    bars = []
    found = workflow.compare(
        made.MODEL, "logs", test_function=0.07, progress=lambda *done: bars.append(done)
    )
    prepared = (7.9, "dataset y", 8.9)
    assert found.axes == {"y": (made.MODEL, prepared, "errors of y", "floors of y")}
    assert (asked, bars) == ([(made.MODEL, {"y": prepared})], [("comparing", 3, 4)])
    assert found.model is made.MODEL


def test_a_diagnosis_hands_each_axis_its_own_fit_and_dataset(monkeypatch):
    described = made.MODEL.with_axis("x", axis_of(fitted("empirical_map")))
    result = made.fit_result()
    asked = {}

    def fit(*given, **named):
        asked.update(given=given, named=named)
        return result

    def diagnose_axis(fit, dataset, catalogue, progress):
        progress(1, 2)
        told = SimpleNamespace(
            axis=dataset.axis, fit=fit, catalogue=catalogue, dataset=dataset,
            base=f"base of {dataset.axis}", with_named=f"fit of {dataset.axis}",
            unexplained=dataset.axis == "y",
        )  # fmt: skip
        return SimpleNamespace(with_findings=lambda: told)

    bars = []
    monkeypatch.setattr(workflow, "fit", fit)
    monkeypatch.setattr(workflow, "diagnose_axis", diagnose_axis)
    monkeypatch.setattr(workflow, "usable", lambda catalogue, model: catalogue)
    monkeypatch.setattr(workflow, "next_experiments", lambda *given: (given, "not planned"))
    monkeypatch.setattr(workflow, "_compared", lambda *given: given)
    monkeypatch.setattr(workflow, "worst_region", lambda *given: given)
    monkeypatch.setattr(workflow, "refit", lambda *given: given)
    progress = lambda *done: bars.append(done)  # noqa: E731
    found = workflow.diagnose(
        described,
        "logs",
        "held",
        "test",
        catalogue="known",
        test_function=0.07,
        progress=progress,
    )
    assert asked["given"] == (made.MODEL, "logs", "held", "test")
    assert asked["named"] == {"catalogue": "known", "test_function": 0.07, "progress": progress}
    for axis in "xy":
        d = found.axes[axis]
        assert (d.axis, d.fit, d.catalogue) == (axis, result.fits[axis], "known")
    assert bars == [(f"trying effects on {a}", 1, 2) for a in "xy"]
    assert found.next_experiments == (found.axes, result.model, 0.07)
    assert found.not_planned == "not planned"
    assert found.comparison == (result.model, result.datasets, progress)
    assert found.refits == {a: (made.MODEL.axes[a], f"base of {a}", "known") for a in "xy"}, (
        "of the fit that the answer starts from"
    )
    assert found.left_over == {"y": ("fit of y", result.datasets["y"])}


def test_what_a_diagnosis_names_is_added_as_it_was_fitted(monkeypatch):
    """One of a pair was fitted beside the other, so that it has to be fitted by itself."""
    monkeypatch.setattr(workflow, "addition", lambda best, base, *_: (best, base))

    def added(found):
        return workflow.add_named(workflow.Diagnosis(made.MODEL, {"x": found}, made.compared()))

    paired = axis_with(Verdict.MISSING_EFFECTS)
    assert paired.best is not None
    alone = replace(paired, ranking=(paired.best,))
    assert added(alone) == (alone.best, alone.base)
    assert added(paired) is None
    assert added(axis_with(Verdict.UNEXPLAINED)) is None
