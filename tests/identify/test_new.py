"""A first model has what a log shows of the machine."""

from __future__ import annotations

import numpy as np
import pytest
from cli_runs import twin

from identify.measure import first_model
from twin.effects import load_catalogue
from twin.errors import InputError
from twin.log import ROTARY_UNITS, AxisLog, Log
from twin.model.file import load_model

CATALOGUE = load_catalogue()
MASS, COULOMB, VISCOUS = 3.0, 2.0, 5.0
T = np.arange(12_000) / 1000.0


def drive(units=None, rate: float = 1000.0) -> Log:
    """A mass with Coulomb and viscous friction on two frequencies, seen by a fine encoder."""
    t = np.concatenate([T, T[-1:] + 1e-3])
    position = 0.05 * np.sin(5.0 * t) + 0.02 * np.sin(13.0 * t + 1.0)
    middle = T + 0.5e-3
    velocity = 0.25 * np.cos(5.0 * middle) + 0.26 * np.cos(13.0 * middle + 1.0)
    force = -MASS * (1.25 * np.sin(5.0 * middle) + 3.38 * np.sin(13.0 * middle + 1.0))
    force += COULOMB * np.sign(velocity) + VISCOUS * velocity
    noise = 1e-8 * np.random.default_rng(2).standard_normal(len(T))
    columns = {"position": position[:-1] + noise, "force": force}
    return Log(rate, {"a": AxisLog(columns, units) if units else AxisLog(columns)})


@pytest.mark.parametrize("units", [None, ROTARY_UNITS])
def test_it_has_the_mass_and_what_was_reached(units):
    model = first_model({"l": drive(units)}, "m", CATALOGUE)
    axis = model.axes["a"]
    assert axis.rotary is (units is not None)
    assert axis.mass == pytest.approx(MASS, rel=0.05)
    low, high = axis.hardware.travel
    assert low < -0.069 < 0.069 < high
    assert axis.hardware.velocity == pytest.approx(0.5, rel=0.05)
    assert axis.hardware.encoder_noise == pytest.approx(1e-8, rel=0.2)
    assert [f.effect.kind.name for f in axis.effects] == ["FRICTION"]


def test_logs_that_give_none_are_refused():
    still = Log(1000.0, {"a": AxisLog({"position": 0.0 * T, "force": 0.0 * T})})
    with pytest.raises(InputError, match="no axis moves in l"):
        first_model({"l": still}, "m", CATALOGUE)
    with pytest.raises(InputError, match="sampled at 500, 1000 Hz"):
        first_model({"l": drive(), "m": drive(rate=500.0)}, "m", CATALOGUE)


def test_the_commands_of_a_new_machine(tmp_path):
    """From a table to a model to begin with: guess, import, new."""
    log = drive().axes["a"].columns
    rows = np.column_stack([T, 1e3 * log["position"], log["force"]])
    table = tmp_path / "run.csv"
    np.savetxt(
        table, rows, fmt="%.17g", delimiter=",", header="time,pos [mm],force [N]", comments=""
    )
    for command in (
        ("import", "--guess", "run.csv", "-o", "map.toml"),
        ("import", "run.csv", "--map", "map.toml", "-o", "run.mcap"),
        ("new", "run.mcap", "-o", "model.toml"),
    ):
        done = twin(*command, folder=tmp_path)
        assert done.returncode == 0, done.stderr
    axis = load_model(str(tmp_path / "model.toml"), CATALOGUE).axes["x"]
    assert axis.mass == pytest.approx(MASS, rel=0.05)
    for wrong in (("import", "run.csv"), ("import", "--guess", "run.csv", "run.csv")):
        assert twin(*wrong, folder=tmp_path).returncode == 2
