"""What is left out of logs: one that says nothing, and what lies where no training log has been."""

from __future__ import annotations

import json
import logging
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from built_fits import axis_of, fitted
from check_drive import COULOMB, DAMPING, MASS, drive
from cli_runs import twin
from constructed import log_of, waves
from machines import CATALOGUE

from identify.dataset.dataset import Dataset
from identify.dataset.preparation import datasets
from identify.dataset.prepared_log import moving
from identify.estimation.alignment import realigned
from identify.estimation.errors import error_on
from identify.estimation.evidence import rms
from identify.estimation.fit import fit_axis
from identify.output.words.fit import prepared_in_words
from identify.results.results import FitResult
from identify.workflow import fit
from twin.logs import AxisLog, Log, write_log
from twin.model.file import save_model
from twin.model.machine import AxisModel, Fitted, Hardware, MachineModel

FRICTION = Fitted.at_start(CATALOGUE["coulomb_viscous"], {"Fc": COULOMB, "sigma2": DAMPING})
OFFSET = Fitted.at_start(CATALOGUE["constant_force"])
MODEL = MachineModel("m", {"x": AxisModel(MASS, Hardware(), (FRICTION, OFFSET))}, 1000.0)
LENGTH = 0.1  # s, of the test functions
HOP = 0.06  # s, of which it rests the last 24 ms


def hopping() -> Log:
    t = np.arange(4000) / 1000.0
    hop, within = np.divmod(t / HOP + 1e-9, 1.0)
    way = np.clip(within / 0.6, 0.0, 1.0)
    x = 4e-3 * np.abs((hop % 2) - way**3 * (10.0 - 15.0 * way + 6.0 * way**2))
    force = MASS * np.gradient(np.gradient(x, t), t)
    return Log(1000.0, {"x": AxisLog({"position": x, "force": force})})


def silent_still() -> Log:
    return drive(change=lambda c: c.update(position=np.zeros_like(c["position"])))


def elsewhere(part: float) -> Log:
    """A run of its own, as its noise tells."""

    def change(columns: dict) -> None:
        noise = np.random.default_rng(round(1e6 * part)).standard_normal((2, len(columns["force"])))
        columns["position"] = columns["position"] + part + 1e-7 * noise[0]
        columns["force"] = columns["force"] + 1e-3 * noise[1]

    return drive(change=change)


MOVING = {"run": drive()}
SILENT = {"hops": hopping(), "still": silent_still()}
REASONS = {
    "hops": "hops is left out: axis x comes to rest within every test function of 0.1 s",
    "still": "still is left out: axis x stands still in it; give one in which it moves",
}


@pytest.fixture(scope="module")
def without() -> FitResult:
    return fit(MODEL, MOVING, test_function=LENGTH)


@pytest.mark.parametrize(
    ("name", "role"), [("hops", "logs"), ("still", "logs"), ("hops", "holdout"), ("still", "test")]
)
def test_a_fit_is_as_without_it_and_says_so(caplog, without, name: str, role: str) -> None:
    given: dict[str, dict[str, Log]] = {"logs": MOVING, "holdout": {}, "test": {}}
    given[role] = {**given[role], name: SILENT[name]}
    with caplog.at_level(logging.WARNING, "identify"):
        found = fit(MODEL, *given.values(), test_function=LENGTH)
    (line,) = (record.getMessage() for record in caplog.records)
    assert line.startswith(REASONS[name])
    assert "; give " in line
    assert "\n" not in line
    assert list(found.left_out["x"]) == [name]
    assert found.fits["x"].error == pytest.approx(without.fits["x"].error)
    assert (found.holdout_error, found.test_error) == ({"x": None}, {"x": None})


def test_one_that_shares_no_travel_is_told_beside_one_that_does(caplog):
    held = {"near": drive(seconds=3.0), "far": elsewhere(1.0)}
    with caplog.at_level(logging.WARNING, "identify"):
        found = fit(MODEL, {"run": elsewhere(1e-4)}, held, test_function=LENGTH)
    (line,) = (record.getMessage() for record in caplog.records)
    assert line.startswith("far is left out: axis x is nowhere where a training log has been")
    error = found.holdout_error["x"]
    assert error is not None
    assert np.isfinite(error)


COMMANDS = (
    ("compare", "m.toml", "run.mcap", "hops.mcap"),
    ("add", "quadratic_drag", "m.toml", "run.mcap", "--test", "hops.mcap", "-o", "o.toml"),
    ("diagnose", "m.toml", "run.mcap", "--holdout", "hops.mcap", "--test", "still.mcap"),
)


def test_each_command_says_it_on_standard_error_and_in_json(tmp_path: Path):
    save_model(MODEL, tmp_path / "m.toml")
    for name, log in {**MOVING, **SILENT}.items():
        write_log(log, tmp_path / f"{name}.mcap")
    for command in COMMANDS:
        done = twin(*command, "--test-function", "0.1", "--json", folder=tmp_path)
        told = json.loads(done.stdout)
        silent = {n for n in command if n in ("hops.mcap", "still.mcap")}
        assert {line.split(" is left out: ")[0] for line in told["left_out"]} == silent
        for line in told["left_out"]:
            assert f"twin: {line}\n" in done.stderr
        assert "NaN" not in done.stdout


SILENT_RATE, SECONDS = 1000.0, 6.0
SPRUNG = axis_of(fitted("cable_slab", k1=1.0))


def step_beyond(x):
    """A force (N) where the logs to fit do not go: x > 40 mm."""
    return np.where(x > 0.04, 0.5, 0.0)


def log(centre: float, phase: float, force=step_beyond):
    """Two waves of 30 mm in all about a centre (m), under a mass, friction and a force of place."""
    t = np.arange(round(SECONDS * SILENT_RATE)) / SILENT_RATE
    wave = waves((0.02, 0.5, phase), (0.01, 1.3, 2.0 * phase))
    x, h = centre + wave(t), 1e-5
    v = (wave(t + h) - wave(t - h)) / (2.0 * h)
    a = (wave(t + h) - 2.0 * wave(t) + wave(t - h)) / h**2
    noise = 1e-3 * np.random.default_rng(round(1e3 * phase)).standard_normal(len(t))
    return log_of(SILENT_RATE, x, 5.3 * a + 0.31 * np.sign(v) + 0.53 * v + force(x) + noise)


MODEL_OF_PLACE = MachineModel("m", {"x": SPRUNG})


def dataset_of(*centres: float) -> Dataset:
    fit = {"one": log(0.0, 0.3), "two": log(0.0, 1.1)}
    held = {f"held {i}": log(c, 2.0 + i) for i, c in enumerate(centres)}
    return datasets(MODEL_OF_PLACE, fit, held, test_function=0.05)["x"]


def test_what_lies_beyond_the_fit_logs_tests_nothing() -> None:
    inside, beyond = dataset_of(0.0), dataset_of(0.02)
    assert inside.beyond == {}
    errors = [
        rms(error_on(fit_axis(SPRUNG, d.training).axis, d.selection)) for d in (inside, beyond)
    ]
    assert errors[1] == pytest.approx(errors[0], rel=0.5)  # the step of 0.5 N is not met
    (part,) = beyond.beyond.values()
    (held,) = beyond.selection
    assert part == pytest.approx(1.0 - np.mean(moving([held], sticks=False)))
    position = held.test_function.mean(held.motion.position)
    assert position[~held.reached].min() > 0.03
    assert 0.2 < part < 0.6
    (told,) = [text for text in prepared_in_words(beyond) if "selection log" in text]
    assert told.startswith(f"held 0: {100 * part:.0f} % of this selection log is left out: it lies")
    tested = replace(beyond, selection=(), test=beyond.selection)
    (told,) = [text for text in prepared_in_words(tested) if "no training log has been" in text]
    assert "of this test log is left out" in told
    assert realigned(beyond, 1e-4).beyond == pytest.approx(beyond.beyond, abs=0.02)


def test_without_a_training_log_less_is_tested_too() -> None:
    """What the log left out had reached alone, nobody predicts without it."""
    far = {"near": log(0.0, 0.3), "far": log(0.02, 1.1)}
    every = datasets(MODEL_OF_PLACE, far, {"held": log(0.02, 2.0)}, test_function=0.05)["x"]
    assert every.beyond == {}
    assert 0.2 < every.without("far").beyond["held"] < 0.6
    assert every.without("near").beyond == {}


def test_held_out_logs_that_share_little_test_all_the_same() -> None:
    assert dataset_of(0.2).beyond == {}
    assert set(dataset_of(0.2, 0.0).beyond) == {"held 0"}  # together they share half
