"""Setpoints as CSV: what the twin is asked for is what a machine can be asked for."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import twin
from twin.errors import InputError
from twin.experiments.kinds import Moves, OpenLoopSine, Passes
from twin.experiments.setpoint_csv import write_setpoints

MODEL = twin.load_model("proton_xy")


def read(path: Path) -> dict[str, np.ndarray]:
    head, *rows = path.read_text().splitlines()
    return dict(zip(head.split(","), np.loadtxt(rows, delimiter=",").T, strict=True))


@pytest.mark.parametrize("experiment", [Moves(40, duration=2.0), Passes("y", 0.02, 0.05, 1)])
@pytest.mark.parametrize("seed", [0, 3])
def test_the_table_is_the_setpoint_of_the_simulation_of_that_seed(experiment, seed, tmp_path):
    write_setpoints(experiment, MODEL, seed, tmp_path / "s.csv")
    log = twin.simulate(MODEL, experiment, seed=seed)
    table = read(tmp_path / "s.csv")
    assert list(table) == ["time [s]"] + [
        f"{axis} {name}"
        for axis in ("x", "y")
        for name in ("position [m]", "velocity [m/s]", "acceleration [m/s^2]")
    ]
    n = len(log)
    np.testing.assert_allclose(table["time [s]"][:n], log.time, atol=1e-9)
    for axis, own in log.axes.items():
        for name, unit in (("position", "m"), ("velocity", "m/s"), ("acceleration", "m/s^2")):
            wanted = own.columns[f"setpoint_{name}"]
            np.testing.assert_allclose(table[f"{axis} {name} [{unit}]"][:n], wanted, atol=1e-8)


def test_a_force_has_a_column_of_its_own(tmp_path):
    write_setpoints(OpenLoopSine("x", 3.0), MODEL, 0, tmp_path / "s.csv")
    table = read(tmp_path / "s.csv")
    assert np.abs(table["x force [N]"]).max() == pytest.approx(0.21)
    assert "y force [N]" not in table


def test_a_long_table_is_written_in_parts_without_a_gap(tmp_path):
    write_setpoints(Moves(400, duration=25.0), MODEL, 1, tmp_path / "s.csv")
    time = read(tmp_path / "s.csv")["time [s]"]
    assert len(time) > 2.4e5
    np.testing.assert_allclose(np.diff(time), 1e-4, atol=1e-7)


def test_a_folder_that_is_not_there_is_one_line(tmp_path):
    with pytest.raises(InputError, match="its folder does not exist"):
        write_setpoints(Moves(2), MODEL, 0, tmp_path / "none" / "s.csv")
