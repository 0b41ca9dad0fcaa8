"""A log that says nothing is left out with one line, in any role; an error where none is left.

In one planted log the axis hops and rests, so that it rests within every test function; in one it
stands still; one is of another part of the track.
"""

from __future__ import annotations

import json
import logging
from pathlib import Path

import numpy as np
import pytest
from check_drive import COULOMB, DAMPING, MASS, drive
from cli_runs import twin

from identify.results.results import FitResult
from identify.workflow import compare, fit
from twin.effects import load_catalogue
from twin.errors import InputError
from twin.logs import AxisLog, Log, write_log
from twin.model.file import save_model
from twin.model.machine import AxisModel, Fitted, Hardware, MachineModel

CATALOGUE = load_catalogue()
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


def still() -> Log:
    return drive(change=lambda c: c.update(position=np.zeros_like(c["position"])))


def elsewhere(part: float) -> Log:
    """The drive, of which a part of the log is beyond the travel of the others."""
    return drive(change=lambda c: c.update(position=c["position"] + part))


MOVING = {"run": drive()}
SILENT = {"hops": hopping(), "still": still()}
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
    assert found.left_out["x"] == (name,)
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


def test_where_no_log_is_left_it_is_an_error_of_one_line():
    for call in (fit, compare):
        with pytest.raises(InputError, match="comes to rest within every test function") as why:
            call(MODEL, {"hops": SILENT["hops"]}, test_function=LENGTH)
        assert "\n" not in str(why.value)


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
