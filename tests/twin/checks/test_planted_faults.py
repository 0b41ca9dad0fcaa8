"""Each fault of a recording is called by its name, with the place, the size and what to do.

One axis later than the other in all its columns, the setpoint too, is not among them: no column
shows it.
"""

import re
from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from check_cases import Columns, clean_log, faults, late, milliseconds, only, stage, with_axis
from planted_faults import COLUMN_SETS, FAULTS, HIDDEN, with_columns

from twin.checks import Fault, check_log
from twin.experiments.named import simulate
from twin.logs import Log
from twin.logs.log import Array

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


def burst(shape: Array) -> Callable[[Columns], Columns]:
    """A burst of 10 ms on the position."""

    def plant(columns: Columns) -> Columns:
        columns["position"][30_000:30_100] += shape
        return columns

    return plant


def test_a_burst_of_little_noise_is_told_where_it_is() -> None:
    noise = 1e-6 * np.random.default_rng(0).standard_normal(100)
    finding = only(check_log(with_axis(clean_log(), "y", burst(noise))), Fault.OUTLIERS)
    assert finding.what.startswith("position bends by up to")
    start, end = (float(w) for w in finding.where.removesuffix(" s").split(" to "))
    assert (start, end) == (pytest.approx(3.0, abs=0.011), pytest.approx(3.01, abs=0.011))


def test_a_burst_does_not_hide_a_lag() -> None:
    both = with_axis(clean_log(), "x", burst(np.full(100, 1e-3)))
    report = check_log(with_axis(both, "x", late(500, "force", "current")))
    assert faults(report) == {Fault.LAG, Fault.OUTLIERS}
    assert milliseconds(only(report, Fault.LAG)) == pytest.approx(50.0, abs=0.3)
