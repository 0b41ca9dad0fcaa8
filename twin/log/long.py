"""Logs that are too long to be held in memory: checked in parts, and read at a lower rate."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from twin.log.check import check_log
from twin.log.check.parts import Part, together
from twin.log.check.report import CheckReport
from twin.log.decode import read_parts, samples_by_axis, verified_parts
from twin.log.log import Log, joined
from twin.log.thin import thinned

# Samples, all axes together. A check takes 130 bytes a sample beside 0.1 GB for the program.
LARGEST_PART = 2_500_000
# A fit takes some 75 bytes a sample and more for each millisecond of motion, which no rate changes.
MOST_SAMPLES = 7_500_000
LONGEST_STEP = 5e-4  # s: two in a block of motion; with one the residual is half as large again


def check_file(path: Path) -> CheckReport:
    """The findings on a whole log, which is read part by part and verified. Raises InputError."""
    reports: list[Part] = []
    for _ in _checked(verified_parts(path, _part_samples(path)), reports):
        pass
    return together(reports)


def read_checked(path: Path, fields: Sequence[str], every: int = 1) -> tuple[Log, CheckReport]:
    """The fields of a log at 1/``every`` of its rate, and the findings on the whole of it.

    Raises InputError.
    """
    reports: list[Part] = []
    parts = (part.with_fields(fields) for part in _checked(_parts(path), reports))
    return joined(_thinned(parts, every)), together(reports)


def read_measured(path: Path, fields: Sequence[str], every: int = 1) -> Log:
    """The fields of a log at 1/``every`` of its rate. Raises InputError."""
    parts = (part.with_fields(fields) for part in _parts(path, fields))
    return joined(_thinned(parts, every))


def step_of(paths: Iterable[Path]) -> int:
    """Of how many samples one is read, so that all these logs fit into memory together."""
    total = sum(sum(samples_by_axis(path).values()) for path in paths)
    return max(1, -(-total // MOST_SAMPLES))


def _parts(path: Path, fields: Sequence[str] | None = None) -> Iterator[Log]:
    """The log in as few parts of about the same length as memory allows."""
    return read_parts(path, _part_samples(path), fields=fields)


def _part_samples(path: Path) -> int:
    """Samples of such a part."""
    counts = samples_by_axis(path)
    parts = max(1, -(-sum(counts.values()) // LARGEST_PART))
    return -(-max(counts.values(), default=1) // parts)


def _checked(parts: Iterable[Log], reports: list[Part]) -> Iterator[Log]:
    """The parts as they come, with the report on each put into ``reports``."""
    start = 0.0
    for part in parts:
        stop = start + len(part) * part.period
        reports.append(Part(start, stop, check_log(part)))
        yield part
        start = stop


def _thinned(parts: Iterable[Log], every: int) -> Iterator[Log]:
    """The parts at a lower rate; what does not fill a step at the end of one goes to the next."""
    held: Log | None = None
    for part in parts:
        whole = part if held is None else joined([held, part])
        step = max(1, min(every, int(LONGEST_STEP * whole.sample_rate * (1.0 + 1e-9))))
        count = len(whole) // step * step
        held = whole.part(count, len(whole)).copied() if count < len(whole) else None
        yield thinned(whole.part(0, count), step)
