"""Checks whether a log is suitable for identification, before anything is fitted."""

from __future__ import annotations

from twin.log.check import (
    assumed,
    breaks,
    command,
    content,
    crossed,
    excitation,
    outliers,
    saturation,
    timing,
    units,
)
from twin.log.check.axis import Axis
from twin.log.check.report import CheckReport, Fault, Finding, Severity
from twin.log.log import Log

__all__ = ["CheckReport", "Fault", "Finding", "Severity", "check_log", "moves"]


def moves(log: Log, axis: str) -> bool:
    """Whether an axis of a log moves beyond the noise of its encoder."""
    return Axis(axis, log.sample_rate, log.axes[axis]).moves


def check_log(log: Log) -> CheckReport:
    """Look for faults that spoil an identification; the log is not changed.

    Where an axis lacks something that every other check needs, only that is reported.
    """
    findings: list[Finding] = []
    sound: list[Axis] = []
    for name, columns in log.axes.items():
        axis = Axis(name, log.sample_rate, columns)
        basic = list(content.check(axis))
        findings += [*basic, *assumed.check(name, log.metadata)]
        if not basic:
            sound.append(axis)
            for part in (units, timing, breaks, command, outliers, saturation, excitation):
                findings += part.check(axis)
    findings += crossed.check(sound)
    return CheckReport(tuple(findings))
