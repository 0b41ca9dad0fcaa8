"""Logs that are checked together: one that differs from the others in rate, units, size or mass."""

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
    elif ratio := _masses_apart(axis, other):
        what = f"force and acceleration are as of {ratio:.3g} times the mass that {name} shows"
        remedy = "check its force, or fit logs with another load apart"
        yield warning, Fault.UNIT, what, remedy


def _masses_apart(axis: Axis, other: Axis) -> float:
    """The ratio of what both logs show of the mass; 0 where it is not told, or about the same."""
    if not (_is_whole(axis) and _is_whole(other) and axis.moves and other.moves):
        return 0.0
    one, two = axis.dynamics, other.dynamics
    told = all(fit.explains and fit.mass_matters and fit.mass for fit in (one, two))
    ratio = one.mass / two.mass if told and one.mass and two.mass else 1.0
    about = 1.5  # times the other, up to which so rough a mass is the same
    return ratio if ratio > 0.0 and not 1.0 / about < ratio < about else 0.0


def _is_whole(axis: Axis) -> bool:
    """Whether the log has a force and is long enough for a regression."""
    columns = axis.log.columns
    driven = "force" in columns or ("current" in columns and axis.log.force_constant)
    finite = all(np.isfinite(c).all() for c in columns.values())
    shortest = 0.5  # s, least duration for identification
    return bool(driven) and finite and axis.duration > shortest
