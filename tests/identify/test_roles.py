"""Training logs fit, selection logs choose, test logs decide nothing; what a diagnosis hands on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import built_results as made
import numpy as np
import pytest
from built_fits import built, built_fit
from constructed import CATALOGUE, effect
from machines import one_axis
from planted_logs import RATE, SLIDE, Ride, having
from planted_logs import logged as written

import identify
from identify import workflow
from identify.dataset.dataset import Role
from identify.dataset.preparation import datasets
from identify.estimation.alignment import realigned
from identify.estimation.errors import error_on
from identify.estimation.evidence import rms
from identify.output.as_json import json_of
from identify.results.results import Diagnosis
from identify.selection.diagnosis import Verdict
from identify.workflow import diagnose
from twin.effects import Catalogue
from twin.errors import InputError
from twin.logs import Log
from twin.model.file import load_model
from twin.model.machine import MachineModel
from twin.simulation.simulate import simulate
from twin.simulation.simulators import ReducedSimulator

STAGE = replace(one_axis(load_model("proton_xy", CATALOGUE)), sample_rate=2000.0)
PULLED = STAGE.with_axis("x", STAGE.axes["x"].with_effect(effect("quadratic_drag", {"c": 30.0})))
KNOWN = Catalogue([CATALOGUE["quadratic_drag"], CATALOGUE["constant_force"]])
TESTED = {
    "test_error_before", "test_error_after", "test_error_on", "explains", "explained",
    "noise_floors", "model",
}  # fmt: skip


def logged(seed: int, seconds: float = 4.0) -> Log:
    return simulate(PULLED, "tracking", seed=seed, duration=seconds, simulator=ReducedSimulator)


LOGS, HELD, TEST = {"a": logged(1)}, {"b": logged(2)}, {"c": logged(3)}


def louder(log: Log) -> Log:
    """The log with another force, which no model of the machine explains."""
    x = log.axes["x"]
    force = x.columns["force"] + np.random.default_rng(4).normal(0.0, 0.5, len(log))
    return replace(log, axes={"x": replace(x, columns={**x.columns, "force": force})})


def diagnosed(test: Mapping[str, Log]) -> Diagnosis:
    return diagnose(STAGE, LOGS, HELD, test, catalogue=KNOWN)


@pytest.fixture(scope="module")
def found() -> Diagnosis:
    return diagnosed(TEST)


def without(told: object, keys: set[str]) -> object:
    """The same at every depth, less some keys."""
    if isinstance(told, dict):
        return {k: without(v, keys) for k, v in told.items() if k not in keys}
    return [without(v, keys) for v in told] if isinstance(told, list) else told


def test_the_errors_of_every_log_are_told_with_its_role(found):
    told = {each.name: each for each in found.summaries["x"].by_log}
    roles = {"a": Role.TRAINING, "b": Role.SELECTION, "c": Role.TEST}
    assert {name: each.role for name, each in told.items()} == roles
    assert all(each.seconds == pytest.approx(4.0, abs=0.1) for each in told.values())
    before, after = found.summaries["x"].tested.before, found.summaries["x"].tested.after
    assert (told["c"].before, told["c"].after) == pytest.approx((before, after))
    assert all(each.after < 0.5 * each.before for each in told.values())


def test_a_test_log_decides_nothing_and_gives_the_errors(found):
    other = diagnosed({"c": louder(TEST["c"])})
    told, changed = json_of(found), json_of(other)
    assert without(changed, TESTED) == without(told, TESTED)
    assert told["missing"] == ["quadratic_drag"]
    (finding,), (noisy,) = told["findings"], changed["findings"]
    for part, worse in ((told, changed), (finding, noisy)):
        assert part["test_error_on"] == "test"
        assert part["test_error_before"] > 3.0 * part["test_error_after"]
        assert worse["test_error_after"] > 3.0 * part["test_error_after"]
    assert finding["explains"] == pytest.approx(1.0, abs=0.05)


def test_the_model_of_a_diagnosis_tells_the_errors_on_the_logs_of_each_role(found):
    dataset, (step,) = found.axes["x"].dataset, found.model.history
    for axis, tested, chosen in (
        (found.axes["x"].base.axis, step.test_error_before, step.holdout_error_before),
        (found.model.axes["x"], step.test_error_after, step.holdout_error_after),
    ):
        assert tested == pytest.approx(rms(error_on(axis, dataset.test)))
        assert chosen == pytest.approx(rms(error_on(axis, dataset.selection)))
        assert abs(tested - chosen) > 0.1 * chosen
    assert [len(dataset.having(role)) for role in Role] == [1, 1, 1]


def test_logs_are_prepared_alike_in_each_role():
    tested = datasets(STAGE, LOGS, {}, test=TEST)["x"]
    chosen = datasets(STAGE, LOGS, TEST)["x"]
    assert (tested.tested_on, tested.chosen_on) == (Role.TEST, Role.TRAINING)
    assert (chosen.tested_on, chosen.chosen_on) == (Role.SELECTION, Role.SELECTION)
    (log,), (same,) = tested.test, chosen.selection
    np.testing.assert_array_equal(log.command, same.command)
    assert log.reach == same.reach
    moved = realigned(tested, 2e-4), realigned(chosen, 2e-4)
    np.testing.assert_array_equal(moved[0].test[0].command, moved[1].selection[0].command)
    noisy = tested.with_force_noise(0.3)
    assert [log.force_noise for log in noisy.logs] == [0.3, 0.3]
    assert realigned(noisy, 2e-4).force_noise == 0.3


@pytest.mark.parametrize(
    ("logs", "held", "test", "why"),
    [
        ({"a": TEST["c"]}, HELD, TEST, "c is a copy of a: as a test log it proves nothing"),
        (LOGS, {"b": TEST["c"]}, TEST, "c is a copy of b: as a test log it proves nothing"),
        # Not even of another recording: what is told of a log, such as its beginning, is by name.
        (LOGS, {"a": HELD["b"]}, {}, "a: the name of a training log and of a selection log; give"),
        (LOGS, {}, {"a": TEST["c"]}, "a: the name of a training log and of a test log; give each"),
    ],
)
def test_a_log_and_a_name_have_one_role(logs, held, test, why):
    with pytest.raises(InputError, match=f"^{why}") as told:
        datasets(STAGE, logs, held, test=test)
    assert "\n" not in str(told.value)


def test_names_of_two_folders_are_two():
    apart = datasets(STAGE, {"one/a.mcap": LOGS["a"]}, {"two/a.mcap": HELD["b"]})["x"]
    assert [log.motion.name for log in apart.logs] == ["one/a.mcap", "two/a.mcap"]


def axis_with(verdict: Verdict, bic: float = 1.0, ratio: float = 2.0):
    ranking = (built("wear", bic=bic),)
    return made.diagnosis_of(verdict, ranking=ranking, base=built_fit(ratio, 1.0))


def leading(**axes) -> str:
    compared = made.Comparison(made.MODEL, {})
    found = workflow.Diagnosis(made.MODEL, axes, compared, {}, model=made.MODEL)
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


def test_the_comparison_of_a_diagnosis_is_of_its_dataset_over_the_floor_of_its_final_model(case):
    x, told, compared = case.x, case.diagnosis.summaries["x"], case.diagnosis.comparison.axes["x"]
    assert compared.logs is x.dataset.training
    assert compared.total_error == pytest.approx(x.base.error)
    assert compared.floor == told.floor
    assert told.floor <= x.final.error, "noise is part of what is left"
    assert set(told.floors) == {Role.TRAINING, Role.SELECTION}
    assert told.floors[Role.SELECTION] <= told.chosen.after
    assert case.diagnosis.fitted.axes["x"] is x.base.axis
    labels = {e.label for e in told.after} - {e.label for e in told.before}
    assert labels == {f"cogging.{p.name}" for p in CATALOGUE["cogging"].parameters}
    assert {m.label for m in told.moved} >= {"coulomb_viscous.Fc"}


def test_the_model_of_a_diagnosis_has_what_was_found_as_it_was_fitted(case):
    made_of_it = case.diagnosis.model
    assert made_of_it.axes["x"] == case.x.dataset.kept_in(case.x.final.axis)
    (step,) = made_of_it.history
    assert (step.action, step.effect) == ("add", "cogging")
    assert (step.fit_error_before, step.fit_error_after) == (case.x.base.error, case.x.final.error)
    labels = {e.label for e in case.diagnosis.summaries["x"].after if e.low is not None}
    assert made_of_it.intervals["x"].ends.keys() == labels
    assert case.concluding(case.quiet).model is case.diagnosis.fitted


@pytest.mark.parametrize(
    ("errors", "role"),
    [
        ({}, Role.TRAINING),
        ({"holdout_error_after": 0.9}, Role.SELECTION),
        ({"holdout_error_after": 0.9, "test_error_after": 0.8}, Role.TEST),
    ],
)
def test_what_was_added_is_reported_on_the_logs_that_decided_least(errors, role) -> None:
    step = replace(made.STEPS[2], **errors)
    assert replace(made.addition(), step=step).reported_on is role


def test_a_law_is_given_the_shape_that_the_logs_show() -> None:
    """A drag that saturates, of a model whose drag is quadratic."""

    def drag(_: np.ndarray, speed: np.ndarray) -> np.ndarray:
        return -4.0 * np.sign(speed) * np.sin(np.minimum(12.0 * np.abs(speed), 3.0))

    model = MachineModel("m", {"x": having(SLIDE, "quadratic_drag", c=3.0)}, RATE)
    logs = {f"run{i}": written(SLIDE, Ride(30 + i), beside=drag) for i in range(3)}
    held = {"run2": logs.pop("run2")}
    added = identify.add_shape("quadratic_drag", model, logs, held, axis="x")
    assert (added.reshaped, added.kept) == ("quadratic_drag", True)
    assert added.step.holdout_error_after < 0.01 * added.step.holdout_error_before
    assert "gave quadratic_drag of axis x the shape that the logs show" in str(added)
    with pytest.raises(InputError, match="has no effect 'cogging'"):
        identify.add_shape("cogging", model, logs, held)


@pytest.mark.parametrize(("name", "another"), [("cogging", "cogging_2"), ("quadratic_drag", "")])
def test_an_effect_that_is_there_is_not_added_again(name: str, another: str) -> None:
    model = MachineModel("m", {"x": having(SLIDE, name)}, RATE)
    with pytest.raises(InputError, match=f"has the effect '{name}' already") as told:
        identify.add(name, model, {"run": written(SLIDE, Ride(30))})
    assert another in str(told.value)
    assert ("is another" in str(told.value)) == bool(another)
