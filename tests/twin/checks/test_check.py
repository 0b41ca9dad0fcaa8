"""A sound log gives no findings, an unfit one is refused, a dull one is called so."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from check_cases import Columns, clean_log, faults, only, stage, with_axis

from twin.checks import Fault, Severity, check_log
from twin.experiments.named import simulate
from twin.importers import import_log, load_mapping
from twin.logs import AxisLog, Log
from twin.logs.log import Array
from twin.model.machine import MachineModel

EMPS_MAP = Path(__file__).parents[3] / "examples" / "import_emps.toml"


@pytest.fixture
def clean() -> Log:
    return clean_log()


@pytest.fixture
def model() -> MachineModel:
    return stage()


# No false alarms


@pytest.mark.parametrize(
    "seed", [0, 1, *(pytest.param(s, marks=pytest.mark.slow) for s in range(2, 5))]
)
def test_tracking_is_clean(model: MachineModel, seed: int) -> None:
    assert check_log(simulate(model, "tracking", seed=seed, duration=10.0)).findings == ()


@pytest.mark.parametrize("experiment", ["moves", "open_loop_sine"])
def test_experiments_of_both_axes_are_clean(model: MachineModel, experiment: str) -> None:
    assert check_log(simulate(model, experiment, seed=1, duration=10.0)).findings == ()


@pytest.mark.parametrize("experiment", ["cable_pass", "velocity_map", "reversals"])
def test_experiments_of_one_axis_have_no_errors(model: MachineModel, experiment: str) -> None:
    report = check_log(simulate(model, experiment, duration=10.0))
    assert report.ok
    assert faults(report) == {Fault.WEAK_EXCITATION}
    idle = [f for f in report.findings if f.axis == "y"]
    assert len(idle) == 1
    assert "hardly moves" in idle[0].what


@pytest.mark.parametrize("rate", [5000.0, 1000.0, 200.0])
def test_a_slower_log_is_clean(clean: Log, rate: float) -> None:
    every = round(clean.sample_rate / rate)
    axes = {
        name: replace(axis, columns={n: c[::every] for n, c in axis.columns.items()})
        for name, axis in clean.axes.items()
    }
    assert check_log(replace(clean, sample_rate=rate, axes=axes)).findings == ()


@pytest.mark.parametrize("file", ["DATA_EMPS.mat", "DATA_EMPS_PULSES.mat"])
def test_the_emps_drive_is_clean(shared_data: Path, file: str) -> None:
    """Commanded force pulses and a position loop 6 ms behind are no faults."""
    assert check_log(import_log(shared_data / "emps" / file, load_mapping(EMPS_MAP))).findings == ()


# What every other check needs


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_not_a_number(clean: Log, value: float) -> None:
    def plant(columns: Columns) -> Columns:
        columns["current"][[30_000, 30_005]] = value
        return columns

    report = check_log(with_axis(clean, "x", plant))
    assert faults(report) == {Fault.NOT_FINITE}
    finding = only(report, Fault.NOT_FINITE)
    assert "current is not a finite number in 2 of 60000 samples" in finding.what
    assert finding.where == "from 3 s"
    assert not report.ok


@pytest.mark.parametrize("signal", ["position", "force", "current"])
def test_a_flat_signal(clean: Log, signal: str) -> None:
    flat = with_axis(clean, "x", lambda c: {**c, signal: np.full(len(c[signal]), 0.125)})
    finding = only(check_log(flat), Fault.FLAT)
    assert f"{signal} is 0.125" in finding.what
    assert finding.severity is Severity.ERROR


def test_an_axis_held_within_the_step_of_its_encoder_is_idle_not_faulty(clean: Log) -> None:
    zero = np.zeros(len(clean))
    report = check_log(
        with_axis(clean, "y", lambda c: {**c, "position": zero, "setpoint_position": zero})
    )
    assert report.ok
    assert faults(report) == {Fault.WEAK_EXCITATION}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda c: {"force": c["force"]}, "no position"),
        (lambda c: {"position": c["position"]}, "no force, nor a current with a force constant"),
        (lambda c: {**c, "force": c["force"][:-1]}, "differ in length"),
    ],
)
def test_an_incomplete_axis(clean: Log, change: Callable[[Columns], Columns], message: str) -> None:
    assert message in only(check_log(with_axis(clean, "x", change)), Fault.INCOMPLETE).what


@pytest.mark.parametrize("count", [1, 2, 7, 100, 9_999])
def test_a_short_log(clean: Log, count: int) -> None:
    short = with_axis(clean, "x", lambda c: {n: v[-count:] for n, v in c.items()})
    assert "a fit needs 1 s" in only(check_log(short), Fault.TOO_SHORT).what


# Saturation, resolution, excitation


def test_a_clipped_command(clean: Log) -> None:
    def clip(columns: Columns) -> Columns:
        return {**columns, "force": np.clip(columns["force"], -3.0, 3.0)}

    log = with_axis(clean, "x", lambda c: {n: v for n, v in clip(c).items() if n != "current"})
    found = [f for f in check_log(log).findings if f.fault is Fault.SATURATION]
    assert ["-3 N" in f.what for f in found] == [False, True]


def test_a_drive_at_its_limit(model: MachineModel) -> None:
    """The current is measured, so its noise rides on the limit."""
    axis = model.axes["y"]
    weak = model.with_axis("y", replace(axis, hardware=replace(axis.hardware, force_limit=9.0)))
    report = check_log(simulate(weak, "moves", seed=3, duration=10.0))
    found = [f for f in report.findings if f.fault is Fault.SATURATION]
    assert {f.axis for f in found} == {"y"}
    assert all("extreme of 9.0" in f.what or "extreme of -9.0" in f.what for f in found)


@pytest.mark.parametrize("step", [5e-5, 1e-4])
def test_a_coarse_encoder(clean: Log, step: float) -> None:
    def quantize(columns: Columns) -> Columns:
        return {**columns, "position": step * np.round(columns["position"] / step)}

    finding = only(check_log(with_axis(clean, "y", quantize)), Fault.COARSE_POSITION)
    assert f"smallest change is {step:.2g} m" in finding.what
    assert finding.severity is Severity.WARNING


def drive(velocity: Array, rate: float) -> Log:
    """A drive of 2 kg with 3 N of Coulomb and 5 N s/m of viscous friction, a little noise."""
    rng = np.random.default_rng(3)
    position = np.cumsum(velocity) / rate + 1e-8 * rng.standard_normal(len(velocity))
    force = 2.0 * np.gradient(velocity, 1.0 / rate) + 3.0 * np.sign(velocity) + 5.0 * velocity
    force += 0.01 * rng.standard_normal(len(velocity))
    return Log(rate, {"x": AxisLog({"position": position, "force": force})})


TIME = np.arange(20_000) / 2000.0


@pytest.mark.parametrize(
    ("velocity", "message"),
    [
        (0.1 + 0.05 * np.sin(5.0 * TIME), "only forwards (100 % of its moving time)"),
        (-0.1 - 0.05 * np.sin(5.0 * TIME), "only backwards"),
        (0.1 * np.tanh(30.0 * np.sin(2.0 * TIME)), "one speed only, 0.1 m/s"),
    ],
)
def test_weak_excitation(velocity: Array, message: str) -> None:
    report = check_log(drive(velocity, 2000.0))
    finding = only(report, Fault.WEAK_EXCITATION)
    assert message in finding.what
    assert report.ok


def test_a_lively_drive_is_clean() -> None:
    report = check_log(drive(0.1 * np.sin(5.0 * TIME) + 0.05 * np.sin(11.0 * TIME), 2000.0))
    assert report.findings == ()
