"""What a plan asks and how it chooses: both sides of each rule."""

from __future__ import annotations

import importlib
from dataclasses import replace

import built_results as made
import numpy as np
import pytest
from built_fits import CATALOGUE, PLAIN, axis_of, built, built_fit, built_motion, fitted, step

from identify.dataset.prepared_log import PreparedLog
from identify.experiment_design.candidate_experiments import NotRun
from identify.experiment_design.discrimination import (
    Arena,
    Explanation,
)
from identify.selection.diagnosis import Verdict
from twin.errors import CannotRun, InputError
from twin.experiments.kinds import Tracking
from twin.model.machine import MachineModel

plans = importlib.import_module("identify.experiment_design.plan")
STAGE = MachineModel("s", {"x": PLAIN, "y": replace(PLAIN, mass=3.1)}, 2000.0)
ONE = axis_of(fitted("quadratic_drag", c=0.9)).with_effect(fitted("lugre", Fc=0.3, Fs=0.3))
TWO = axis_of(fitted("constant_force", F0=0.2)).with_effect(fitted("lugre", Fc=0.3, Fs=0.3))
FIRST, SECOND = Explanation("one", ONE), Explanation("two", TWO)
MOTION, OLD = (
    built_motion("new", 2.0, seed=4),
    PreparedLog.of(built_motion("old", 1.5, seed=5), 0.04),
)


def arena(*explanations: Explanation, logs=(OLD,), test_function=0.04) -> Arena:
    return Arena(STAGE, "x", explanations, logs, test_function)


def absorbed(force, columns):
    """What least squares leaves of a force."""
    scaled = columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    return force - scaled @ np.linalg.lstsq(scaled, force, rcond=1e-12)[0]


# --- the choice -----------------------------------------------------------------------------


def trial(gain: float):
    return replace(made.TRIALS[0], gain=gain)


@pytest.mark.parametrize(
    ("true", "most", "expected", "asked"),
    [
        ({90.0: 80.0}, 6, [80.0, 70.0, 60.0], 1),
        ({90.0: 70.0}, 6, [70.0, 70.0, 60.0], 1),
        ({90.0: 50.0, 70.0: 65.0}, 6, [65.0, 50.0, 60.0], 2),
        ({90.0: 50.0, 70.0: 40.0, 60.0: 55.0}, 6, [55.0, 50.0, 40.0], 3),
        ({90.0: 5.0, 70.0: 6.0}, 2, [6.0, 5.0, 60.0], 2),
    ],
)
def test_trials_are_refitted_until_a_refitted_one_leads(monkeypatch, true, most, expected, asked):
    seen = []

    def refit(arena, t):
        seen.append(t.gain)
        return trial(true[t.gain])

    monkeypatch.setattr(plans, "refitted", refit)
    found = plans._verified(None, [trial(g) for g in (90.0, 70.0, 60.0)], most)
    assert [t.gain for t in found] == expected
    assert len(seen) == asked


@pytest.mark.parametrize(("gain", "decides"), [(10.0, False), (10.1, True)])
def test_an_experiment_decides_by_more_evidence_than_separates(gain, decides):
    assert made.plan_of("a", "b", ranking=(trial(gain), trial(90.0))).decides is decides
    assert made.plan_of("a", ranking=(trial(gain),)).decides


TOO_LONG = NotRun(Tracking(50.0), "too long")
TOO_FAR = NotRun(Tracking(70.0), "too far")


@pytest.mark.parametrize(("proof", "refuted"), [(10.0, False), (10.1, True)])
def test_what_the_logs_refute_already_is_planned_without_them(monkeypatch, proof, refuted):
    asked = {}

    def tried(arena, experiments, progress):
        asked.update(logs=arena.logs, experiments=experiments)
        return [trial(50.0)], (TOO_FAR,)

    monkeypatch.setattr(plans, "favoured", lambda arena: ("two", proof))
    monkeypatch.setattr(plans, "proposals", lambda *given: (given, (TOO_LONG,)))
    monkeypatch.setattr(plans, "contest", tried)
    monkeypatch.setattr(plans, "refitted", lambda arena, t: t)
    monkeypatch.setattr(plans, "gap", lambda motion, where, logs: logs)
    effects = {"one": CATALOGUE["wear"]}
    found = plans._planned(arena(FIRST, SECOND), 7.0, 3, True, effects)
    assert asked["logs"] == (() if refuted else (OLD,))
    assert asked["experiments"] == (STAGE, "x", 7.0)
    assert found.favoured == ("two" if refuted else None)
    assert (found.gap, found.between, found.axis) == ((OLD,), ("one", "two"), "x")
    assert found.excited_by == {"one": CATALOGUE["wear"].excited_by}
    assert found.supposed
    assert set(found.not_run) == {TOO_LONG, TOO_FAR}
    monkeypatch.setattr(plans, "contest", lambda *_: ([], (TOO_FAR,)))
    with pytest.raises(InputError, match="none of the experiments"):
        plans._planned(arena(FIRST, SECOND), 7.0, 3, True, effects)


def test_an_ambiguous_diagnosis_asks_for_an_experiment_between_its_rivals(monkeypatch):
    asked = []

    def planned(arena, *given):
        asked.append(
            (tuple(e.name for e in arena.explanations), arena.logs, arena.test_function, given)
        )
        return "the plan"

    monkeypatch.setattr(plans, "_planned", planned)
    x = made.diagnosis_of()
    assert plans.next_experiment(x, STAGE, 0.07) == "the plan"
    effects = {n: CATALOGUE[n] for n in ("cogging", "quadratic_drag")}
    assert asked == [(tuple(effects), x.dataset.fit, 0.07, (10.0, 3, False, effects))]
    assert plans.next_experiment(made.diagnosis_of(Verdict.UNEXPLAINED), STAGE) is None
    assert plans.next_experiment(made.diagnosis_of(findings=ALONE), STAGE) is None
    others = (made.RIVAL, made.WEAK, built("wear"))
    tied = replace(ALONE[0], tied=tuple(c.effect.name for c in others))
    many = made.diagnosis_of(findings=(tied,), steps=(step(made.BEST, *others),))
    plans.next_experiment(many, STAGE)
    assert asked[-1][0] == ("cogging", "quadratic_drag", "constant_force")

    def refused(*_):
        raise CannotRun("no travel")

    monkeypatch.setattr(plans, "_planned", refused)
    with pytest.raises(CannotRun, match="no travel"):
        plans.next_experiment(x, STAGE)


def test_an_axis_whose_experiment_cannot_run_says_why(monkeypatch):
    def next_experiment(found, model, window):
        if found == "refused":
            raise CannotRun("axis x has no travel")
        return {"ambiguous": "the plan"}.get(found)

    monkeypatch.setattr(plans, "next_experiment", next_experiment)
    axes = {"x": "refused", "y": "ambiguous", "z": "nothing missing"}
    assert plans.next_experiments(axes, STAGE, None) == (
        {"y": "the plan"}, {"x": "axis x has no travel"},
    )  # fmt: skip


ALONE = (replace(made.FOUND[0], tied=()),)


def planned(monkeypatch):
    """plan with every part given: what the arena and the choice were."""
    asked = {}

    def choose(arena, *given):
        asked.update(arena=arena, given=given)
        return "the plan"

    def dataset(*given):
        asked.update(dataset=given)
        return made.DATASET

    monkeypatch.setattr(plans, "_planned", choose)
    monkeypatch.setattr(plans, "_dataset", dataset)
    monkeypatch.setattr(plans, "explained", lambda *given: given)
    return asked


@pytest.mark.parametrize("logs", [{"a": "log"}, None])
def test_a_plan_between_rivals_hands_on_what_it_was_asked(monkeypatch, logs):
    asked = planned(monkeypatch)
    monkeypatch.setattr(plans, "usable", lambda catalogue, model: catalogue)
    rivals, bar = [CATALOGUE["wear"], CATALOGUE["cogging"]], lambda *told: None
    found = plans.plan(
        STAGE, logs, {"h": "held"}, catalogue={"gms": 1}, between=rivals, axis="x", duration=7.0,
        test_function=0.07, progress=bar,
    )  # fmt: skip
    assert found == "the plan"
    assert asked["dataset"] == (STAGE, logs or {}, {"h": "held"}, rivals, "x", 0.07)
    effects = {"gms": 1, **{r.name: r for r in rivals}}
    assert asked["given"] == (7.0, 6, not logs, effects, bar)
    chosen = asked["arena"]
    assert (chosen.machine, chosen.name, chosen.test_function) == (STAGE, "x", 0.07)
    assert chosen.explanations == (rivals, STAGE, made.DATASET, bool(logs))
    assert chosen.logs == (made.DATASET.fit if logs else ())
    with pytest.raises(InputError, match="no axis"):
        plans.plan(STAGE, catalogue={}, axis="z")


@pytest.mark.parametrize(
    ("changes", "between"),
    [
        ({}, ("cogging", "quadratic_drag")),
        (
            {"ranking": (made.BEST, made.WEAK, made.LATER), "findings": ALONE},
            ("cogging", "constant_force"),
        ),
        ({"ranking": (made.BEST,)}, ("s",)),
        ({"verdict": Verdict.NOTHING_MISSING}, ("s",)),
    ],
)
def test_without_rivals_a_plan_asks_what_the_diagnosis_leaves_open(monkeypatch, changes, between):
    asked = planned(monkeypatch)
    base = built_fit(2.0, axis=TWO)
    monkeypatch.setattr(plans, "fit_aligned", lambda axis, dataset: (dataset, base))
    monkeypatch.setattr(plans, "diagnose_axis", lambda *given: made.diagnosis_of(**changes))
    plans.plan(STAGE, {"a": "log"}, catalogue={})
    found = asked["arena"].explanations
    assert tuple(e.name for e in found) == between
    assert asked["arena"].logs == made.DATASET.fit
    if between == ("s",):
        assert found[0].axis is TWO
    plans.plan(STAGE, catalogue={})
    assert asked["arena"].explanations == (Explanation("s", PLAIN),)
    assert asked["arena"].logs == ()


def test_the_dataset_is_that_of_the_axis_in_question(monkeypatch):
    every = {"y": "dataset y", "x": "dataset x"}
    monkeypatch.setattr(plans, "datasets", lambda *given: every)
    monkeypatch.setattr(plans, "simulated_dataset", lambda stage, axis: f"trial {axis}")
    other = replace(STAGE, name="o", axes={"x": PLAIN, "y": PLAIN})
    differ = [STAGE, other]  # on y
    assert plans._dataset(STAGE, {"a": "a.mcap"}, {}, [], "x", None) == "dataset x"
    assert plans._dataset(STAGE, {"a": "a.mcap"}, {}, differ, None, None) == "dataset y"
    assert plans._dataset(STAGE, {}, {}, differ, None, None) == "trial y"
    assert plans._dataset(STAGE, {}, {}, differ, "x", None) == "trial x"
    every.pop("x")
    assert plans._dataset(STAGE, {"a": "a.mcap"}, {}, [], None, None) == "dataset y"
    with pytest.raises(InputError, match="does not move"):
        plans._dataset(STAGE, {"a": "a.mcap"}, {}, [], "x", None)
