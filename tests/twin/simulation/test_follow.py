"""What a machine would record of a run, and of one that follows a recorded reference."""

import tomllib
from dataclasses import replace

import numpy as np
import pytest
from constructed import CATALOGUE, effect, two_waves

from twin.errors import InputError
from twin.experiments.trajectory import Setpoint
from twin.logs import AxisLog, Log
from twin.logs.log import joined
from twin.model.file import load_model, parse_model
from twin.model.machine import AxisModel, Hardware, MachineModel
from twin.simulation import simulators
from twin.simulation.follow import follow_parts, recorded_setpoint, replay
from twin.simulation.simulate import simulate
from twin.simulation.simulators import ReducedSimulator

RATE, N = 1000.0, 250
QUIET = Hardware(encoder_noise=0.0, current_noise=0.0, force_constant=13.0)


def model_of(hardware: Hardware = QUIET) -> MachineModel:
    effects = {"x": (effect("lugre"),), "y": (effect("cable_slab", {"k1": 30.0}),)}
    axes = {a: AxisModel(m, hardware, effects[a]) for a, m in (("x", 2.0), ("y", 3.0))}
    return MachineModel("m", axes, RATE)


def noise(seed: int = 3):
    one, other = np.random.default_rng(seed).spawn(2)
    return one, other


def follow(model: MachineModel, wanted: Setpoint, seed: int = 0) -> Log:
    parts = follow_parts(model, wanted, noise(), name="n", seed=seed, simulator=ReducedSimulator)
    return joined(parts)


def test_every_column_is_the_signal_that_it_names():
    model, wanted = model_of(), two_waves(N)
    log = follow(model, wanted)
    run = simulators.run(model, wanted, noise()[0], simulator=ReducedSimulator)
    assert log.sample_rate == RATE
    for i, (name, axis) in enumerate(log.axes.items()):
        reading, command, position, velocity = run.signals[:, i].T
        found = {
            "position": reading, "force": command, "current": command / 13.0,
            "setpoint_position": wanted.position[:, i],
            "setpoint_velocity": wanted.velocity[:, i],
            "setpoint_acceleration": wanted.acceleration[:, i],
        }  # fmt: skip
        assert set(axis.columns) == set(found)
        for column, values in found.items():
            np.testing.assert_allclose(axis.columns[column], values, rtol=1e-12, err_msg=column)
        truth = log.truth[name]
        np.testing.assert_array_equal(truth["position"], position)
        np.testing.assert_array_equal(truth["velocity"], velocity)
        assert axis.force_constant == 13.0
    for label, forces in zip(run.table.labels, run.forces.T, strict=True):
        np.testing.assert_array_equal(log.truth[label[0]][label[1]], forces)
    for (name, state), values in zip(run.state_names, run.states.T, strict=True):
        np.testing.assert_array_equal(log.truth[name][state], values)
    assert "cable_slab" not in log.truth["x"]
    assert "lugre" not in log.truth["y"]


def test_what_made_a_log_is_written_into_it():
    model = model_of()
    log = follow(model, two_waves(N), seed=9)
    assert log.metadata["source"] == "simulation"
    assert (log.metadata["experiment"], log.metadata["seed"]) == ("n", "9")
    assert log.metadata["software"].startswith("proton-twin ")
    assert set(log.attachments) == {"model.toml"}
    text = log.attachments["model.toml"].decode()
    again = parse_model(tomllib.loads(text), CATALOGUE, None, "here")
    assert again.axes.keys() == model.axes.keys()


def test_the_noise_of_a_current_is_its_own_and_rides_on_the_force():
    loud = replace(QUIET, current_noise=0.02)
    still = follow(model_of(), two_waves(N))
    log = follow(model_of(loud), two_waves(N))
    added = [log.axes[a].columns["current"] - still.axes[a].columns["current"] for a in "xy"]
    for part, axis in zip(added, "xy", strict=True):
        assert np.std(part) == pytest.approx(0.02, rel=0.2)
        columns = log.axes[axis].columns
        np.testing.assert_allclose(columns["force"], 13.0 * columns["current"])
    assert abs(np.corrcoef(*added)[0, 1]) < 0.25
    np.testing.assert_array_equal(log.axes["x"].position, still.axes["x"].position)


STAGE = replace(load_model("proton_xy", CATALOGUE), sample_rate=2000.0)


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
