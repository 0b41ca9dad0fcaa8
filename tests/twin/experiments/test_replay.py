"""The twin follows a recorded reference."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from twin.effects import load_catalogue
from twin.errors import InputError
from twin.experiments.named import simulate
from twin.experiments.replay import recorded_setpoint, replay
from twin.logs import AxisLog, Log
from twin.model.file import load_model
from twin.simulator import ReducedSimulator

STAGE = replace(load_model("proton_xy", load_catalogue()), sample_rate=2000.0)


@pytest.fixture(scope="module")
def log() -> Log:
    return simulate(STAGE, "moves", seed=3, duration=2.0, simulator=ReducedSimulator)


def test_a_replay_of_a_log_of_the_twin_is_that_log_but_for_the_noise(log: Log) -> None:
    again = replay(STAGE, log, simulator=ReducedSimulator)
    for axis in STAGE.axes:
        assert np.abs(again.axes[axis].position - log.axes[axis].position).max() < 1e-6
        assert again.axes[axis].columns.keys() == log.axes[axis].columns.keys()
    assert again.metadata["experiment"] == "replay"


def test_rates_that_the_log_lacks_are_those_of_its_reference(log: Log) -> None:
    full = recorded_setpoint(STAGE, log)
    place = {"setpoint_position": log.axes["x"].columns["setpoint_position"]}
    poor = recorded_setpoint(STAGE, replace(log, axes={"x": AxisLog(place)}))
    assert poor.velocity[:, 0] == pytest.approx(full.velocity[:, 0], abs=1e-3)
    assert not poor.position[:, 1].any()


def test_what_cannot_be_followed_is_refused(log: Log) -> None:
    bare = Log(2000.0, {"x": AxisLog({"position": np.zeros(9), "force": np.zeros(9)})})
    with pytest.raises(InputError, match="no setpoint_position"):
        replay(STAGE, bare)
    with pytest.raises(InputError, match="name the axes alike"):
        replay(STAGE, replace(bare, axes={"z": bare.axes["x"]}))
    with pytest.raises(InputError, match="set sample_rate"):
        replay(replace(STAGE, sample_rate=1000.0), log)
