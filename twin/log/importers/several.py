"""Recordings of one motion in several files, each with a clock of its own, onto one clock."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from twin.errors import InputError
from twin.log.container import reading
from twin.log.importers.mapping import ImportMap
from twin.log.importers.resample import Clock, clock_of
from twin.log.instants import instant
from twin.log.log import Array

Read = Callable[[Path, ImportMap], tuple[Mapping[str, Array], Array, str]]
"""Columns by name, their times (n,) in s, and the sha256 of a file."""


@dataclass(frozen=True)
class Together:
    """columns: by ColumnMap.key, on one clock; digests: sha256 by file; notes: what it cost."""

    columns: Mapping[str, Array]
    digests: tuple[str, ...]
    notes: Mapping[str, str]
    start: float


def read_together(paths: Sequence[Path], mapping: ImportMap, read: Read) -> Together:
    """The columns of all files where all have samples; raises InputError."""
    if len(paths) != len(mapping.files):
        raise InputError(
            f"{len(paths)} files are given, the map has {len(mapping.files)} [[files]] tables; "
            "give one for each, in the same order"
        )
    assert mapping.resample is not None
    clocks: list[tuple[ImportMap, Mapping[str, Array], Clock]] = []
    digests = []
    for number, path in enumerate(paths, 1):
        own = mapping.of_file(number)
        with reading(path):
            columns, times, digest = read(path, own)
            times = times + mapping.files[number - 1].offset
            clocks.append((own, columns, clock_of(times, mapping.resample)))
            digests.append(digest)
    grid = _common(paths, [clock for _, _, clock in clocks], mapping.resample)
    out, notes = {}, {}
    for number, (own, columns, clock) in enumerate(clocks, 1):
        shared = replace(clock, grid=grid)
        notes[f"resampled_{number}"] = shared.costs(own, columns)
        for c in mapping.columns():
            if c.file == number:
                out[c.key] = shared.resampled(columns[c.column])
    return Together(out, tuple(digests), notes, float(grid[0]))


def _common(paths: Sequence[Path], clocks: Sequence[Clock], rate: float) -> Array:
    """The even times that lie in all files."""
    begin = max(clock.times[0] for clock in clocks)
    end = min(clock.times[-1] for clock in clocks)
    if not (end - begin) * rate >= 2.0:
        spans = "; ".join(
            f"{path} {instant(clock.times[0])} to {instant(clock.times[-1])}"
            for path, clock in zip(paths, clocks, strict=True)
        )
        raise InputError(f"the files have no time in common ({spans}); correct their offset (s)")
    count = int((end - begin) * rate * (1.0 + 1e-12)) + 1
    return np.asarray(begin + np.arange(count) / rate)
