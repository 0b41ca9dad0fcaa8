"""What a plan asks, chooses and proposes: both sides of each rule, within the stage's limits."""

from __future__ import annotations

import importlib
import math
from dataclasses import replace
from types import SimpleNamespace

import built_results as made
import numpy as np
import pytest
from built_fits import CATALOGUE, HARDWARE, PLAIN, axis_of, built, built_fit, built_motion, fitted

from identify.contest import (
    Arena,
    Explanation,
)
from identify.diagnose import Verdict
from identify.proposals import _affordable, _fits, _move_time, _swept, neat, proposals
from identify.residual import Windowed
from twin.errors import InputError
from twin.experiment import stage_limits
from twin.experiment_kinds import Moves, Passes, Staircase, Steps, Sweep, Tracking
from twin.model import StageModel

plans = importlib.import_module("identify.plan")
STAGE = StageModel("s", {"x": PLAIN, "y": replace(PLAIN, mass=3.1)}, 2000.0)
ONE = axis_of(fitted("quadratic_drag", c=0.9)).with_effect(fitted("lugre", Fc=0.3, Fs=0.3))
TWO = axis_of(fitted("constant_force", F0=0.2)).with_effect(fitted("lugre", Fc=0.3, Fs=0.3))
FIRST, SECOND = Explanation("one", ONE), Explanation("two", TWO)
MOTION, OLD = built_motion("new", 2.0, seed=4), Windowed.of(built_motion("old", 1.5, seed=5), 0.04)


def arena(*explanations: Explanation, logs=(OLD,), window=0.04) -> Arena:
    return Arena(STAGE, "x", explanations, logs, window)


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


@pytest.mark.parametrize(("proof", "refuted"), [(10.0, False), (10.1, True)])
def test_what_the_logs_refute_already_is_planned_without_them(monkeypatch, proof, refuted):
    asked = {}

    def tried(arena, experiments, progress):
        asked.update(logs=arena.logs, experiments=experiments)
        return [trial(50.0)]

    monkeypatch.setattr(plans, "favoured", lambda arena: ("two", proof))
    monkeypatch.setattr(plans, "proposals", lambda *given: given)
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
    monkeypatch.setattr(plans, "contest", lambda *_: [])
    with pytest.raises(InputError, match="none of the experiments"):
        plans._planned(arena(FIRST, SECOND), 7.0, 3, True, effects)


def test_an_ambiguous_diagnosis_asks_for_an_experiment_between_its_rivals(monkeypatch):
    asked = []

    def planned(arena, *given):
        asked.append((tuple(e.name for e in arena.explanations), arena.logs, arena.window, given))
        return "the plan"

    monkeypatch.setattr(plans, "_planned", planned)
    x = made.diagnosis_of()
    assert plans.next_experiment(x, STAGE, 0.07) == "the plan"
    effects = {n: CATALOGUE[n] for n in ("cogging", "quadratic_drag")}
    assert asked == [(tuple(effects), x.study.fit, 0.07, (10.0, 3, False, effects))]
    assert plans.next_experiment(replace(x, verdict=Verdict.MISSING_EFFECT), STAGE) is None
    assert plans.next_experiment(replace(x, ranking=(made.BEST, made.WEAK)), STAGE) is None
    tied = replace(x.steps[0], tied=("quadratic_drag", "constant_force", "wear"))
    many = replace(x, steps=(tied,), ranking=(*x.ranking, built("wear")))
    plans.next_experiment(many, STAGE)
    assert asked[-1][0] == ("cogging", "quadratic_drag", "constant_force")

    def refused(*_):
        raise InputError("no travel")

    monkeypatch.setattr(plans, "_planned", refused)
    assert plans.next_experiment(x, STAGE) is None


def planned(monkeypatch):
    """plan with every part given: what the arena and the choice were."""
    asked = {}

    def choose(arena, *given):
        asked.update(arena=arena, given=given)
        return "the plan"

    def study(*given):
        asked.update(study=given)
        return made.STUDY

    monkeypatch.setattr(plans, "_planned", choose)
    monkeypatch.setattr(plans, "_study", study)
    monkeypatch.setattr(plans, "explained", lambda *given: given)
    return asked


@pytest.mark.parametrize("logs", [{"a": "log"}, None])
def test_a_plan_between_rivals_hands_on_what_it_was_asked(monkeypatch, logs):
    asked = planned(monkeypatch)
    rivals, bar = [CATALOGUE["wear"], CATALOGUE["cogging"]], object()
    found = plans.plan(
        STAGE, logs, {"h": "held"}, catalogue={"gms": 1}, between=rivals, axis="x", duration=7.0,
        window=0.07, progress=bar,
    )  # fmt: skip
    assert found == "the plan"
    assert asked["study"] == (STAGE, logs or {}, {"h": "held"}, rivals, "x", 0.07)
    effects = {"gms": 1, **{r.name: r for r in rivals}}
    assert asked["given"] == (7.0, 6, not logs, effects, bar)
    chosen = asked["arena"]
    assert (chosen.stage, chosen.name, chosen.window) == (STAGE, "x", 0.07)
    assert chosen.explanations == (rivals, STAGE, made.STUDY, bool(logs))
    assert chosen.logs == (made.STUDY.fit if logs else ())
    with pytest.raises(InputError, match="no axis"):
        plans.plan(STAGE, catalogue={}, axis="z")


@pytest.mark.parametrize(
    ("changes", "between"),
    [
        ({}, ("cogging", "quadratic_drag")),
        ({"ranking": (made.BEST, made.WEAK, made.LATER)}, ("cogging", "constant_force")),
        ({"ranking": (made.BEST,)}, ("s",)),
        ({"steps": (), "verdict": Verdict.NOTHING_MISSING}, ("s",)),
    ],
)
def test_without_rivals_a_plan_asks_what_the_diagnosis_leaves_open(monkeypatch, changes, between):
    asked = planned(monkeypatch)
    base = built_fit(2.0, axis=TWO)
    monkeypatch.setattr(plans, "fit_aligned", lambda axis, study: (study, base))
    monkeypatch.setattr(plans, "diagnose_axis", lambda *given: made.diagnosis_of(**changes))
    plans.plan(STAGE, {"a": "log"}, catalogue={})
    found = asked["arena"].explanations
    assert tuple(e.name for e in found) == between
    assert asked["arena"].logs == made.STUDY.fit
    if between == ("s",):
        assert found[0].axis is TWO
    plans.plan(STAGE, catalogue={})
    assert asked["arena"].explanations == (Explanation("s", PLAIN),)
    assert asked["arena"].logs == ()


def test_the_study_is_that_of_the_axis_in_question(monkeypatch):
    every = {"y": "study y", "x": "study x"}
    monkeypatch.setattr(plans, "studies", lambda *given: every)
    monkeypatch.setattr(plans, "trial_study", lambda stage, axis: f"trial {axis}")
    other = replace(STAGE, name="o", axes={"x": PLAIN, "y": PLAIN})
    differ = [STAGE, other]  # on y
    assert plans._study(STAGE, {"a": 1}, {}, [], "x", None) == "study x"
    assert plans._study(STAGE, {"a": 1}, {}, differ, None, None) == "study y"
    assert plans._study(STAGE, {}, {}, differ, None, None) == "trial y"
    assert plans._study(STAGE, {}, {}, differ, "x", None) == "trial x"
    every.pop("x")
    assert plans._study(STAGE, {"a": 1}, {}, [], None, None) == "study y"
    with pytest.raises(InputError, match="does not move"):
        plans._study(STAGE, {"a": 1}, {}, [], "x", None)


# --- proposals ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "value", [0.1234567, 0.999999, 1.0, 4.0, 1234.9, 5e-7, 0.29999999999999999]
)
def test_a_neat_value_has_three_digits_and_is_no_larger(value):
    found = neat(value)
    assert found <= value * (1.0 + 1e-12)
    assert found > value * (1.0 - 1e-2)
    assert float(f"{found:.3g}") == found
    assert neat(found) == found


def test_a_weak_motor_is_asked_for_a_part_of_its_force():
    for limit, effort in ((math.inf, 1.0), (0.4 * 5.3 * 2.0 / 0.16, 1.0), (5.3, 0.2)):
        axis = replace(PLAIN, hardware=replace(HARDWARE, force_limit=limit))
        assert _affordable(StageModel("s", {"x": axis}), "x") == pytest.approx(effort)


def test_proposals_cover_the_sorts_and_last_about_as_long_as_asked():
    found = proposals(STAGE, "x", 8.0)
    kinds = {type(e) for e in found}
    assert {Tracking, Moves, Passes, Staircase, Steps, Sweep} <= kinds
    assert Tracking(8.0) in found
    for e in found:
        assert getattr(e, "axis", "x") == "x"
        assert getattr(e, "span", 0.0) <= 0.9 * 0.24 + 1e-12
    assert any(getattr(e, "other", 0.0) > 0.0 for e in found)
    alone = proposals(StageModel("s", {"x": PLAIN}, 2000.0), "x", 8.0)
    assert not any(getattr(e, "other", 0.0) for e in alone)
    rounds = [Moves(count=8), Moves(count=4, dwell=1.0)]  # 8 s in moves of 0.9 s, of 1.8 s
    assert all(m in found for m in rounds)


def test_a_proposal_may_take_three_tenths_more_than_asked():
    lasting = SimpleNamespace(setpoint=lambda model, rng: SimpleNamespace(duration=12.99))
    assert _fits(lasting, STAGE, 10.0)
    assert not _fits(lasting, STAGE, 9.99)

    def refused(model, rng):
        raise InputError("no")

    assert not _fits(SimpleNamespace(setpoint=refused), STAGE, 1e9)


def test_a_sweep_is_half_as_strong_as_the_limits_allow():
    limits = dict(zip(STAGE.axes, stage_limits(STAGE), strict=True))
    found = list(_swept(STAGE, limits, "x", 8.0))
    assert [(round(s.span, 4), s.highest) for s in found] == [
        (0.216, 60.0), (0.216, 120.0), (0.0216, 60.0), (0.0216, 120.0),
    ]  # fmt: skip
    for s in found:
        assert s.amplitude == neat(0.5 * s.most_force(PLAIN))
        assert (s.effort, s.lowest, s.repeats) == (0.5, 2.0, 1)
        assert s.speed <= 2.4 * s.span / 8.0


def test_the_time_of_a_move_follows_from_its_limits():
    (limit, _) = stage_limits(STAGE)  # 0.2 m/s, 2 m/s^2, 100 m/s^3
    assert _move_time(limit, 0.1) == pytest.approx(0.1 / 0.2 + 0.2 / 2.0 + 2.0 / 100.0)
    short = math.sqrt(1e-4 * 2.0)
    assert _move_time(limit, 1e-4) == pytest.approx(1e-4 / short + short / 2.0 + 2.0 / 100.0)
