"""Every fault that is planted in a log of the twin is found, and none where none was planted."""

import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from twin.effects import load_catalogue
from twin.experiments import simulate
from twin.log import AxisLog, Log
from twin.log.check import CheckReport, Fault, Finding, Severity, check_log
from twin.log.importers import import_log, load_mapping
from twin.log.log import Array
from twin.model import StageModel
from twin.model_file import load_model

EMPS_MAP = Path(__file__).parent.parent / "examples" / "import_emps.toml"
BURST = 100  # samples, 10 ms
MIDDLE = 30_000

Columns = dict[str, Array]


@pytest.fixture(scope="module")
def model() -> StageModel:
    return load_model("proton_xy", load_catalogue())


@pytest.fixture(scope="module")
def clean(model: StageModel) -> Log:
    return simulate(model, "tracking", seed=5, duration=6.0)


def with_axis(log: Log, name: str, change: Callable[[Columns], Mapping[str, Array]]) -> Log:
    """The log of one axis, its columns changed."""
    axis = log.axes[name]
    columns = dict(change({n: c.copy() for n, c in axis.columns.items()}))
    return replace(log, axes={name: replace(axis, columns=columns)})


def only(report: CheckReport, fault: Fault) -> Finding:
    """The one finding of that kind."""
    found = [f for f in report.findings if f.fault is fault]
    assert len(found) == 1, [str(f) for f in report.findings]
    return found[0]


def faults(report: CheckReport) -> set[Fault]:
    return {f.fault for f in report.findings}


# No false alarms


@pytest.mark.parametrize("seed", range(5))
def test_tracking_is_clean(model: StageModel, seed: int) -> None:
    assert check_log(simulate(model, "tracking", seed=seed, duration=10.0)).findings == ()


@pytest.mark.parametrize("experiment", ["moves", "open_loop_sine"])
def test_experiments_of_both_axes_are_clean(model: StageModel, experiment: str) -> None:
    assert check_log(simulate(model, experiment, seed=1, duration=10.0)).findings == ()


@pytest.mark.parametrize("experiment", ["cable_pass", "velocity_map", "reversals"])
def test_experiments_of_one_axis_have_no_errors(model: StageModel, experiment: str) -> None:
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


# Units and signs


def scaled(factor: float, *names: str) -> Callable[[Columns], Columns]:
    return lambda c: {n: v * factor if n in names else v for n, v in c.items()}


@pytest.mark.parametrize("axis", ["x", "y"])
@pytest.mark.parametrize(
    ("change", "message"),
    [
        (scaled(1e3, "position"), "position is 1000 times setpoint_position: it looks like .* mm"),
        (scaled(1e6, "position"), "times setpoint_position: it looks like .* um"),
        (scaled(180 / np.pi, "position"), "position is 57.3 times .* degrees for radians"),
        (scaled(1e3, "setpoint_position"), "position is 0.001 times setpoint_position"),
        (scaled(1e3, "setpoint_velocity"), "setpoint_velocity is 1000 times the rate of"),
        (
            scaled(1e-3, "setpoint_acceleration"),
            "setpoint_acceleration is 0.001[0-9]* times the second",
        ),
        (scaled(1e3, "current"), "force is 0.001 times force constant x current"),
        (scaled(1.1, "force"), "force is 1.1 times force constant x current: a scale"),
        (scaled(1e3, "position", "setpoint_position"), "position travels .* more than 10 m"),
    ],
)
def test_a_unit_slip(
    clean: Log, axis: str, change: Callable[[Columns], Columns], message: str
) -> None:
    report = check_log(with_axis(clean, axis, change))
    found = " ".join(f.what for f in report.findings if f.fault is Fault.UNIT)
    assert not report.ok
    assert re.search(message, found), [str(f) for f in report.findings]


def test_a_wrong_sample_rate(clean: Log) -> None:
    report = check_log(replace(clean, sample_rate=1000.0))
    assert any("10 times the rate of setpoint_position" in f.what for f in report.findings)
    assert not report.ok


def test_a_measured_velocity_in_another_unit(clean: Log) -> None:
    velocity = clean.truth["x"]["velocity"]
    assert check_log(with_axis(clean, "x", lambda c: {**c, "velocity": velocity})).ok
    slip = with_axis(clean, "x", lambda c: {**c, "velocity": 1e3 * velocity})
    assert "velocity is 1000 times the rate of position" in only(check_log(slip), Fault.UNIT).what


@pytest.mark.parametrize(("axis", "mass"), [("x", 15.0), ("y", 6.0)])
def test_a_reversed_force(clean: Log, axis: str, mass: float) -> None:
    finding = only(check_log(with_axis(clean, axis, scaled(-1.0, "force", "current"))), Fault.SIGN)
    stated = float(finding.what.split()[-2])
    assert stated == pytest.approx(-mass, rel=0.05)
    assert finding.severity is Severity.ERROR


def test_a_reversed_position(clean: Log) -> None:
    report = check_log(with_axis(clean, "x", scaled(-1.0, "position")))
    what = [f.what for f in report.findings]
    assert faults(report) == {Fault.SIGN}
    assert any("position is -1 times setpoint_position" in w for w in what)
    assert any("acts against the acceleration" in w for w in what)


# Lags


def late(samples: int, *names: str) -> Callable[[Columns], Columns]:
    """Some columns recorded late (early where negative), the ends cut off."""
    cut = slice(abs(samples), -abs(samples))
    return lambda c: {n: (np.roll(v, samples) if n in names else v)[cut] for n, v in c.items()}


def milliseconds(finding: Finding) -> float:
    """The lag that is stated, positive where the signal is behind."""
    words = finding.what.split()
    at = words.index("ms")
    return float(words[at - 1]) * (1.0 if "behind" in words else -1.0)


@pytest.mark.parametrize("axis", ["x", "y"])
@pytest.mark.parametrize("lag", [-200.0, -50.0, -5.0, 4.0, 5.0, 12.3, 50.0, 200.0])
def test_a_force_recorded_late(clean: Log, axis: str, lag: float) -> None:
    report = check_log(with_axis(clean, axis, late(round(lag * 10), "force", "current")))
    finding = only(report, Fault.LAG)
    assert milliseconds(finding) == pytest.approx(lag, abs=0.3)
    dead_time = -10.0 <= lag < 0.0
    assert finding.severity is (Severity.WARNING if dead_time else Severity.ERROR)


@pytest.mark.parametrize("lag", [-2.0, 2.0])
def test_a_lag_that_a_drive_may_have_is_left_to_the_fit(clean: Log, lag: float) -> None:
    report = check_log(with_axis(clean, "x", late(round(lag * 10), "force", "current")))
    assert report.findings == ()


@pytest.mark.parametrize("lag", [-50.0, 50.0])
def test_a_position_recorded_late(clean: Log, lag: float) -> None:
    report = check_log(with_axis(clean, "x", late(round(lag * 10), "position")))
    against_force, against_setpoint = report.findings
    assert milliseconds(against_force) == pytest.approx(-lag, abs=0.3)
    assert milliseconds(against_setpoint) == pytest.approx(lag, abs=0.5)
    assert not report.ok
    column = "position" if lag > 0 else "force"
    assert re.match(rf"give {column} delay_samples = (499|500|501) ", against_force.remedy)


def test_a_measured_velocity_recorded_late(clean: Log) -> None:
    velocity = clean.truth["x"]["velocity"]
    slow = with_axis(clean, "x", lambda c: late(80, "velocity")({**c, "velocity": velocity}))
    finding = only(check_log(slow), Fault.LAG)
    assert finding.what.startswith("velocity is ")
    assert milliseconds(finding) == pytest.approx(8.0, abs=0.3)


def test_a_lag_is_found_at_a_low_rate(shared_data: Path) -> None:
    log = import_log(shared_data / "emps" / "DATA_EMPS.mat", load_mapping(EMPS_MAP))
    finding = only(check_log(with_axis(log, "x", late(50, "force"))), Fault.LAG)
    assert milliseconds(finding) == pytest.approx(50.0, abs=0.3)


# Outliers


def burst(name: str, shape: Array, at: int = MIDDLE) -> Callable[[Columns], Columns]:
    def plant(columns: Columns) -> Columns:
        columns[name][at : at + len(shape)] += shape
        return columns

    return plant


HALF_SINE = np.sin(np.pi * np.arange(BURST) / BURST)
NOISE = np.random.default_rng(0).standard_normal(BURST)
OFFSET = np.ones(BURST)


@pytest.mark.parametrize("axis", ["x", "y"])
@pytest.mark.parametrize(
    ("name", "shape", "message"),
    [
        ("position", 1e-3 * OFFSET, "position bends"),
        ("position", 1e-5 * OFFSET, "position bends"),
        ("position", 1e-6 * NOISE, "position bends"),
        ("position", 1e-4 * HALF_SINE, "position bends"),
        ("force", 20.0 * OFFSET, "force and motion contradict each other"),
        ("force", 20.0 * HALF_SINE, "force and motion contradict each other"),
        ("force", 5.0 * NOISE, "force jumps to and fro"),
    ],
)
def test_a_burst_of_10_ms(clean: Log, axis: str, name: str, shape: Array, message: str) -> None:
    report = check_log(with_axis(clean, axis, burst(name, shape)))
    finding = only(report, Fault.OUTLIERS)
    assert message in finding.what
    start, end = (float(w) for w in finding.where.removesuffix(" s").split(" to "))
    assert start == pytest.approx(MIDDLE / 1e4, abs=0.011)
    assert end == pytest.approx((MIDDLE + BURST) / 1e4, abs=0.011)
    assert finding.severity is Severity.ERROR


def test_bursts_are_counted(clean: Log) -> None:
    def plant(columns: Columns) -> Columns:
        for at in (10_000, 30_000, 50_000):
            burst("position", 1e-4 * OFFSET, at)(columns)
        return columns

    where = only(check_log(with_axis(clean, "x", plant)), Fault.OUTLIERS).where
    assert where.startswith("0.9999 to ")
    assert where.endswith("and 2 more times")


def test_a_burst_does_not_hide_a_lag(clean: Log) -> None:
    both = with_axis(clean, "x", burst("position", 1e-3 * OFFSET))
    report = check_log(with_axis(both, "x", late(500, "force", "current")))
    assert faults(report) == {Fault.LAG, Fault.OUTLIERS}
    assert milliseconds(only(report, Fault.LAG)) == pytest.approx(50.0, abs=0.3)


# Saturation, resolution, excitation


def test_a_clipped_command(clean: Log) -> None:
    def clip(columns: Columns) -> Columns:
        return {**columns, "force": np.clip(columns["force"], -3.0, 3.0)}

    log = with_axis(clean, "x", lambda c: {n: v for n, v in clip(c).items() if n != "current"})
    found = [f for f in check_log(log).findings if f.fault is Fault.SATURATION]
    assert ["-3 N" in f.what for f in found] == [False, True]


def test_a_drive_at_its_limit(model: StageModel) -> None:
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


def test_a_finding_is_one_sentence_with_axis_place_and_remedy(clean: Log) -> None:
    report = check_log(with_axis(clean, "y", late(500, "force", "current")))
    assert re.fullmatch(
        r"axis y, whole log: the force is \S+ ms \(\d+ samples\) behind the motion that it causes; "
        r"give force delay_samples = \d+ in the import map",
        str(only(report, Fault.LAG)),
    )
