"""Every experiment that is proposed stays within the limits of its stage."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from machines import one_axis

from identify import plan
from identify.experiment_design.candidate_experiments import proposals
from identify.experiment_design.discrimination import (
    Arena,
    Explanation,
    contest,
    require_within_limits,
)
from identify.output.as_json import json_of
from identify.output.text import plan_text
from identify.output.words.plan import not_run_in_words
from twin.effects import load_catalogue
from twin.errors import CannotRun, InputError
from twin.experiments.experiment import Experiment
from twin.experiments.kinds import KINDS, Passes, Sweep, Tracking
from twin.experiments.lasting import ALLOWED
from twin.experiments.named import simulate
from twin.model.file import load_model
from twin.model.machine import MachineModel
from twin.simulator import ReducedSimulator

CATALOGUE = load_catalogue()
PROTON = load_model("proton_xy", CATALOGUE)
RATE = 2500.0  # Hz, of the machines that are identified: quicker than 10 kHz, and enough


def with_limits(**changed: float | tuple[float, float]) -> MachineModel:
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


@pytest.mark.parametrize("name", STAGES)
def test_every_proposal_stays_within_the_limits_of_the_stage(name):
    stage = STAGES[name]
    for experiment in proposals(stage, "x", 5.0)[0]:
        assert_within_limits(stage, experiment)


def assert_within_limits(stage: MachineModel, experiment: Experiment) -> None:
    """Position, speed, acceleration and jerk asked for, the force of a sweep included."""
    setpoint = experiment.setpoint(stage, np.random.default_rng(0))
    assert setpoint.duration < (1.0 + ALLOWED) * 5.0
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
    stage = replace(one_axis(STAGES["weak"]), sample_rate=RATE)
    arena = Arena(stage, "x", (Explanation("as it is", stage.axes["x"]),))
    trials, not_run = contest(arena, proposals(stage, "x", 20.0)[0])
    assert len(trials) > 5
    for trial in trials:
        log = simulate(stage, trial.experiment, simulator=ReducedSimulator)
        low, high = stage.axes["x"].hardware.travel
        assert low < log.truth["x"]["position"].min() < log.truth["x"]["position"].max() < high
        assert np.abs(log.axes["x"].force).max() < stage.axes["x"].hardware.force_limit
    assert all(not_run_in_words(n).count(": ") >= 2 for n in not_run)
    wild = Passes("x", span=0.3, speed=0.2, repeats=1)
    with pytest.raises(CannotRun, match=r"axis x (went to|asks for)"):
        require_within_limits(stage, simulate(stage, wild, simulator=ReducedSimulator))


def test_what_cannot_run_is_told_with_its_reason_and_a_mistake_is_not_passed_over():
    """A window too short for slow motion beside a loud encoder, and passes that take too long."""
    stage = replace(one_axis(with_limits(encoder_noise=2e-7)), sample_rate=RATE)
    found = plan(stage, catalogue=CATALOGUE, duration=2.0, test_function=0.02)
    assert found.not_run
    told = [not_run_in_words(n) for n in found.not_run]
    kinds = {line.split(":")[0] for line in told}
    assert kinds <= set(KINDS)
    assert any("too slowly for a test function of 0.02 s" in line for line in told)
    assert json_of(found)["not_run"] == told
    assert f"not run: {told[0]}" in plan_text(found)
    arena = Arena(stage, "x", (Explanation("as it is", stage.axes["x"]),), test_function=0.02)
    asked = [Passes("x", span=9.0, speed=0.2, repeats=1)]
    trials, not_run = contest(arena, asked)
    assert trials == []
    assert not_run_in_words(not_run[0]).startswith("passes: axis x, span 9 m")
    assert "(with" not in not_run_in_words(replace(not_run[0], truth=None))
    assert not_run_in_words(replace(not_run[0], truth="wear")).endswith("(with wear)")
    assert "outside its travel" in not_run[0].reason
    with pytest.raises(InputError, match="effort"):
        contest(arena, [Passes("x", span=0.1, speed=0.1, repeats=1, effort=2.0)])


@pytest.mark.parametrize(
    ("changes", "experiment"),
    [
        ({"travel": None}, Tracking(2.0)),
        ({"velocity": 1e-4}, Tracking(2.0)),
        ({}, Passes("x", span=0.1, speed=9.0, repeats=1)),
        ({}, Passes("x", span=0.001, speed=0.2, repeats=1)),
        ({}, Passes("x", span=0.1, speed=0.1, repeats=1, other=0.3)),
        ({}, Sweep("x", 0.1, 0.01, 1, 1e4, 2.0, 60.0, effort=0.5)),
        ({}, Sweep("x", 0.1, 0.01, 1, 0.01, 2.0, 6e4, effort=0.5)),
    ],
)
def test_a_motion_beyond_the_machine_is_one_kind_of_error(changes, experiment):
    stage = with_limits(**changes)
    if isinstance(experiment, Passes) and experiment.other:
        stage = one_axis(stage)
    with pytest.raises(CannotRun):
        experiment.setpoint(stage, np.random.default_rng(0))
