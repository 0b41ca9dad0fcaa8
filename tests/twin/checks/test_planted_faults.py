"""Each fault of a recording is called by its name, with the place, the size and what to do.

One axis later than the other in all its columns, the setpoint too, is not among them: no column
shows it.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from check_cases import Columns, clean_log, faults, late, milliseconds, only, stage, with_axis
from planted_faults import COLUMN_SETS, FAULTS, HIDDEN, with_columns

from twin.checks import Fault, Severity, check_log
from twin.experiments.named import simulate
from twin.logs import AxisLog, Log
from twin.logs.log import Array

BURST = 100  # samples, 10 ms
MIDDLE = 30_000
SETS = list(COLUMN_SETS)
SHOWN = {name: [s for s in SETS if (name, s) not in HIDDEN] for name in FAULTS}
ROUNDS = {name: SHOWN[name][i % len(SHOWN[name])] for i, name in enumerate(FAULTS)}


@cache
def recording(experiment: str, seed: int) -> Log:
    return simulate(stage(), experiment, seed=seed, duration=10.0)


def named(log: Log, fault: str, columns: str) -> bool:
    plant, kind = FAULTS[fault]
    found = check_log(with_columns(plant(log), COLUMN_SETS[columns])).findings
    kinds = {kind}
    if columns == "bare" and kind is Fault.STEP:  # forwards, it looks like missing samples
        kinds.add(Fault.MISSING)
    return any(f.fault in kinds and f.remedy and re.search(r"\d", str(f)) for f in found)


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_named(fault: str) -> None:
    assert named(recording("moves", 1), fault, ROUNDS[fault])


@pytest.mark.slow
@pytest.mark.parametrize(("fault", "columns"), [(f, s) for f in FAULTS for s in SHOWN[f]])
def test_a_fault_is_named_in_nine_of_ten(fault: str, columns: str) -> None:
    logs = [recording(e, s) for e in ("tracking", "moves") for s in (1, 2, 3, 4, 5)]
    assert sum(named(log, fault, columns) for log in logs) >= 0.9 * len(logs)


@pytest.mark.slow
def test_clean_logs_are_called_clean() -> None:
    wrong = []
    for seed in range(50):
        for experiment in ("tracking", "moves"):
            log = simulate(stage(), experiment, seed=200 + seed, duration=8.0)
            for columns in COLUMN_SETS.values():
                wrong += [str(f) for f in check_log(with_columns(log, columns)).findings]
    assert not [w for w in wrong if "hardly moves" not in w and "moves only" not in w]


@pytest.mark.parametrize("lag", [-50.0, 50.0])
def test_a_position_recorded_late_contradicts_force_and_setpoint(lag: float) -> None:
    report = check_log(with_axis(clean_log(), "x", late(round(lag * 10), "position")))
    against_force, against_setpoint = report.findings
    assert milliseconds(against_force) == pytest.approx(-lag, abs=0.3)
    assert milliseconds(against_setpoint) == pytest.approx(lag, abs=0.5)
    assert not report.ok
    column = "position" if lag > 0 else "force"
    assert re.match(rf"give {column} delay_samples = (499|500|501) ", against_force.remedy)


# Outliers


def burst(name: str, shape: Array, at: int = MIDDLE) -> Callable[[Columns], Columns]:
    def plant(columns: Columns) -> Columns:
        columns[name][at : at + len(shape)] += shape
        return columns

    return plant


HALF_SINE = np.sin(np.pi * np.arange(BURST) / BURST)
NOISE = np.random.default_rng(0).standard_normal(BURST)
OFFSET = np.ones(BURST)


@pytest.mark.parametrize(
    ("name", "shape", "message"),
    [
        ("position", 1e-5 * OFFSET, "samples of the position are off"),
        ("position", 1e-6 * NOISE, "position bends"),
        ("position", 1e-4 * HALF_SINE, "samples of the position are off"),
        ("force", 20.0 * OFFSET, "force and motion contradict each other"),
        ("force", 20.0 * HALF_SINE, "force and motion contradict each other"),
        ("force", 5.0 * NOISE, "force jumps to and fro"),
    ],
)
def test_a_burst_of_10_ms(name: str, shape: Array, message: str) -> None:
    report = check_log(with_axis(clean_log(), "y", burst(name, shape)))
    finding = only(report, Fault.OUTLIERS)
    assert message in finding.what
    start, end = (float(w) for w in finding.where.removesuffix(" s").split(" to "))
    assert start == pytest.approx(MIDDLE / 1e4, abs=0.011)
    assert end == pytest.approx((MIDDLE + BURST) / 1e4, abs=0.011)
    assert finding.severity is Severity.ERROR


def test_a_burst_does_not_hide_a_lag() -> None:
    both = with_axis(clean_log(), "x", burst("position", 1e-3 * OFFSET))
    report = check_log(with_axis(both, "x", late(500, "force", "current")))
    assert faults(report) == {Fault.LAG, Fault.OUTLIERS}
    assert milliseconds(only(report, Fault.LAG)) == pytest.approx(50.0, abs=0.3)


def test_a_finding_is_one_sentence_with_axis_place_and_remedy() -> None:
    report = check_log(with_axis(clean_log(), "y", late(500, "force", "current")))
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
