"""The planned experiment stays within the stage's limits, and the ambiguity is gone after it."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace

import numpy as np
import pytest
from machines import one_axis
from test_command_line import refusal, twin

import identify.contest
from identify import diagnose, plan
from identify.as_json import diagnose_json
from identify.contest import Arena, Explanation, contest, within_limits
from identify.diagnose import LEAST_SEPARATION, Verdict
from identify.plan import next_experiment
from identify.proposals import TOLERANCE, proposals
from twin.effects import Catalogue, load_catalogue
from twin.errors import InputError
from twin.experiment import Experiment
from twin.experiment_file import format_experiment, load_experiment, parameters, save_experiment
from twin.experiment_kinds import KINDS, Passes, Rests, Steps, Sweep, kind_of
from twin.experiments import simulate
from twin.model import Fitted, StageModel
from twin.model_file import load_model
from twin.simulator import ReducedStage

CATALOGUE = load_catalogue()
PROTON = load_model("proton_xy", CATALOGUE)
DURATION = 8.0  # s of the planned experiments


def with_limits(**changed: float | tuple[float, float]) -> StageModel:
    """The stage with other limits on x."""
    x = PROTON.axes["x"]
    return PROTON.with_axis("x", replace(x, hardware=replace(x.hardware, **changed)))


STAGES = {
    "proton": PROTON,
    "one axis": one_axis(PROTON),
    "short and slow": with_limits(travel=(0.01, 0.04), velocity=0.02, acceleration=0.1),
    "weak": with_limits(force_limit=2.0, jerk=5.0),
    "emps": load_model("examples/emps.toml", CATALOGUE),
}


# Every experiment that is proposed stays within the stage's limits.


@pytest.mark.parametrize("name", STAGES)
def test_every_proposal_stays_within_the_limits_of_the_stage(name):
    stage = STAGES[name]
    for experiment in proposals(stage, "x", 5.0):
        assert_within_limits(stage, experiment)


def assert_within_limits(stage: StageModel, experiment: Experiment) -> None:
    """Position, speed, acceleration and jerk asked for, the force of a sweep included."""
    setpoint = experiment.setpoint(stage, np.random.default_rng(0))
    assert setpoint.duration < TOLERANCE * 5.0
    for i, axis in enumerate(stage.axes.values()):
        h = axis.hardware
        low, high = h.travel
        position, velocity = setpoint.position[:, i], setpoint.velocity[:, i]
        pushed = setpoint.acceleration[:, i] + setpoint.force[:, i] / axis.mass
        assert low - 1e-9 <= position.min() <= position.max() <= high + 1e-9
        assert np.abs(velocity).max() <= h.velocity * (1.0 + 1e-6)
        assert np.abs(pushed).max() <= h.acceleration * (1.0 + 1e-6)
        assert np.abs(np.diff(pushed)).max() * stage.sample_rate <= h.jerk * (1.0 + 1e-3)
        assert np.abs(setpoint.force[:, i]).max() <= h.force_limit


def test_an_experiment_beyond_the_limits_is_caught_by_the_same_law():
    soft = with_limits(jerk=10.0)
    hard = Passes("x", span=0.1, speed=0.1, repeats=1)
    assert_within_limits(PROTON, hard)
    setpoint = hard.setpoint(PROTON, np.random.default_rng(0))

    class Forged(Passes):
        def setpoint(self, model, rng):
            return setpoint

    with pytest.raises(AssertionError):
        assert_within_limits(soft, Forged("x", span=0.1, speed=0.1, repeats=1))


def test_what_a_weak_motor_cannot_do_is_not_planned():
    stage = one_axis(STAGES["weak"])
    arena = Arena(stage, "x", (Explanation("as it is", stage.axes["x"]),))
    trials = contest(arena, proposals(stage, "x", 5.0))
    assert len(trials) > 10
    for trial in trials:
        log = simulate(stage, trial.experiment, stage=ReducedStage)
        low, high = stage.axes["x"].hardware.travel
        assert low < log.truth["x"]["position"].min() < log.truth["x"]["position"].max() < high
        assert np.abs(log.axes["x"].force).max() < stage.axes["x"].hardware.force_limit
    wild = Passes("x", span=0.3, speed=0.2, repeats=1)
    assert not within_limits(stage, simulate(stage, wild, stage=ReducedStage))


# Ambiguous pairs: poor motion, then the planned experiment, with each explanation as the truth.


@dataclass(frozen=True)
class Case:
    """Two effects, each with the values of a machine; the model that lacks both; poor motion."""

    stage: StageModel
    pair: dict[str, dict[str, float]]
    poor: Experiment

    def machine(self, truth: str) -> StageModel:
        planted = Fitted.at_start(CATALOGUE[truth], self.pair[truth])
        return self.stage.with_axis("x", self.stage.axes["x"].with_effect(planted))


def stage_of(friction: Fitted | None = None, *forces: Fitted) -> StageModel:
    """One axis of the stage with a friction, its own where None, and some forces."""
    stage = one_axis(PROTON)
    x = stage.axes["x"]
    return stage.with_axis("x", replace(x, effects=(friction or x["lugre"], *forces)))


def effect(name: str, **values: float) -> Fitted:
    return Fitted.at_start(CATALOGUE[name], values)


GENTLE = Passes("x", span=0.3, speed=0.05, repeats=1, effort=0.02)
CASES = {
    # The command changes slowly, so that a dead time and a time constant do the same.
    "delay": Case(
        one_axis(PROTON),
        {"actuator_delay": {"tau": 2e-4}, "actuator_lag": {"tau": 2e-4}},
        replace(GENTLE, effort=0.05),
    ),
    # Against a load of 60 N the motor force hardly varies at any place.
    "ripple": Case(
        stage_of(None, effect("constant_force", F0=60.0)),
        {"cogging": {"a1": 2e-3}, "force_constant_ripple": {"a1": 2e-3 / 60.0}},
        GENTLE,
    ),
    # At one high speed the dry friction is one number, and so is its asymmetry.
    "asymmetry": Case(
        stage_of(effect("stribeck", Fc=0.285, Fs=0.335, v0=0.01, sigma2=0.018)),
        {"constant_force": {"F0": 2e-3}, "asymmetric_friction": {"coulomb": -7e-3}},
        Passes("x", span=0.3, speed=0.25, repeats=4),
    ),
}
TRUTHS = [(name, truth) for name, case in CASES.items() for truth in case.pair]


def separation(ranking) -> float:
    """Evidence of the best explanation over the other."""
    return ranking[0].delta_bic - ranking[1].delta_bic


@pytest.mark.parametrize(("name", "truth"), TRUTHS)
def test_after_the_planned_experiment_the_ambiguity_is_gone(name, truth):
    assert_resolved(CASES[name], truth, Catalogue([CATALOGUE[e] for e in CASES[name].pair]))


def assert_resolved(case: Case, truth: str, catalogue: Catalogue) -> None:
    machine = case.machine(truth)
    poor = {"poor": simulate(machine, case.poor, seed=1, stage=ReducedStage)}
    held = {"held": simulate(machine, case.poor, seed=2, stage=ReducedStage)}
    before = diagnose(case.stage, poor, held, catalogue=catalogue).axes["x"]
    assert abs(separation(before.ranking)) < LEAST_SEPARATION
    rivals = [CATALOGUE[e] for e in case.pair]
    found = plan(case.stage, poor, between=rivals, catalogue=catalogue, duration=DURATION)
    assert found.decides
    assert set(found.between) == set(case.pair)
    new = {"new": simulate(machine, found.chosen.experiment, seed=3, stage=ReducedStage)}
    after = diagnose(case.stage, {**poor, **new}, held, catalogue=catalogue).axes["x"]
    assert after.verdict is Verdict.MISSING_EFFECT
    assert after.ranking[0].effect.name == truth
    assert separation(after.ranking) > LEAST_SEPARATION


def test_what_no_motion_tells_apart_is_said():
    found = plan(
        PROTON, between=[CATALOGUE["constant_force"], CATALOGUE["asymmetric_friction"]],
        catalogue=CATALOGUE, duration=4.0,
    )  # fmt: skip
    # The cable of this stage has a constant force of its own, which takes over the first.
    assert not found.decides
