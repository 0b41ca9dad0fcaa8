"""A log that is too long for memory: checked, measured and described part by part."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path

import numpy as np

from twin.checks import check_log
from twin.checks.copies import COMPARED, Copy, copies
from twin.checks.report import WHOLE, CheckReport, Fault, LogFinding, Place, Severity
from twin.checks.together import differences
from twin.logs.decode import read_parts, require_intact, samples_by_axis
from twin.logs.log import Log, in_multiples, joined, thinned
from twin.signals import Array

OF_THE_WHOLE = (
    Fault.FLAT,
    Fault.WEAK_EXCITATION,
    Fault.COARSE_POSITION,
    Fault.ALIASED,
)  # not of each part
# Samples, all axes together. A check takes 130 bytes a sample beside 0.1 GB for the program.
LARGEST_PART = 2_500_000
# A fit takes some 75 bytes a sample and more for each millisecond of motion, which no rate changes.
MOST_SAMPLES = 7_500_000
OWN = ("sample_rate_hz", "axes", "schema_version")  # metadata that are told as something else


@dataclass(frozen=True)
class CheckedPart:
    """The report on the samples from ``start`` to ``stop``, s."""

    start: float
    stop: float
    report: CheckReport

    def of_log(self, place: Place) -> Place:
        """When it is in the log, of a place in the part."""
        if place.start is None:
            return Place(self.start, self.stop)
        stop = None if place.stop is None else place.stop + self.start
        return replace(place, start=place.start + self.start, stop=stop)


def together(parts: Sequence[CheckedPart]) -> CheckReport:
    """One report; a fault of an axis is said once, with the first place.

    That an axis stands still or moves one way in a part is none: it counts where all parts say so.
    """
    if len(parts) == 1:
        return parts[0].report
    found: dict[tuple[str, Fault], dict[float, tuple[CheckedPart, LogFinding]]] = {}
    for part in parts:
        for f in part.report.findings:
            found.setdefault((f.axis, f.fault), {}).setdefault(part.start, (part, f))
    said = []
    for (_, fault), seen in found.items():
        if fault not in OF_THE_WHOLE or len(seen) == len(parts):
            said.append(_said(list(seen.values()), len(parts)))
    return CheckReport(tuple(said))


def _said(seen: Sequence[tuple[CheckedPart, LogFinding]], parts: int) -> LogFinding:
    """A fault that was seen in some parts, of its worst severity; of all parts, of its least."""
    told = Severity.WARNING if seen[0][1].fault in OF_THE_WHOLE else Severity.ERROR
    part, first = next(((p, f) for p, f in seen if f.severity is told), seen[0])
    if first.where == WHOLE and len(seen) == parts:
        return first
    return replace(first, where=replace(part.of_log(first.where), parts=len(seen) - 1))


def check_file(path: Path) -> CheckReport:
    """The findings on a whole log, which is read part by part and verified. Raises InputError."""
    reports: list[CheckedPart] = []
    for _ in _checked(_parts(path), reports):
        pass
    require_intact(path)
    return together(reports)


def check_files(paths: Sequence[Path]) -> dict[str, CheckReport]:
    """``check_file`` of each by its name, and which differ from the others or copy one. InputError.

    Of each only what is compared is held; of logs too long for that fewer samples, as for a fit.
    """
    if len(paths) == 1:
        return {str(path): check_file(path) for path in paths}
    every = step_of(paths)
    logs, reports = {}, {}
    for path in paths:
        logs[str(path)], reports[str(path)] = read_checked(path, COMPARED, every)
        require_intact(path)
    told = [(copy.copy, _copy_finding(copy)) for copy in copies(logs)]
    for name, finding in (*told, *differences(logs)):
        findings = reports[name].findings
        reports[name] = replace(reports[name], findings=(*findings, finding))
    return reports


def _copy_finding(copy: Copy) -> LogFinding:
    remedy = "it proves nothing of a fit to that, and fitted beside it counts twice: leave it out"
    return LogFinding(Severity.ERROR, Fault.COPY, copy.axis, str(copy), WHOLE, remedy)


def read_checked(path: Path, fields: Sequence[str], every: int = 1) -> tuple[Log, CheckReport]:
    """``read_measured``, and the findings on the whole log. Raises InputError."""
    reports: list[CheckedPart] = []
    parts = (part.with_fields(fields) for part in _checked(_parts(path), reports))
    return joined(_thinned(parts, every)), together(reports)


def read_measured(path: Path, fields: Sequence[str], every: int = 1) -> Log:
    """The fields of a log at 1/``every`` of its rate. Raises InputError."""
    parts = (part.with_fields(fields) for part in _parts(path, fields))
    return joined(_thinned(parts, every))


def is_thinned(log: Log, path: Path) -> bool:
    """Whether a log that was read of a file has fewer of its samples than it has."""
    return 1.5 * len(log) < max(samples_by_axis(path).values())  # of two samples one at most


def step_of(paths: Iterable[Path]) -> int:
    """Of how many samples one is read, so that all these logs fit into memory together."""
    total = sum(sum(samples_by_axis(path).values()) for path in paths)
    return max(1, -(-total // MOST_SAMPLES))


def _parts(path: Path, fields: Sequence[str] | None = None) -> Iterator[Log]:
    """The log in as few parts of about the same length as memory allows."""
    counts = samples_by_axis(path)
    parts = max(1, -(-sum(counts.values()) // LARGEST_PART))
    return read_parts(path, -(-max(counts.values(), default=1) // parts), fields=fields)


def _checked(parts: Iterable[Log], reports: list[CheckedPart]) -> Iterator[Log]:
    """The parts as they come, with the report on each put into ``reports``."""
    start = 0.0
    for part in parts:
        stop = start + len(part) * part.period
        reports.append(CheckedPart(start, stop, check_log(part)))
        yield part
        start = stop


def _thinned(parts: Iterable[Log], every: int) -> Iterator[Log]:
    """The parts at a lower rate; what does not fill a step at the end of one goes to the next."""
    coming = iter(parts)
    first = next(coming)
    longest_step = 5e-4  # s: two in a block of motion; with one the residual is half as large again
    step = max(1, min(every, int(longest_step * first.sample_rate * (1.0 + 1e-9))))
    return (thinned(part, step) for part in in_multiples(chain([first], coming), step))


@dataclass(frozen=True)
class Channel:
    """A signal of an axis with its unit.

    course (2 k,): least and largest value of k parts of the log of one length, in turn.
    """

    name: str
    unit: str
    course: Array

    @property
    def least(self) -> float:
        """Its least value."""
        return float(self.course.min())

    @property
    def most(self) -> float:
        """Its largest value."""
        return float(self.course.max())


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
    samples = 0
    reports: list[CheckedPart] = []
    seen: dict[tuple[str, str], list[Array]] = {}
    for part in _checked(_parts(Path(path)), reports):
        samples += len(part)
        for axis, own in part.axes.items():
            for name, column in own.columns.items():
                seen.setdefault((axis, name), []).append(_envelope(column))
    axes = {}
    for axis, own in part.axes.items():
        whole = {n: _envelope(np.concatenate(seen[axis, n])) for n in own.columns}
        channels = tuple(Channel(n, own.unit(n), course) for n, course in whole.items())
        constant = own.force_constant
        stated = None if constant is None else (constant, own.kind("N/A"))
        axes[axis] = AxisInfo(own.kind.kind, channels, stated)
    metadata = {name: value for name, value in part.metadata.items() if name not in OWN}
    return LogInfo(samples, part.sample_rate, axes, metadata, together(reports))


def _envelope(column: Array, parts: int = 100) -> Array:
    """Least and largest value (2 k,) of so many parts of a column (n,), in turn."""
    begun = np.unique(np.linspace(0, len(column), parts, endpoint=False).astype(int))
    ends = (np.minimum.reduceat(column, begun), np.maximum.reduceat(column, begun))
    return np.stack(ends, axis=1).ravel()
