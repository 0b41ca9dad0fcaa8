"""A first model has what a log shows of the machine."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from cli_runs import twin
from scipy.signal import butter, cont2discrete, lfilter

from identify.analysis.first_model import first_model, not_determined
from twin.checks import Fault, check_log
from twin.effects import load_catalogue
from twin.errors import InputError
from twin.importers import import_log, load_mapping
from twin.logs import ROTARY_UNITS, AxisLog, Log
from twin.model.file import load_model
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


def test_logs_that_tell_no_mass_stand_still_or_differ_in_rate_are_refused():
    t = np.arange(15_000) / 1000.0
    v = 0.025 * np.cos(0.5 * t) + 0.007 * np.cos(0.35 * t + 1.0)
    x = np.cumsum(v) / 1000.0 + 1e-8 * np.random.default_rng(1).standard_normal(len(t))
    slow = Log(1000.0, {"a": AxisLog({"position": x, "force": 1.5 * np.sign(v) + 40.0 * v})})
    with pytest.raises(InputError, match=r"axis a: l cannot tell the mass.*faster changes") as why:
        first_model({"l": slow}, "m", CATALOGUE)
    assert "\n" not in str(why.value)
    still = Log(1000.0, {"a": AxisLog({"position": 0.0 * T, "force": 0.0 * T})})
    with pytest.raises(InputError, match="no axis moves in l"):
        first_model({"l": still}, "m", CATALOGUE)
    with pytest.raises(InputError, match="sampled at 500, 1000 Hz"):
        first_model({"l": drive(), "m": drive(rate=500.0)}, "m", CATALOGUE)


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
