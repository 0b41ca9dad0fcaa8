"""Tables hold what they say they hold, and what they lose is told in N."""

import json
import re
from dataclasses import replace
from itertools import combinations
from xml.etree import ElementTree

import numpy as np
import pytest
from axis_runs import effect as fitted
from cli_runs import refusal, twin
from import_cases import csv_columns
from strict_json import valid

from identify.testing import assert_exported
from twin.errors import InputError
from twin.export import Held, find_exporter
from twin.export.formats import csv
from twin.export.tables import (
    ENTRIES,
    AxisTables,
    Periodic,
    TableFormat,
    fewest_points,
    motions,
    tables,
)
from twin.feedforward import feedforward
from twin.logs import AxisLog, Log, write_log
from twin.model.file import save_model
from twin.model.machine import AxisModel, Fitted, Hardware, MachineModel

HARDWARE = Hardware(
    travel=(-0.1, 0.1), force_constant=20.0, velocity=0.2, acceleration=2.0, jerk=50.0
)


PLAIN = (
    fitted("coulomb_viscous", Fc=0.5, Fs=0.5, sigma2=2.0),
    fitted("constant_force", F0=0.2),
    fitted("cable_slab", k1=1.5, k2=-4.0),
    fitted("cogging", p=0.024, a1=0.3, b2=0.1),
    fitted("payload_mass", ratio=0.1),
)
UNEVEN = (
    fitted("asymmetric_friction", coulomb=0.2),
    fitted("position_dependent_friction", start=-0.1, length=0.2, c2=0.2),
)


def slide(*effects: Fitted) -> MachineModel:
    return MachineModel("slide", {"x": AxisModel(3.0, HARDWARE, effects)}, 1000.0)


@pytest.mark.parametrize("size", [0.02, 30.0])
def test_harmonics_are_those_of_a_hundredth_of_the_largest(size: float) -> None:
    """A mean, and cosine less i sine of each; the least two are just above it and just below."""
    turn = 2.0 * np.pi * np.arange(ENTRIES) / ENTRIES
    force = 0.5 + np.sin(turn) - 0.3 * np.cos(3.0 * turn)
    force += 0.0103 * np.sin(7.0 * turn) + 0.0097 * np.cos(9.0 * turn)
    found = Periodic("cogging", 0.024, size * force).harmonics()
    assert list(found) == [0, 1, 3, 7]
    wanted = size * np.array([0.5, -1j, -0.3, -0.0103j])
    np.testing.assert_allclose(list(found.values()), wanted, atol=1e-12 * size)


def test_the_sum_of_the_tables_is_the_force_of_the_model() -> None:
    model = slide(*PLAIN)
    made = find_exporter("csv").export(model, {})
    assert set(made.kept["x"]) == {"mass", *model.axes["x"].names}
    assert not made.approximated
    assert not made.lost
    (motion,) = motions(model, {})
    x, v, a = own = motion.setpoints["x"]
    files = {name: csv_columns(text) for name, text in made.files.items()}
    (mass,) = files["x_mass.csv"]["mass (kg)"]
    assert mass == pytest.approx(3.3)
    place, along = files["x_position.csv"].values()
    speed, forwards, backwards = files["x_speed.csv"].values()
    phase, force = files["x_cogging.csv"].values()
    assert len(force) == 256
    found = mass * a + np.interp(x, place, along) + np.interp(x, phase, force, period=0.024)
    found += np.where(v > 0, np.interp(v, speed, forwards), 0.0)
    found += np.where(v < 0, np.interp(-v, speed, backwards), 0.0)
    wanted = feedforward(model.axes["x"], own, np.zeros_like(own), motion.period)
    assert np.abs(found - wanted)[v != 0.0].max() < 2e-3 * np.abs(wanted).max()
    terms = csv_columns(made.files["x_cogging_harmonics.csv"])
    waves = 2.0 * np.pi * np.outer(phase, 1.0 / terms["period (m)"])
    again = np.sin(waves) @ terms["sine (N)"] + np.cos(waves) @ terms["cosine (N)"]
    np.testing.assert_allclose(again, force, atol=1e-8)


def test_twincat_has_twenty_points_and_says_in_newtons_what_it_has_no_place_for() -> None:
    made = find_exporter("twincat").export(slide(*PLAIN, *UNEVEN), {})
    text = made.files["x_friction.lis"]
    assert isinstance(text, str)
    entries = dict(line.split() for line in text.splitlines() if line[0] != "#")
    count = int(entries["frict_comp.table_entries"])
    speeds = [int(entries[f"frict_comp.table[{i}].in"]) for i in range(count)]
    assert count <= 20
    assert speeds[0] == 0
    assert speeds == sorted(set(speeds))
    # 0.5 N + 2 N s/m 0.1 m/s over 20 N/A, mean over the travel
    out = [float(entries[f"frict_comp.table[{i}].out"]) for i in range(count)]
    assert np.interp(0.1e6, speeds, out) == pytest.approx(35.0, rel=0.02)
    lost = {r.part: r.text for r in made.lost}
    beyond = {"mass", "payload_mass", "cable_slab", "constant_force"}
    assert beyond | {f.effect.name for f in UNEVEN} == set(lost)
    assert lost["constant_force"] == "0.2 of its 0.2 N RMS are lost on simulated moves"
    uneven = lost["asymmetric_friction"].split(" of its ")
    assert float(uneven[0]) == pytest.approx(0.2 * 0.5, rel=0.1)
    assert uneven[1].startswith(f"{uneven[0]} N RMS")
    assert made.kept["x"] == ("cogging",)
    # what the other two make of the friction is lost of it, too
    assert "coulomb_viscous" in {r.part for r in made.approximated}
    assert len(csv_columns(made.files["x_cogging.csv"])["current (A)"]) == 256
    assert csv_columns(made.files["x_cogging.csv"])["current (A)"][0] == pytest.approx(-0.1 / 20.0)


def test_the_points_that_lose_least_are_found() -> None:
    rng = np.random.default_rng(3)
    speeds, force = np.sort(rng.random(11)), rng.random(11)
    found, left = fewest_points(speeds, force, 5)

    def loss(inner: tuple[int, ...]) -> float:
        at = [0, *inner, 10]
        return float(np.abs(np.interp(speeds, speeds[at], force[at]) - force).max())

    losses = {inner: loss(inner) for inner in combinations(range(1, 10), 3)}
    assert left == pytest.approx(min(losses.values()))
    assert losses[tuple(found[1:-1])] == pytest.approx(left)


def test_losses_are_told_on_the_logs_that_are_given(tmp_path) -> None:
    save_model(slide(*PLAIN, *UNEVEN), tmp_path / "m.toml")
    t = 1e-3 * np.arange(4000)
    columns = {"position": t, "force": t, "setpoint_position": 0.05 * np.sin(6.0 * t)}
    write_log(Log(1000.0, {"x": AxisLog(columns)}), tmp_path / "run.mcap")
    arguments = ("export", "m.toml", "run.mcap", "--to", "twincat", "-o", "plc")
    done = twin(*arguments, "--json", folder=tmp_path)
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert {r["part"] for r in told["lost"]} >= {"asymmetric_friction", "cable_slab"}
    assert all(r["text"].endswith("on run.mcap") for r in told["lost"])
    assert (tmp_path / "plc" / "x_friction.lis").exists()
    columns.pop("setpoint_position")
    write_log(Log(1000.0, {"x": AxisLog(columns)}), tmp_path / "bare.mcap")
    line = refusal("export", "m.toml", "bare.mcap", "--to", "csv", folder=tmp_path)
    assert "setpoint_position" in line


@pytest.mark.parametrize("name", ["c", "csv", "twincat", "ros2_control", "fmu"])
def test_axes_that_would_have_one_name_are_refused(name) -> None:
    axis = AxisModel(3.0, HARDWARE)
    model = MachineModel("two", {"x": axis, "X": axis}, 1000.0)
    with pytest.raises(InputError, match="another name"):
        find_exporter(name).export(model, {})


def test_a_rotary_axis_has_its_own_units() -> None:
    axis = AxisModel(0.01, HARDWARE, (fitted("coulomb_viscous", Fc=0.5, Fs=0.5),), rotary=True)
    model = MachineModel("table", {"c": axis}, 1000.0)
    files = find_exporter("csv").export(model, {}).files
    assert "speed (rad/s),torque (N m) forwards" in str(files["c_speed.csv"])
    text = str(find_exporter("twincat").export(model, {}).files["c_friction.lis"])
    assert "0.001 degrees/s" in text
    assert "torque over 20 N m/A" in text
    highest = tables(axis, (-0.1, 0.1), 0.2).speeds[-1]
    assert f"].in            {round(1e3 * np.degrees(highest))}" in text


def test_ros2_control_has_the_limits_and_a_straight_friction() -> None:
    made = find_exporter("ros2_control").export(slide(*PLAIN, *UNEVEN), {})
    root = ElementTree.fromstring(str(made.files["slide_joints.urdf"]))
    (joint,) = root.findall("joint")
    assert joint.attrib == {"name": "x", "type": "prismatic"}
    dynamics = {k: float(v) for k, v in joint.find("dynamics").attrib.items()}
    assert dynamics == pytest.approx({"friction": 0.5, "damping": 2.0}, rel=0.02)
    assert float(joint.find("limit").attrib["upper"]) == 0.1
    limits = [line.strip() for line in str(made.files["slide_joint_limits.yaml"]).splitlines()]
    for line in ("joint_limits:", "x:", "max_position: 0.1", "max_velocity: 0.2", "max_jerk: 50.0",
                 "has_effort_limits: false"):  # fmt: skip
        assert line in limits
    assert {"mass", "cogging", "cable_slab"} <= {r.part for r in made.lost}


@pytest.mark.parametrize("left_out", ["mass", "position", "cogging"])
def test_what_a_file_lacks_is_not_told_to_be_kept(left_out: str) -> None:
    """What is kept is judged on the files, which are read back, not on what was to be in them."""

    def write(name: str, axis: AxisModel, of: AxisTables, said: Held) -> dict[str, str]:
        files = csv.write(name, axis, of, said)
        file = f"{name}_{left_out}.csv"
        if file in files:
            head, *rows = files[file].splitlines()
            empty = [",".join([*row.split(",")[:-1], "0"]) for row in rows]
            files[file] = "\n".join([head, *empty])
        return files

    made = TableFormat(write, csv.read).exported(slide(*PLAIN), {})
    parts = {"mass": {"mass", "payload_mass"}, "cogging": {"cogging"}}
    assert {r.part for r in made.lost} == parts.get(left_out, {"constant_force", "cable_slab"})


@pytest.mark.short(2)
@pytest.mark.parametrize("to", ["twincat", "csv", "c", "ros2_control"])
def test_an_export_is_told_to_be_that_of_the_model_or_of_one_before(tmp_path, to) -> None:
    model = MachineModel("drive", {"x": AxisModel(2.0, HARDWARE, PLAIN)}, 1000.0)
    save_model(model, tmp_path / "m.toml")
    assert twin("export", "m.toml", "--to", to, "-o", "out", folder=tmp_path).returncode == 0
    same = twin("agree", "m.toml", "out", folder=tmp_path)
    assert (same.returncode, same.stdout) == (0, f"out: {to} of m.toml, as the model gives it\n")
    assert_exported(tmp_path / "m.toml", tmp_path / "out")
    changed = (fitted("coulomb_viscous", Fc=0.55, Fs=0.55, sigma2=2.0), *PLAIN[1:])
    save_model(model.with_axis("x", replace(model.axes["x"], effects=changed)), tmp_path / "n.toml")
    other = twin("agree", "n.toml", "out", "--json", folder=tmp_path)
    found = valid(json.loads(other.stdout))
    assert (other.returncode, found["agrees"], found["formats"]) == (1, False, [to])
    first = found["outdated"][0]
    lines = (tmp_path / first["file"]).read_text().splitlines()
    assert lines[first["line"] - 1].strip() == first["has"] != first["gives"]
    with pytest.raises(AssertionError, match=re.escape(f"line {first['line']}: has")):
        assert_exported(tmp_path / "n.toml", tmp_path / "out")
    (tmp_path / "empty").mkdir()
    assert "holds no export of drive" in refusal("agree", "m.toml", "empty", folder=tmp_path)
