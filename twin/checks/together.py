"""Logs that are checked together: one that differs from the others in rate, units or size."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from twin.checks.axis import Axis
from twin.checks.channels import SLIPS
from twin.checks.report import WHOLE, Fault, LogFinding, Severity
from twin.logs.log import Log

MAP = "correct it in the import map"


def differences(logs: Mapping[str, Log]) -> Iterator[tuple[str, LogFinding]]:
    """By log, in what it differs from the first that has the axis."""
    first: dict[str, tuple[str, Axis]] = {}
    for name, log in logs.items():
        for axis_name, columns in log.axes.items():
            axis = Axis(axis_name, log.sample_rate, columns)
            if axis_name not in first:
                first[axis_name] = name, axis
                continue
            for severity, fault, what, remedy in _between(axis, *first[axis_name]):
                yield name, LogFinding(severity, fault, axis_name, what, WHOLE, remedy)


def _between(axis: Axis, name: str, other: Axis) -> Iterator[tuple[Severity, Fault, str, str]]:
    """In what an axis differs from that of the log of this name."""
    warning = Severity.WARNING
    if axis.log.kind != other.log.kind:
        kinds = f"it is {axis.log.kind.kind}, in {name} {other.log.kind.kind}"
        yield Severity.ERROR, Fault.UNIT, kinds, MAP
        return
    if axis.sample_rate != other.sample_rate:
        what = f"it is sampled at {axis.sample_rate:g} Hz, {name} at {other.sample_rate:g} Hz"
        remedy = "give twin new and twin frf logs of one rate; a fit averages each at its own"
        yield warning, Fault.UNEVEN, what, remedy
    if not {"position"} <= axis.log.columns.keys() & other.log.columns.keys():
        return
    own, its = float(np.ptp(axis.log.position)), float(np.ptp(other.log.position))
    looks_like = 0.15  # of the logarithm of a slip: how near a ratio of two travels is to it
    near = [
        text
        for size, text in SLIPS.items()
        if own > 0.0 and its > 0.0
        if abs(abs(np.log(own / its)) - np.log(size)) < looks_like
    ]
    unit = axis.log.kind.position
    if near:
        what = f"it travels {own:.3g} {unit}, in {name} {its:.3g} {unit}: it looks like {near[0]}"
        yield warning, Fault.UNIT, what, MAP
