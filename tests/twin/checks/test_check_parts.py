"""A log that is checked in parts: each fault is said once, with its first place."""

import pytest

from twin.checks import Fault, Severity
from twin.checks.long import Part, together
from twin.checks.report import CheckReport, Finding


def finding(fault=Fault.LAG, where="whole log", severity=Severity.WARNING, what="w") -> Finding:
    return Finding(severity, fault, "x", what, where, "r")


def parts_of(*reports: tuple[Finding, ...]) -> list[Part]:
    return [Part(10.0 * i, 10.0 * i + 10.0, CheckReport(r)) for i, r in enumerate(reports)]


ONE, TWO = finding(where="from 3 s", what="first"), finding(where="from 4 s", what="second")
WHOLE, WORSE = finding(), finding(severity=Severity.ERROR, what="worse", where="from 1 s")


@pytest.mark.parametrize(
    ("reports", "what", "where"),
    [
        (((), (ONE, TWO), (TWO,)), "first",
         "from 3 s into the part from 10 to 20 s, and in 1 other parts"),
        (((), (WHOLE,)), "w", "10 to 20 s"),
        (((WHOLE,), (WHOLE,)), "w", "whole log"),
        (((WHOLE,), (WORSE,)), "worse",  # the worst of a fault is said
         "from 1 s into the part from 10 to 20 s, and in 1 other parts"),
    ],
)  # fmt: skip
def test_a_fault_is_said_once_with_its_first_place_and_in_how_many_parts(reports, what, where):
    report = together(parts_of(*reports))
    (said,) = report.findings
    assert (said.what, said.where) == (what, where)
    assert report.ok == (said.severity is Severity.WARNING)


def test_one_part_is_the_log():
    alone = parts_of((ONE, TWO))
    assert together(alone) is alone[0].report


@pytest.mark.parametrize("fault", [Fault.FLAT, Fault.WEAK_EXCITATION, Fault.COARSE_POSITION])
def test_what_is_of_the_whole_counts_where_all_parts_say_so(fault):
    dull = finding(fault)
    assert together(parts_of((dull,), ())).findings == ()
    assert [f.fault for f in together(parts_of((dull,), (dull,))).findings] == [fault]
