"""Whether a log can be checked at all: signals, finite numbers, duration, motion."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from twin.log.check.axis import Axis
from twin.log.check.report import Fault, Finding, Severity
from twin.signals import Array

SHORTEST = 1.0  # s, least duration for identification


def check(axis: Axis) -> Iterator[Finding]:
    """Findings without which no other check makes sense."""
    yield from _missing(axis)
    yield from _not_finite(axis)
    yield from _flat(axis)
    if axis.duration < SHORTEST:
        yield Finding(
            Severity.ERROR,
            Fault.TOO_SHORT,
            axis.name,
            f"the log lasts {axis.duration:.3g} s, a fit needs {SHORTEST:g} s",
            "whole log",
            "record longer",
        )


def _missing(axis: Axis) -> Iterator[Finding]:
    columns = axis.log.columns
    commanded = "force" in columns or ("current" in columns and axis.log.force_constant)
    lengths = {name: len(column) for name, column in columns.items()}
    faults = {
        "there is no position": ("position" not in columns, "record the encoder"),
        "there is no force, nor a current with a force constant": (
            not commanded,
            f"add the command, or force_constant ({axis.log.kind('N/A')}) to the axis",
        ),
        f"the columns differ in length ({', '.join(f'{n} {k}' for n, k in lengths.items())})": (
            len(set(lengths.values())) > 1,
            "record all with one clock",
        ),
    }
    for what, (faulty, remedy) in faults.items():
        if faulty:
            yield Finding(
                Severity.ERROR, Fault.INCOMPLETE, axis.name, what, "whole log", remedy
            )  # fmt: skip


def _not_finite(axis: Axis) -> Iterator[Finding]:
    for name, column in axis.log.columns.items():
        bad = np.flatnonzero(~np.isfinite(column))
        if len(bad):
            yield Finding(
                Severity.ERROR,
                Fault.NOT_FINITE,
                axis.name,
                f"{name} is not a finite number in {len(bad)} of {len(column)} samples",
                f"from {bad[0] / axis.sample_rate:.6g} s",
                "cut the log there, or leave the signal out if it was not recorded",
            )


def _flat(axis: Axis) -> Iterator[Finding]:
    columns = axis.log.columns
    for name in ("position", "velocity", "current", "force"):
        if not _is_flat(columns.get(name)):
            continue
        idle = name in ("position", "velocity") and _is_flat(columns.get("setpoint_position"))
        yield Finding(
            Severity.WARNING if idle else Severity.ERROR,
            Fault.WEAK_EXCITATION if idle else Fault.FLAT,
            axis.name,
            f"{name} is {columns[name][0]:.6g} {axis.log.units[name]} throughout",
            "whole log",
            "leave the axis out of the fit"
            if idle
            else "check that the channel was connected and mapped",
        )


def _is_flat(column: Array | None) -> bool:
    return column is not None and len(column) > 0 and bool(np.all(column == column[0]))
