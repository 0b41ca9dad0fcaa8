"""What a feedforward is worth is told in simulation, effect by effect."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from cli_runs import refusal, twin
from machines import CATALOGUE, tracked
from planted_logs import SLIDE

from identify import feedforward
from twin.effect import Kind
from twin.errors import CannotRun, InputError
from twin.laws.trials import moderate
from twin.logs import AxisLog, Log, write_log
from twin.model.file import save_model
from twin.model.machine import Fitted, Hardware, MachineModel

HARDWARE = Hardware(
    travel=(-0.1, 0.1), encoder_noise=1e-9, velocity=0.2, acceleration=2.0, jerk=100.0
)
KNOWN = MachineModel("slide", {"x": replace(SLIDE, hardware=HARDWARE)}, 2000.0)


HIDDEN = {
    "cogging": None, "cable_hysteresis": None, "payload_mass": None, "asymmetric_friction": None,
    "force_constant_ripple": None, "actuator_delay": {"tau": 2e-3}, "actuator_lag": {"tau": 2e-3},
}  # fmt: skip


def having(effect: str) -> MachineModel:
    own = CATALOGUE[effect]
    values = HIDDEN[effect] or moderate(own, np.random.default_rng(4), 0.5)
    return KNOWN.with_axis("x", KNOWN.axes["x"].with_effect(Fitted.at_start(own, values)))


@pytest.fixture(scope="module")
def log() -> Log:
    return tracked(KNOWN, 2, 3.0, "moves")


@pytest.mark.parametrize("effect", HIDDEN)
def test_a_known_effect_takes_most_of_the_tracking_error(log, effect) -> None:
    found = feedforward(having(effect), log, KNOWN).axes["x"]
    assert found.before is not None
    assert found.diagnosed.rms < found.before.rms / 3.0 < found.without.rms / 3.0
    assert found.gains == {effect: pytest.approx(found.before.rms - found.diagnosed.rms)}
    assert found.before.largest > found.before.rms


def test_a_log_without_a_setpoint_is_followed_as_it_moved(log) -> None:
    """Also one that begins amidst its motion, rounded as its encoder does."""
    position = np.round(log.axes["x"].position[1500:] / 1e-7) * 1e-7
    columns = {"position": position, "force": log.axes["x"].force[1500:]}
    found = feedforward(having("cogging"), Log(2000.0, {"x": AxisLog(columns)}), KNOWN).axes["x"]
    assert found.before is not None
    assert found.diagnosed.rms < found.before.rms / 3.0


def test_the_machine_may_be_another_than_the_model(log) -> None:
    machine = having("cogging")
    found = feedforward(KNOWN, log, machine=machine).axes["x"]
    other = feedforward(machine, log, KNOWN).axes["x"]
    assert found.diagnosed == other.before
    assert CATALOGUE["cogging"].kind is Kind.FORCE


def test_a_friction_takes_the_place_of_the_one_before(log) -> None:
    lugre = Fitted.at_start(CATALOGUE["lugre"], {"Fc": 0.8, "Fs": 1.0, "sigma0": 3000.0})
    model = KNOWN.with_axis("x", KNOWN.axes["x"].with_effect(lugre))
    found = feedforward(model, log, KNOWN).axes["x"]
    assert found.before is not None
    assert found.gains == {"lugre": pytest.approx(found.before.rms - found.diagnosed.rms)}


def test_without_a_model_before_every_effect_has_its_gain(log) -> None:
    model = having("cogging")
    found = feedforward(model, log).axes["x"]
    assert found.before is None
    assert set(found.gains) == set(model.axes["x"].names)
    assert min(found.gains.values()) > 0.0


def test_the_command_tells_what_the_call_gives(tmp_path, log) -> None:
    save_model(having("cogging"), tmp_path / "better.toml")
    save_model(KNOWN, tmp_path / "fitted.toml")
    write_log(log, tmp_path / "run.mcap")
    arguments = ("feedforward", "better.toml", "run.mcap", "--before", "fitted.toml")
    told = json.loads(twin(*arguments, "--json", folder=tmp_path).stdout)
    axis = told["axes"]["x"]
    assert axis["unit"] == "m"
    assert axis["gains"]["cogging"] == pytest.approx(
        axis["before"]["rms"] - axis["diagnosed"]["rms"]
    )
    text = twin(*arguments, folder=tmp_path).stdout
    assert "axis x: tracking error, RMS and largest" in text
    assert "with all but cogging: RMS" in text
    assert "µm" in text
    assert "nowhere.toml" in refusal(*arguments[:-1], "nowhere.toml", folder=tmp_path)


def test_what_cannot_be_simulated_is_one_line(log) -> None:
    held = MachineModel("held", {"x": replace(KNOWN.axes["x"], mass=0.0, effects=())}, 2000.0)
    with pytest.raises(CannotRun, match="imposed"):
        feedforward(held, log)
    renamed = MachineModel("other", {"z": KNOWN.axes["x"]}, 2000.0)
    with pytest.raises(InputError, match="axis"):
        feedforward(having("cogging"), log, renamed)
