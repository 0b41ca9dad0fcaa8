"""A first model has what a log shows of the machine."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from cli_runs import refusal, twin
from planted_logs import SLIDE, Ride, logged
from scipy.signal import butter, cont2discrete, lfilter

from identify import workflow
from identify.analysis.first_model import first_model, not_determined
from identify.workflow import fit
from twin.checks import Fault, check_log
from twin.effects import load_catalogue
from twin.errors import InputError
from twin.importers import import_log, load_mapping
from twin.logs import ROTARY_UNITS, AxisLog, Log, write_log
from twin.logs.log import LINEAR_UNITS
from twin.model.file import load_model, save_model
from twin.model.machine import AxisModel

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
    (friction,) = axis.effects  # whose static level no log tells
    assert friction.values["Fs"] == friction.values["Fc"] == pytest.approx(COULOMB, rel=0.05)
    assert friction.values["sigma2"] == pytest.approx(VISCOUS, rel=0.05)
    assert not_determined(axis) == [f"{friction.effect.name}.Fs"]


def hopping(static: float, offset: float, seed: int = 4) -> Log:
    """Moves of 0.4 s each way and rests of 0.2 s, from which the force builds up to break away."""
    rng, rate = np.random.default_rng(seed), 1000.0
    hop, rest = np.arange(400) / 400.0, np.zeros(200)
    position, force, at = [], [], 0.0
    for k in range(24):
        way = rng.uniform(0.01, 0.04) * (-1.0) ** k
        v = way * 2.5 * (1.0 - np.cos(2.0 * np.pi * hop))
        a = way * 2.5 * 2.5 * 2.0 * np.pi * np.sin(2.0 * np.pi * hop)
        position += [at + rest, at + (np.cumsum(v) - v) / rate]
        built_up = np.linspace(0.0, static, 200) * np.sign(way)
        force += [built_up, MASS * a + COULOMB * np.sign(v) + VISCOUS * v]
        at += float(v.sum()) / rate
    columns = {"position": np.concatenate(position), "force": np.concatenate(force) + offset}
    columns["position"] += 1e-9 * rng.standard_normal(len(columns["position"]))
    columns["force"] += 1e-3 * rng.standard_normal(len(columns["force"]))
    return Log(rate, {"a": AxisLog(columns)})


def first_axis(log: Log) -> AxisModel:
    return first_model({"l": log}, "m", CATALOGUE).axes["a"]


def values_of(axis: AxisModel) -> dict[str, float]:
    own = {k: v for f in axis.effects for k, v in f.values.items()}
    return {"mass": axis.mass, **own}


@pytest.mark.parametrize(("static", "offset"), [(COULOMB, -0.7), (1.6 * COULOMB, 0.0)])
def test_the_values_are_those_that_the_log_tells(static, offset):
    """The offset is one of the command, which the constant force makes necessary."""
    axis = first_axis(hopping(static, offset))
    found = values_of(axis)
    assert bool(not_determined(axis)) is (static == COULOMB)
    truth = {"mass": MASS, "Fc": COULOMB, "Fs": static, "sigma2": VISCOUS}
    if offset:
        truth["F0"] = -offset
    assert found == pytest.approx(truth, rel=0.06)


def test_a_spring_does_not_hide_the_mass_and_a_turning_axis_has_gravity():
    """Forces of the place of many times the inertia's, which neither model has."""
    log = drive()
    x = log.axes["a"].columns["position"]
    log.axes["a"].columns["force"] += 900.0 * x
    assert values_of(first_axis(log))["mass"] == pytest.approx(MASS, rel=0.05)
    turning = drive(ROTARY_UNITS)
    q = 20.0 * turning.axes["a"].columns["position"]  # rad, of 20 times the inertia
    columns = {"position": q, "force": 20.0 * turning.axes["a"].columns["force"]}
    columns["force"] = columns["force"] + 300.0 * np.sin(q)
    model = first_model({"l": Log(1000.0, {"a": AxisLog(columns, ROTARY_UNITS)})}, "m", CATALOGUE)
    assert model.axes["a"].mass == pytest.approx(MASS, rel=0.05)


def test_a_force_that_one_way_alone_shows_is_friction_and_no_constant():
    log = drive()
    middle = T + 0.5e-3
    velocity = 0.25 * np.cos(5.0 * middle) + 0.26 * np.cos(13.0 * middle + 1.0)
    columns = log.axes["a"].columns
    columns["position"] += 0.6 * T
    columns["force"] += COULOMB * (1.0 - np.sign(velocity)) + VISCOUS * 0.6
    found = values_of(first_axis(log))
    assert "F0" not in found
    assert found["Fc"] == pytest.approx(COULOMB, rel=0.05)


def slow(units=LINEAR_UNITS) -> Log:
    """A motion of which the inertia makes next to nothing of the force."""
    t = np.arange(15_000) / 1000.0
    v = 0.025 * np.cos(0.5 * t) + 0.007 * np.cos(0.35 * t + 1.0)
    x = np.cumsum(v) / 1000.0 + 1e-8 * np.random.default_rng(1).standard_normal(len(t))
    columns = {"position": x, "force": 1.5 * np.sign(v) + 40.0 * v}
    return Log(1000.0, {"a": AxisLog(columns, units)})


@pytest.mark.short(1)
@pytest.mark.parametrize(("units", "name"), [(LINEAR_UNITS, "mass"), (ROTARY_UNITS, "inertia")])
def test_a_mass_that_the_logs_do_not_tell_is_given_and_held(tmp_path, units, name):
    write_log(slow(units), tmp_path / "run.mcap")
    told = refusal("new", "run.mcap", "-o", "m.toml", folder=tmp_path)
    unit = "kg m^2" if name == "inertia" else "kg"
    assert f"or the {name} itself, in {unit}, which is then held" in told
    for given in ("3.25", "a=3.25"):
        done = twin("new", "run.mcap", "-o", "m.toml", "--mass", given, folder=tmp_path)
        assert done.returncode == 0, done.stderr
        axis = load_model(tmp_path / "m.toml").axes["a"]
        assert (axis.mass, axis.mass_fixed, axis.rotary) == (3.25, True, name == "inertia")
        assert axis.friction.values["Fc"] == pytest.approx(1.5, rel=0.01)
        assert axis.friction.values["sigma2"] == pytest.approx(40.0, rel=0.01)
    assert workflow.first_model([slow(units)], mass=3.25).axes["a"] == axis
    assert fit(load_model(tmp_path / "m.toml"), slow(units)).model.axes["a"].mass == 3.25


def test_the_rest_is_found_beside_a_given_mass_and_a_coasting_axis_shows_it():
    """A mass that is not the machine's leaves its friction as it is, in a motion both ways."""
    found = first_model({"l": drive()}, "m", CATALOGUE, mass={"a": 2.0}).axes["a"]
    assert (found.mass, found.mass_fixed) == (2.0, True)
    assert found.friction.values["Fc"] == pytest.approx(COULOMB, rel=0.1)
    coasts = {"l": Log(1000.0, {"a": AxisLog(
        {"position": np.cumsum(np.maximum(1.0 - 0.5 * T, 0.0)) / 1000.0, "force": 0.0 * T}
    )})}  # fmt: skip
    with pytest.raises(InputError, match="the force of axis a is 0 N throughout"):
        first_model(coasts, "m", CATALOGUE)
    braked = first_model(coasts, "m", CATALOGUE, mass=3.0).axes["a"]
    assert braked.friction.values["Fc"] == pytest.approx(1.5, rel=0.05)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (["-2"], r"axis a: mass = -2 kg: give a number from 1e-15 to 1e\+15, in kg, or 0"),
        (["b=2"], "a mass of axis b: the logs have a; name one of them"),
        (["heavy"], "--mass heavy: give a number in kg"),
        (["a=2", "--mjcf", "arm.xml"], "arm.xml have their mass there; give none beside them"),
    ],
)
def test_a_mass_that_no_axis_can_have_is_one_line(tmp_path, given, said):
    write_log(slow(), tmp_path / "run.mcap")
    (tmp_path / "arm.xml").write_text(
        '<mujoco><worldbody><body><joint name="a" type="slide" axis="1 0 0"/>'
        '<geom size="0.1" mass="2"/></body></worldbody></mujoco>'
    )
    told = refusal("new", "run.mcap", "-o", "m.toml", "--mass", *given, folder=tmp_path)
    assert re.search(said, told), told


def test_of_several_axes_a_mass_is_given_by_name():
    both = {"l": replace(slow(), axes={"a": slow().axes["a"], "b": slow().axes["a"]})}
    with pytest.raises(InputError, match="a mass of 3: a, b move; give it by axis, as in a=3"):
        first_model(both, "m", CATALOGUE, mass=3.0)
    found = first_model(both, "m", CATALOGUE, mass={"a": 3.0, "b": 4.0})
    assert [axis.mass for axis in found.axes.values()] == [3.0, 4.0]


def shifted(by: float = 0.0, times: float = 1.0, force: float = 1.0, units=LINEAR_UNITS) -> Log:
    own = drive().axes["a"].columns
    columns = {"position": by + times * own["position"], "force": force * own["force"]}
    return Log(1000.0, {"a": AxisLog(columns, units)})


def stepped() -> Log:
    """A shaft that takes few values, which lie on steps of nearly 2 rad."""
    t = np.arange(500) / 50.0
    angle = 9.55 * np.sin(2.0 * np.pi * 5.0 * t)
    return Log(50.0, {"a": AxisLog({"position": angle, "force": -angle}, ROTARY_UNITS)})


AWKWARD = {
    "far from zero": shifted(by=5.0, times=0.02),
    "farther": shifted(by=-731.0, times=1e-3),
    "over a million turns": shifted(times=3e7, force=3e7, units=ROTARY_UNITS),
    "by steps of a radian": stepped(),
    "a tiny machine": shifted(times=1e-6, force=1e-12),
    "a huge one": shifted(times=1e4, force=1e9),
}


@pytest.mark.parametrize("kind", AWKWARD)
def test_what_is_written_can_be_read(tmp_path, kind):
    mass = 1e-6 if kind == "by steps of a radian" else None  # whose force goes with the place
    model = first_model({"l": AWKWARD[kind]}, "m", CATALOGUE, mass=mass)
    save_model(model, tmp_path / "m.toml")
    axis = load_model(tmp_path / "m.toml").axes["a"]
    assert axis == model.axes["a"]
    x = AWKWARD[kind].axes["a"].position
    if axis.hardware.travel is not None:
        low, high = axis.hardware.travel
        assert low < x.mean() < high
        assert 0.9 * np.ptp(x) < high - low < 1.3 * np.ptp(x)


def test_logs_that_tell_no_mass_stand_still_or_differ_in_rate_are_refused():
    with pytest.raises(InputError, match=r"axis a: l cannot tell the mass.*faster changes") as why:
        first_model({"l": slow()}, "m", CATALOGUE)
    assert "\n" not in str(why.value)
    still = Log(1000.0, {"a": AxisLog({"position": 0.0 * T, "force": 0.0 * T})})
    with pytest.raises(InputError, match="axis a; l: axis a stands still"):
        first_model({"l": still}, "m", CATALOGUE)
    with pytest.raises(InputError, match="sampled at 500, 1000 Hz"):
        first_model({"l": drive(), "m": drive(rate=500.0)}, "m", CATALOGUE)


def test_what_one_late_log_hides_in_all_the_others_tell() -> None:
    """By as much as it hides the acceleration of a light axis behind its friction."""
    light = replace(SLIDE, mass=0.2)
    logs = {f"run{i}": logged(light, Ride(20 + i)) for i in range(3)}
    own = logs["run1"].axes["x"]
    late = {**own.columns, "force": np.roll(own.columns["force"], 100)}
    logs["run1"] = replace(logs["run1"], axes={"x": AxisLog(late, own.units)})
    with pytest.raises(InputError, match="cannot tell the mass"):
        first_model({"run1": logs["run1"]}, "m", CATALOGUE)
    assert first_model(logs, "m", CATALOGUE).axes["x"].mass == pytest.approx(0.2, rel=0.02)


def test_a_force_of_the_other_sign_is_refused_as_what_it_is():
    log = drive()
    columns = dict(log.axes["a"].columns)
    with pytest.raises(InputError, match=r"as if the mass were -3 kg; .* the sign -1"):
        first_axis(Log(1000.0, {"a": AxisLog({**columns, "force": -columns["force"]})}))


def test_the_emps_drive_has_the_published_values(shared_data):
    """A. Janot et al. 2019: 95.1 kg, 20.4 N, 203.5 N s/m, offset -3.16 N of the command."""
    examples = Path(__file__).parents[2] / "examples"
    log = import_log(
        shared_data / "emps" / "DATA_EMPS_PULSES.mat", load_mapping(examples / "import_emps.toml")
    )
    found = {k: v for f in first_model({"l": log}, "m", CATALOGUE).axes["x"].effects
             for k, v in f.values.items()}  # fmt: skip
    assert found["Fc"] == pytest.approx(20.4, rel=0.06)
    assert found["sigma2"] == pytest.approx(203.5, rel=0.06)
    assert found["F0"] == pytest.approx(3.16, rel=0.1)


def test_the_commands_of_a_new_machine(tmp_path):
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
    assert "axis x: coulomb_viscous.Fs is not determined, as no break away" in done.stdout
    axis = load_model(str(tmp_path / "model.toml"), CATALOGUE).axes["x"]
    assert axis.mass == pytest.approx(MASS, rel=0.05)
    wrong = ("import", "--guess", "run.csv", "run.csv")
    assert twin(*wrong, folder=tmp_path).returncode == 2


def test_an_oscillator_that_swings_within_a_block_has_its_mass_and_no_uneven_clock() -> None:
    rate, spring, mass, loss = 600.0, 1.0, 5e-6, 1e-4  # 71 Hz
    force = lfilter(*butter(4, 0.6), np.random.default_rng(4).standard_normal(40 * 600))
    plant = cont2discrete(([1.0], [mass, loss, spring]), 1.0 / rate)
    position = lfilter(plant[0][0], plant[1], force)
    position += 1e-3 * np.std(position) * np.random.default_rng(5).standard_normal(len(force))
    log = Log(rate, {"a": AxisLog({"position": position, "force": force})})
    assert Fault.UNEVEN not in {f.fault for f in check_log(log).findings}
    assert first_model({"l": log}, "m", CATALOGUE).axes["a"].mass == pytest.approx(mass, rel=0.15)


def test_a_machine_is_called_as_it_is_asked(tmp_path):
    write_log(drive(), tmp_path / "run.mcap")
    done = twin("new", "run.mcap", "-o", "m.toml", "--name", "Stage of hall 3", folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert load_model(tmp_path / "m.toml").name == "Stage of hall 3"


@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_a_constant_force_tells_ratios_and_no_mass(tmp_path, noise):
    rng, t = np.random.default_rng(1), np.arange(600) / 200.0
    speed = (6.0 - 0.42) / 2.31 * (1.0 - np.exp(-2.31 / 0.19 * t))
    position = np.cumsum(speed) / 200.0 + 1e-6 * rng.standard_normal(600)
    force = 6.0 + noise * rng.standard_normal(600)
    log = Log(200.0, {"x": AxisLog({"position": position, "force": force})})
    assert check_log(log).ok  # it is an experiment
    with pytest.raises(InputError, match="the force is 6 N throughout, which tells only") as told:
        first_model({"run": log}, "m", CATALOGUE)
    damped, pushed = (
        float(v) for v in re.findall(r"mass = ([0-9.]+) (?:1/s|m/s)", str(told.value))
    )
    assert (damped, pushed) == (pytest.approx(12.16, rel=0.02), pytest.approx(29.37, rel=0.02))
