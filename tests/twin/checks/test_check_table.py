"""Each fault of a recording is called by its name, with the place, the size and what to do.

One axis later than the other in all its columns, the setpoint too, is not among them: no column
shows it.
"""

from __future__ import annotations

import re
from functools import cache

import pytest
from check_cases import stage
from planted_faults import COLUMN_SETS, FAULTS, HIDDEN, with_columns

from twin.checks import Fault, check_log
from twin.experiments.named import simulate
from twin.logs import Log

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
