"""Experiment files, setpoints as CSV, and what the commands refuse of them."""

import re
from dataclasses import fields

import numpy as np
import pytest
from cli_runs import twin
from import_cases import csv_columns

from identify.cli.shared import app
from twin.effects import load_catalogue
from twin.errors import InputError
from twin.experiments.file import format_experiment, load_experiment, parameters, save_experiment
from twin.experiments.kinds import Moves, OpenLoopSine, Passes, Rests, Steps, Sweep
from twin.export.setpoints import write_setpoints
from twin.logs import read_log
from twin.model.file import load_model
from twin.simulation.simulate import simulate
from twin.simulation.simulators import ReducedSimulator

CATALOGUE = load_catalogue()
PROTON = load_model("proton_xy", CATALOGUE)

EXPERIMENTS = (
    Passes("x", span=0.1, speed=0.05, repeats=2, at=(0.01, -0.02), other=0.1),
    Rests("y", span=1e-3, speed=1e-3, rests=(0.1, 2.0)),
    Steps("x", span=0.1, step=0.02, efforts=(1.0, 0.2)),
    Sweep("x", 0.1, 0.02, 1, amplitude=0.5, lowest=2.0, highest=60.0, effort=0.5),
)


@pytest.mark.parametrize("experiment", EXPERIMENTS, ids=lambda e: type(e).__name__)
def test_an_experiment_file_says_the_same_when_it_is_read_again(experiment, tmp_path):
    save_experiment(experiment, tmp_path / "e.toml", "why")
    assert load_experiment(tmp_path / "e.toml") == experiment
    assert [f.name for f in tmp_path.iterdir()] == ["e.toml"]
    assert (tmp_path / "e.toml").read_text().splitlines()[0] == "# why"
    text = format_experiment(experiment, "one", "two")
    assert text.startswith("# one\n# two\n")
    lines = {line.split(" = ")[0]: line for line in text.splitlines()}
    assert set(parameters(experiment)) == set(lines) & {f.name for f in fields(experiment)}
    for f in fields(experiment):
        if f.name in lines and f.metadata.get("unit"):
            assert f" # {f.metadata['unit']}, {f.metadata['meaning']}" in lines[f.name]


PASSES = '[experiment]\nkind = "passes"\naxis = "x"\nspan = 0.1\nspeed = 0.05\nrepeats = 1\n'
FAULTS = {
    "unknown kind": (PASSES.replace("passes", "pases"), "'passes'"),
    "unknown entry": (PASSES.replace("speed", "sped"), "'speed'"),
    "missing entry": (PASSES.replace("speed = 0.05", ""), "m/s"),
    "beyond the speed": (PASSES.replace("0.05", "0.5"), "0.25 m/s"),
    "beyond the travel": (PASSES.replace("0.1", "0.5"), "0.17 m"),
    "unknown axis": (PASSES.replace('"x"', '"z"'), "x, y"),
    "no table": ("kind = 1\n", "[experiment]"),
    "no TOML": ("kind = = 1\n", "TOML"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_bad_experiment_file_is_refused_in_one_line(fault, tmp_path):
    text, said = FAULTS[fault]
    (tmp_path / "e.toml").write_text(text)
    with pytest.raises(InputError) as refused:
        simulate(PROTON, load_experiment(tmp_path / "e.toml"), simulator=ReducedSimulator)
    assert said in str(refused.value)
    assert "\n" not in str(refused.value) or "TOML" in said


def test_the_command_runs_an_experiment_file_and_keeps_it_in_the_log(tmp_path):
    save_experiment(EXPERIMENTS[1], tmp_path / "next.toml")
    done = twin("simulate", "next.toml", "--model", "proton_xy", "-o", "l.mcap", folder=tmp_path)
    assert done.returncode == 0, done.stderr
    kept = read_log(tmp_path / "l.mcap").attachments["experiment.toml"]
    assert kept == (tmp_path / "next.toml").read_bytes()


BAD_INPUT = (
    (("plan", "proton_xy", "--between", "coging", "lugre"), "'cogging'"),
    (("plan", "proton_xy", "--between", "cogging", "cogging"), "different"),
    (("plan", "proton_xy", "--axis", "z"), "x, y"),
    (("plan", "proton_xy", "--duration", "-1"), "0 s"),
    (("plan", "proton_xy", "--duration", "1e9"), "allowed are 1 to 36000000"),
    (("simulate", "moves", "--duration", "nan"), "above 0 s"),
    (("simulate", "velocity_map", "--duration", "0"), "above 0 s"),
    (("simulate", "cable_pass", "--duration", "inf"), "above 0 s"),
    (("simulate", "moves", "--duration", "1e9"), "allowed are 1 to 36000000"),
    (("simulate", "moves", "--seed", "-1"), "seed -1: is not allowed; give a whole number of 0 or"),
    (("demo", "--seed", "-1", "-o", "d"), "seed -1: is not allowed"),
    (("plan", "proton_xy", "--test-function", "nan"), "a test function of nan s: give a length"),
    (("plan", "proton_xy", "-o", "next.mcap"), ".toml"),
    (("plan", "proton_xy", "-o", "no/where.toml"), "no/where.toml"),
    (("simulate", "nowhere.toml"), "twin plan"),
    (("simulate", "next.toml", "--duration", "3"), "duration"),
)


@pytest.mark.parametrize(("arguments", "said"), BAD_INPUT)
def test_bad_input_of_the_commands_is_refused(arguments, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    save_experiment(EXPERIMENTS[0], "next.toml")
    with pytest.raises(InputError) as refused:
        app(list(arguments), standalone_mode=False)
    assert said in str(refused.value)
    assert [f.name for f in tmp_path.iterdir()] == ["next.toml"], "something was written"


@pytest.mark.parametrize(
    ("experiment", "seed"), [(Moves(40, duration=1.0), 3), (Passes("y", 0.02, 0.05, 1), 0)]
)
def test_the_table_is_the_setpoint_of_the_simulation_of_that_seed(experiment, seed, tmp_path):
    write_setpoints(experiment, PROTON, seed, tmp_path / "s.csv")
    log = simulate(PROTON, experiment, seed=seed)
    table = csv_columns((tmp_path / "s.csv").read_text())
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


def test_a_trajectory_of_ros_2_has_the_points_of_the_table(tmp_path):
    experiment = Moves(2, duration=1.003)
    for ending in ("csv", "yaml"):
        write_setpoints(experiment, PROTON, 3, tmp_path / f"s.{ending}")
    table, text = csv_columns((tmp_path / "s.csv").read_text()), (tmp_path / "s.yaml").read_text()
    joints, key, *points = text.splitlines()
    assert (joints, key) == ("joint_names: [x, y]", "points:")
    times = re.findall(r"{sec: (\d+), nanosec: (\d+)}", text)
    at = np.array([int(sec) + 1e-9 * int(rest) for sec, rest in times])
    assert len(at) == len(points)
    np.testing.assert_allclose(np.diff(at)[:-1], 0.01)
    assert at[-1] == pytest.approx(table["time [s]"][-1])
    for name, plural in (("position [m]", "positions"), ("acceleration [m/s^2]", "accelerations")):
        values = re.findall(rf"{plural}: \[([-\d.]+), ([-\d.]+)\]", text)
        for axis, own in zip("xy", np.array(values, dtype=float).T, strict=True):
            wanted = np.interp(at, table["time [s]"], table[f"{axis} {name}"])
            np.testing.assert_allclose(own, wanted, atol=1e-8)


def test_structured_text_has_a_point_of_the_table_for_each_cycle(tmp_path):
    for ending in ("csv", "st"):
        write_setpoints(Moves(2, duration=1.003), PROTON, 3, tmp_path / f"s.{ending}")
    table, text = csv_columns((tmp_path / "s.csv").read_text()), (tmp_path / "s.st").read_text()
    arrays = re.findall(r"(\w+) : ARRAY\[0\.\.(\d+)\] OF \w+ := \[ \(\* (.+) \*\)([^\]]+)\];", text)
    found = {f"{name} [{unit}]": np.array(rows.split(","), float) for name, _, unit, rows in arrays}
    last = int(re.search(r"Last : DINT := (\d+);", text)[1])
    assert "Setpoints for a PLC task of 1 ms." in text
    assert {int(end) for _, end, _, _ in arrays} == {last} == {len(v) - 1 for v in found.values()}
    at = np.append(np.arange(last) * 1e-3, table["time [s]"][-1])
    for axis in "xy":
        for name in ("position [m]", "velocity [m/s]", "acceleration [m/s^2]"):
            wanted = np.interp(at, table["time [s]"], table[f"{axis} {name}"])
            np.testing.assert_allclose(found[f"{axis}_{name.capitalize()}"], wanted, atol=1e-8)
        speed = found[f"{axis}_Velocity [m/s]"]
        assert (found[f"{axis}_Direction [1]"] == np.sign(speed)).all()


def test_other_files_of_setpoints_are_refused(tmp_path):
    for ending in ("yaml", "st"):
        with pytest.raises(InputError, match="no place for a force"):
            write_setpoints(OpenLoopSine("x", 3.0), PROTON, 0, tmp_path / f"f.{ending}")
    with pytest.raises(InputError, match=r"written as \.csv, \.yaml \(ROS 2\) or \.st"):
        write_setpoints(Moves(2, duration=1.0), PROTON, 3, tmp_path / "s.xml")


def test_a_force_has_a_column_of_its_own(tmp_path):
    write_setpoints(OpenLoopSine("x", 3.0), PROTON, 0, tmp_path / "s.csv")
    table = csv_columns((tmp_path / "s.csv").read_text())
    assert np.abs(table["x force [N]"]).max() == pytest.approx(0.21)
    assert "y force [N]" not in table


@pytest.mark.slow
def test_a_long_table_is_written_in_parts_without_a_gap(tmp_path):
    write_setpoints(Moves(400, duration=11.0), PROTON, 1, tmp_path / "s.csv")
    time = np.loadtxt(tmp_path / "s.csv", delimiter=",", skiprows=1, usecols=0)
    assert len(time) > 1.05e5  # parts are of 1e5 rows
    np.testing.assert_allclose(np.diff(time), 1e-4, atol=1e-7)


def test_an_experiment_is_simulated_from_its_file(tmp_path):
    path, chosen = tmp_path / "e.toml", Rests("y", span=1e-3, speed=1e-3, rests=(0.1, 0.2))
    save_experiment(chosen, path, "why")
    own = simulate(PROTON, chosen, seed=1, simulator=ReducedSimulator)
    for given in (path, str(path)):
        log = simulate(PROTON, given, seed=1, simulator=ReducedSimulator)
        np.testing.assert_array_equal(log.axes["y"].position, own.axes["y"].position)
