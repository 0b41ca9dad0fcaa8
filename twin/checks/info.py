"""What is in a log file: how long, how fast, which axes and signals, how far each of them goes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from twin.checks import check_log
from twin.checks.long import Part, together
from twin.checks.report import CheckReport
from twin.logs.decode import read_parts
from twin.logs.log import Array, Log

PART = 1_000_000  # samples of an axis that are held at once
OWN = ("sample_rate_hz", "axes", "schema_version")  # metadata that are told as something else


@dataclass(frozen=True)
class Channel:
    """A signal of an axis with its unit, its least and its largest value."""

    name: str
    unit: str
    least: float
    most: float


@dataclass(frozen=True)
class AxisInfo:
    """The signals of an axis. kind: linear or rotary; constant: force constant and unit, if any."""

    kind: str
    channels: tuple[Channel, ...]
    constant: tuple[float, str] | None


@dataclass(frozen=True)
class LogInfo:
    """What is in a log. sample_rate: Hz; metadata: what its writer said; check: its findings."""

    samples: int
    sample_rate: float
    axes: Mapping[str, AxisInfo]
    metadata: Mapping[str, str]
    check: CheckReport

    @property
    def duration(self) -> float:
        """Number of samples / sample rate, s."""
        return self.samples / self.sample_rate


def log_info(path: str | Path) -> LogInfo:
    """What is in a log, which is read part by part. Raises InputError where it cannot be read."""
    samples, reports = 0, []
    ranges: dict[tuple[str, str], tuple[float, float]] = {}
    for part in read_parts(path, PART):
        start = samples / part.sample_rate
        samples += len(part)
        reports.append(Part(start, samples / part.sample_rate, check_log(part)))
        for axis, own in part.axes.items():
            for name, column in own.columns.items():
                ranges[axis, name] = _wider(column, ranges.get((axis, name)))
    metadata = {name: value for name, value in part.metadata.items() if name not in OWN}
    axes = {name: _axis(part, name, ranges) for name in part.axes}
    return LogInfo(samples, part.sample_rate, axes, metadata, together(reports))


def _wider(column: Array, known: tuple[float, float] | None) -> tuple[float, float]:
    low, high = float(np.min(column)), float(np.max(column))
    return (low, high) if known is None else (min(low, known[0]), max(high, known[1]))


def _axis(log: Log, name: str, ranges: Mapping[tuple[str, str], tuple[float, float]]) -> AxisInfo:
    own = log.axes[name]
    channels = tuple(Channel(n, own.units[n], *ranges[name, n]) for n in own.columns)
    constant = own.force_constant
    return AxisInfo(
        own.kind.kind, channels, None if constant is None else (constant, own.kind("N/A"))
    )
