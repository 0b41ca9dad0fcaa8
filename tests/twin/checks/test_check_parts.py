"""Laws of a check of two axes, and of a log that is checked in parts."""

import numpy as np
import pytest
from check_drive import command, motion

from twin.checks import Fault, Severity, check_log
from twin.checks import channels as crossed
from twin.checks.axis import Axis
from twin.checks.long import Part, together
from twin.checks.report import CheckReport, Finding
from twin.logs import LINEAR_UNITS, ROTARY_UNITS, AxisLog, Log

RATE = 1000.0
BOTH = ("position", "force", "setpoint_position")


# --- two axes ------------------------------------------------------------------------------


def two_axes(swapped: tuple[str, ...] = (), kind=None) -> Log:
    t = 10.0 + np.arange(4000) / RATE
    made = {
        "a": {"position": motion(t), "force": command(t + 0.5 / RATE), "setpoint_position":
              motion(t)},
        "b": {"position": motion(1.7 * t + 3.0), "setpoint_position": motion(1.7 * t + 3.0)},
    }  # fmt: skip
    v, a = 1.7 * motion(1.7 * t + 3.0, 1), 1.7**2 * motion(1.7 * t + 3.0, 2)
    made["b"]["force"] = 4.0 * a + 9.0 * np.tanh(v / 1e-3) + 2.0 * v
    for name in swapped:
        made["a"][name], made["b"][name] = made["b"][name], made["a"][name]
    kinds = {"a": LINEAR_UNITS, "b": kind or LINEAR_UNITS}
    return Log(RATE, {n: AxisLog(c, kinds[n]) for n, c in made.items()})


@pytest.mark.parametrize("what", ["force", "position"])
def test_channels_that_are_swapped_are_told_by_what_was(what):
    def found(log):
        return list(crossed.check_crossed([Axis(n, RATE, axis) for n, axis in log.axes.items()]))

    assert found(two_axes()) == []
    (told,) = found(two_axes((what,)))
    assert (told.fault, told.severity, told.axis) == (Fault.SWAPPED, Severity.ERROR, "a")
    assert told.what.startswith("the motion of axis b leaves ")
    assert told.what.endswith(f"{what}s of axes a and b are swapped")
    crossing, own = (float(word) for word in told.what.split() if word[0].isdigit())
    assert crossing < 10.0 < 50.0 < own
    assert told.remedy == f"exchange the columns of the {what}s of both axes in the import map"
    assert found(two_axes((what,), ROTARY_UNITS)) == []  # newtons are no newton metres


# --- a long log in parts -------------------------------------------------------------------


def finding(fault=Fault.LAG, where="whole log", severity=Severity.WARNING, what="w") -> Finding:
    return Finding(severity, fault, "x", what, where, "r")


def parts_of(*reports: tuple[Finding, ...]) -> list[Part]:
    return [Part(10.0 * i, 10.0 * i + 10.0, CheckReport(r)) for i, r in enumerate(reports)]


def test_a_fault_is_said_once_with_its_first_place_and_in_how_many_parts():
    one, two = finding(where="from 3 s", what="first"), finding(where="from 4 s", what="second")
    (said,) = together(parts_of((), (one, two), (two,))).findings
    assert (said.what, said.where) == (
        "first", "from 3 s into the part from 10 to 20 s, and in 1 other parts"
    )  # fmt: skip
    (said,) = together(parts_of((), (finding(),))).findings
    assert said.where == "10 to 20 s"
    (said,) = together(parts_of((finding(),), (finding(),))).findings
    assert said.where == "whole log"
    alone = parts_of((one, two))
    assert together(alone) is alone[0].report


def test_the_worst_of_a_fault_is_said():
    error = finding(severity=Severity.ERROR, what="worse", where="from 1 s")
    (said,) = together(parts_of((finding(),), (error,))).findings
    assert (said.what, said.severity) == ("worse", Severity.ERROR)
    assert said.where == "from 1 s into the part from 10 to 20 s, and in 1 other parts"


@pytest.mark.parametrize("fault", [Fault.FLAT, Fault.WEAK_EXCITATION, Fault.COARSE_POSITION])
def test_what_is_of_the_whole_counts_where_all_parts_say_so(fault):
    dull = finding(fault)
    assert together(parts_of((dull,), ())).findings == ()
    assert [f.fault for f in together(parts_of((dull,), (dull,))).findings] == [fault]


def test_a_log_may_be_fitted_where_no_finding_is_an_error():
    warning, error = finding(), finding(severity=Severity.ERROR)
    assert CheckReport((warning,)).ok
    assert not CheckReport((warning, error)).ok
    assert check_log(two_axes()).ok
