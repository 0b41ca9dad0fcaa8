"""Checks whether a log is suitable for identification, before anything is fitted.

Their thresholds are told by drives whose faults are known (tests/twin/checks): sound ones pass, and
a fault is named from the size on that a fit would notice.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from twin.checks.axis import Axis
from twin.checks.breaks import check_breaks, check_outliers
from twin.checks.channels import check_crossed, check_timing, check_units
from twin.checks.content import (
    check_assumed,
    check_command,
    check_content,
    check_excitation,
    check_saturation,
)
from twin.checks.report import CheckReport, Fault, LogFinding, Severity
from twin.logs.log import AxisLog, Log

__all__ = ["CheckReport", "Fault", "LogFinding", "Severity", "check_assumed", "check_log", "moves"]

PARTS = (
    check_units, check_timing, check_breaks, check_command, check_outliers, check_saturation,
    check_excitation,
)  # fmt: skip


def moves(log: Log, axis: str) -> bool:
    """Whether an axis of a log moves beyond the noise of its encoder."""
    return Axis(axis, log.sample_rate, log.axes[axis]).moves


def check_log(log: Log) -> CheckReport:
    """Look for faults that spoil an identification; the log is not changed.

    Where an axis lacks something that every other check needs, only that is reported.
    """
    findings: list[LogFinding] = []
    sound: list[Axis] = []
    for name, columns in log.axes.items():
        axis = Axis(name, log.sample_rate, columns)
        basic = list(check_content(axis))
        known = list(check_assumed(name, log.metadata))
        findings += [*basic, *known]
        if not basic:
            sound.append(axis)
            counted = {f.fault for f in known} & {Fault.WRAPPED}  # by the import, with the size
            findings += [f for check in PARTS for f in check(axis) if f.fault not in counted]
    findings += check_crossed(sound)
    still = {name for name, axis in log.axes.items() if _is_still(axis)}
    still |= {axis.name for axis in sound if not axis.moves}
    if still == set(log.axes):
        findings = [_of_all(finding) for finding in findings]
    return CheckReport(tuple(findings))


def _is_still(axis: AxisLog) -> bool:
    """Whether the position is one value."""
    position = axis.columns.get("position")
    return position is not None and len(position) > 0 and bool(np.all(position == position[0]))


def _of_all(finding: LogFinding) -> LogFinding:
    """That an axis is at rest, where all are: nothing can be fitted to such a log."""
    rests = finding.fault in (Fault.FLAT, Fault.WEAK_EXCITATION)
    return replace(finding, severity=Severity.ERROR) if rests else finding
