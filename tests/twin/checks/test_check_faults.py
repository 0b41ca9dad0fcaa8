"""Every fault that is planted in a log of the twin is found, with its size and its place."""

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from check_cases import Columns, clean_log, faults, late, milliseconds, only, with_axis

from twin.checks import Fault, Severity, check_log
from twin.importers import import_log, load_mapping
from twin.logs import AxisLog, Log
from twin.logs.log import Array

EMPS_MAP = Path(__file__).parents[3] / "examples" / "import_emps.toml"
BURST = 100  # samples, 10 ms
MIDDLE = 30_000


@pytest.fixture
def clean() -> Log:
    return clean_log()


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


@pytest.mark.parametrize("axis", ["x", "y"])
@pytest.mark.parametrize("lag", [-200.0, -50.0, -5.0, 5.0, 12.3, 50.0, 200.0])
def test_a_force_recorded_late(clean: Log, axis: str, lag: float) -> None:
    report = check_log(with_axis(clean, axis, late(round(lag * 10), "force", "current")))
    finding = only(report, Fault.LAG)
    assert milliseconds(finding) == pytest.approx(lag, abs=0.3)
    dead_time = -10.0 <= lag < 0.0
    assert finding.severity is (Severity.WARNING if dead_time else Severity.ERROR)


@pytest.mark.parametrize("lag", [-2.0, 2.0])
def test_a_lag_that_a_drive_may_have_is_a_warning(clean: Log, lag: float) -> None:
    report = check_log(with_axis(clean, "x", late(round(lag * 10), "force", "current")))
    (finding,) = report.findings
    assert (finding.fault, finding.severity) == (Fault.LAG, Severity.WARNING)
    assert milliseconds(finding) == pytest.approx(lag, abs=0.3)


def test_the_smallest_lag_that_counts(clean: Log) -> None:
    report = check_log(with_axis(clean, "x", late(34, "force", "current")))
    assert milliseconds(only(report, Fault.LAG)) == pytest.approx(3.4, abs=0.3)


@pytest.mark.parametrize("lag", [-50.0, 50.0])
def test_a_position_recorded_late(clean: Log, lag: float) -> None:
    report = check_log(with_axis(clean, "x", late(round(lag * 10), "position")))
    against_force, against_setpoint = report.findings
    assert milliseconds(against_force) == pytest.approx(-lag, abs=0.3)
    assert milliseconds(against_setpoint) == pytest.approx(lag, abs=0.5)
    assert not report.ok
    column = "position" if lag > 0 else "force"
    assert re.match(rf"give {column} delay_samples = (499|500|501) ", against_force.remedy)


def test_where_all_readings_are_late_the_position_alone_is_not_corrected(clean: Log) -> None:
    readings = with_axis(clean, "x", late(500, "position", "force", "current"))
    finding = only(check_log(readings), Fault.LAG)
    assert milliseconds(finding) == pytest.approx(50.0, abs=0.5)
    assert re.match(
        "give position and current and force delay_samples = (49|50). in", finding.remedy
    )


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
        ("position", 1e-3 * OFFSET, "samples of the position are off"),
        ("position", 1e-5 * OFFSET, "samples of the position are off"),
        ("position", 1e-6 * NOISE, "position bends"),
        ("position", 1e-4 * HALF_SINE, "samples of the position are off"),
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


def test_a_finding_is_one_sentence_with_axis_place_and_remedy(clean: Log) -> None:
    report = check_log(with_axis(clean, "y", late(500, "force", "current")))
    assert re.fullmatch(
        r"axis y, whole log: the force is \S+ ms \(\d+ samples\) behind the motion that it causes; "
        r"give force delay_samples = \d+ in the import map",
        str(only(report, Fault.LAG)),
    )


def test_a_mass_that_no_acceleration_shows_is_named():
    t = np.arange(40_000) / 1000.0
    position = 0.05 * np.sin(0.5 * t) + 0.02 * np.sin(0.35 * t + 1.0)
    velocity = 0.025 * np.cos(0.5 * t) + 0.007 * np.cos(0.35 * t + 1.0)
    noise = 1e-8 * np.random.default_rng(1).standard_normal(len(t))
    slow = {"position": position + noise, "force": 1.5 * np.tanh(velocity / 1e-4) + 40.0 * velocity}
    (found,) = check_log(Log(1000.0, {"x": AxisLog(slow)})).findings
    assert found.fault is Fault.WEAK_EXCITATION
    assert "the mass cannot be identified" in found.what
