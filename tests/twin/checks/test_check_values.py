"""Laws of the checks of values: one that never changes, and numbers that are none."""

import numpy as np
import pytest
from check_drive import drive, findings

from twin.checks import Fault, Severity, check_log


@pytest.mark.parametrize("name", ["position", "velocity", "current", "force"])
def test_a_signal_that_never_changes_is_told_with_its_value(name):
    def flat(columns):
        columns[name][:] = 0.375

    signals = ("position", "velocity", "current", "force", "setpoint_position")
    (found,) = check_log(drive(signals=signals, change=flat)).findings
    unit = {"position": "m", "velocity": "m/s", "current": "A", "force": "N"}[name]
    assert (found.fault, found.severity) == (Fault.FLAT, Severity.ERROR)
    assert found.what == f"{name} is 0.375 {unit} throughout"

    def nearly(columns):
        flat(columns)
        columns[name][-1] += 1e-9

    assert not findings(drive(signals=signals, change=nearly), Fault.FLAT)

    def idle(columns):
        flat(columns)
        columns["setpoint_position"][:] = 0.1

    (found,) = check_log(drive(signals=signals, change=idle)).findings
    standing = name in ("position", "velocity")
    assert found.fault is (Fault.WEAK_EXCITATION if standing else Fault.FLAT)
    assert found.severity is (Severity.WARNING if standing else Severity.ERROR)


@pytest.mark.parametrize("name", ["position", "force", "setpoint_velocity"])
@pytest.mark.parametrize("places", [(0,), (17, 400, 3999)])
def test_numbers_that_are_none_are_counted_and_placed(name, places):
    def spoil(columns):
        columns[name][list(places)] = np.nan

    log = drive(signals=("position", "force", "setpoint_velocity"), change=spoil)
    (found,) = check_log(log).findings
    assert found.fault is Fault.NOT_FINITE
    assert found.what == (f"{name} is not a finite number in {len(places)} of 4000 samples")
    assert found.where == f"from {places[0] / 1000.0:g} s"
