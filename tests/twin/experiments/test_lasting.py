"""An experiment lasts what was asked, and where its moves take longer, that is said."""

import numpy as np
import pytest

import twin
from twin.experiments.experiment import Experiment
from twin.experiments.kinds import Moves, Passes, Rests, Staircase, Steps, Sweep
from twin.experiments.named import EXPERIMENTS, find_experiment, lasting, missed

MODEL = twin.load_model("proton_xy")


def seconds(experiment: Experiment, seed: int = 0) -> float:
    return experiment.setpoint(MODEL, np.random.default_rng(seed)).duration


@pytest.mark.parametrize("asked", [3.0, 20.0])
@pytest.mark.parametrize("name", sorted(EXPERIMENTS))
def test_a_named_experiment_lasts_what_was_asked(name, asked):
    lasts = seconds(find_experiment(name, MODEL, duration=asked), seed=4)
    if name == "cable_pass" and asked < 6.0:  # a pass each way over the travel at 0.1 m/s
        assert lasts == pytest.approx(6.2, abs=0.1)
        assert missed(asked, lasts) is not None
    else:
        assert lasts == pytest.approx(asked, rel=0.05)


@pytest.mark.parametrize("draft", [
    Passes("x", 0.05, 0.1, 1), Passes("x", 0.05, 0.1, 500), Passes("x", 0.05, 0.1, 3, other=0.1),
    Staircase("x", (0.01, 0.1), 0.05), Steps("x", 0.1, 0.05, (1.0, 0.5)),
    Rests("x", 0.01, 0.05, (0.1, 1.0)), Sweep("x", 0.05, 0.1, 1, 0.1, 2.0, 60.0, effort=0.5),
])  # fmt: skip
def test_a_draft_of_any_kind_fills_the_time_with_repeats_and_rests(draft):
    found = lasting(draft, MODEL, 9.0)
    assert seconds(found) == pytest.approx(9.0, rel=0.02)
    assert type(found) is type(draft)
    assert found.span == draft.span


def test_moves_of_a_given_length_visit_as_many_places_as_fit_whatever_the_seed():
    for seed in range(5):
        assert seconds(Moves(100, duration=7.0), seed) == pytest.approx(7.0, abs=1e-3)
    few = seconds(Moves(3, duration=20.0))  # three places, with rests between
    assert few == pytest.approx(20.0, abs=1e-3)
    assert seconds(Moves(100, dwell=0.0, duration=0.01)) < 1.5  # one move at least


def test_what_takes_longer_or_ends_earlier_is_said_with_both_lengths():
    assert missed(10.0, 10.4) is None
    assert "lasts 6.2 s, not 5 s as asked: its moves take" in missed(5.0, 6.2)
    assert "lasts 3 s, not 5 s as asked: it has no rests" in missed(5.0, 3.0)
