"""Foreign files + map -> Log: SI units, one time base, delays removed, motors brought to joints.

    [axes.wrist]
    gear = {elbow = 32.0, wrist = 32.0}     # the wrist's motor turns with both joints

A motor turns by R q, with q the joints' positions and R a row of gear ratios for each motor; as no
power is lost in it, the forces at the joints are R^T times those of the motors.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid

from twin.errors import InputError, at
from twin.importers.counters import find_wraps, unwrapped
from twin.importers.dialects import all_dialects, find_dialect
from twin.importers.mapping import ImportMap, load_mapping
from twin.importers.own_rows import bridged
from twin.importers.stamps import with_times
from twin.importers.stated_rate import SAME, StatedRate, stated_rate
from twin.importers.table import SignalTable, as_numbers, numbers
from twin.importers.time_base import (
    TimeBase,
    even_times,
    order_of,
    rate_of,
    repeated_rows,
    time_base_of,
    times_of,
)
from twin.logs.container import reading, require_fetched
from twin.logs.log import HELD, Array, AxisLog, Log
from twin.logs.topics import instant, is_calendar
from twin.numbers import independent

Columns = Mapping[str, Array]
Gears = Mapping[str, Mapping[str, float]]  # motor (named as its axis) -> joint -> ratio
_NOTE = "note_"  # entries of a log's metadata: what was done as it was imported


def import_log(path: str | Path | Sequence[str | Path], mapping: ImportMap | str | Path) -> Log:
    """Read a log of another program as ``mapping`` says; see ``load_mapping``.

    path: the file, or the files in the order of the map's. mapping: the map, or its file. Samples
    are in SI, those that delays leave without a partner are cut off at the ends. Raises InputError
    for a missing file, column or package, a cell that is not a finite number, columns of different
    length, and times that are not even.
    """
    paths = [Path(p) for p in ([path] if isinstance(path, str | Path) else path)]
    mapping = mapping if isinstance(mapping, ImportMap) else load_mapping(mapping)
    if mapping.files:
        return _of_several(paths, mapping)
    if len(paths) != 1:
        raise InputError(
            f"{len(paths)} files are given; several need a table [[files]] for each in the map"
        )
    with reading(paths[0]), _counted(mapping):
        recording = _read(paths[0], mapping)
        mapping = mapping.scaled_by(recording.scalars, 1)
        columns, facts = recording.columns, recording.facts
        if mapping.resample is None or recording.times is None:
            return _log(mapping, columns, recording.rate(mapping), facts)
        with recording.at_time(mapping):
            base = time_base_of(recording.times, mapping.resample)
        even = {n: base.resampled(c) for n, c in columns.items()}
        if not base.leaves_all:
            facts["resampled"] = base.costs(mapping, columns)
        return _log(mapping, even, mapping.resample, facts)


@contextmanager
def _counted(mapping: ImportMap) -> Iterator[None]:
    """Say in an error from where its rows count, where a map takes a part of them."""
    if mapping.rows is None:
        yield
        return
    with at("rows {} to {}, the first of them as row 1".format(*mapping.rows)):
        yield


def import_notes(log: Log) -> list[str]:
    """What was done to a recording as it was imported, a sentence each."""
    return [v for k, v in log.metadata.items() if k.startswith((_NOTE, "resampled"))]


def _of_several(paths: Sequence[Path], mapping: ImportMap) -> Log:
    files = mapping.files or []
    rate = mapping.resample or next(iter(f.sample_rate for f in files), None)  # that of all
    if len(paths) != len(files):
        raise InputError(
            f"{len(paths)} files are given, the map has {len(files)} [[files]] tables; "
            "give one for each, in the same order"
        )
    assert rate is not None
    bases: list[tuple[ImportMap, Columns, TimeBase]] = []
    facts: dict[str, str] = {}
    since: int | None = None  # ns: a clock's zero, from which a time in s keeps its digits
    for number, path in enumerate(paths, 1):
        own = mapping.of_file(number)
        with reading(path), _counted(own):
            recording = _read(path, own)
            own, mapping = (m.scaled_by(recording.scalars, number) for m in (own, mapping))
            since = recording.start if since is None else since
            times = recording.times_since(since, own) + files[number - 1].offset
            with recording.at_time(own):
                bases.append((own, recording.columns, time_base_of(times, rate)))
        for key, fact in recording.facts.items():
            if key.startswith(_NOTE):
                facts[f"{_NOTE}{number}_{key.removeprefix(_NOTE)}"] = f"{path.name}: {fact}"
            else:
                facts[key] = ",".join(filter(None, (facts.get(key), fact)))
    zero = (since or 0) * 1e-9
    begin = max(base.times[0] for _, _, base in bases)
    end = min(base.times[-1] for _, _, base in bases)
    if not (end - begin) * rate >= 2.0:
        ends = ([instant(zero + base.times[i]) for i in (0, -1)] for _, _, base in bases)
        spans = "; ".join(f"{p} {a} to {b}" for p, (a, b) in zip(paths, ends, strict=True))
        raise InputError(f"the files have no time in common ({spans}); correct their offset (s)")
    grid = even_times(begin, end, rate)
    even: dict[str, Array] = {}
    for number, (own, columns, base) in enumerate(bases, 1):
        shared = replace(base, grid=grid)
        if not shared.leaves_all:
            facts[f"resampled_{number}"] = shared.costs(own, columns)
        even |= {c.key: shared.resampled(columns[c.name]) for c in own.columns()}
    if is_calendar(zero + float(grid[0])):
        facts["start_time_unix_ns"] = str((since or 0) + round(float(grid[0]) * 1e9))
    return _log(mapping, even, rate, facts)


@dataclass(frozen=True)
class _Recording:
    """A file as it was read: its signals by column, times (n,) in s, None where it has none.

    facts: for the metadata of the log. scalars: the values that scales name.
    """

    table: SignalTable
    columns: Columns
    times: Array | None
    facts: dict[str, str]
    scalars: Mapping[str, float]

    @contextmanager
    def at_time(self, mapping: ImportMap) -> Iterator[None]:
        """Name the column of the times in an error, and offer another that would do."""
        if mapping.time is None:
            yield
            return
        try:
            with at(f"column '{mapping.time.name}'"):
                yield
        except InputError as error:
            own = mapping.time.name
            rows = len(self.table.columns[own])
            clocks = {
                n: c for n, c in self.table.calendar_times.items() if len(c) == rows and n != own
            }
            others = [name for name, c in clocks.items() if _rises(c)]
            hint = f"; the times of '{others[0]}' rise: take these" if others else ""
            raise InputError(f"{error}{hint}") from error

    def rate(self, mapping: ImportMap) -> float:
        """Its sample rate in Hz; raises InputError where it is not known or not even."""
        stated = stated_rate(self.table.notes)
        if self.times is not None:
            with self.at_time(mapping):
                rate = rate_of(self.times)
            self._compare(stated, rate, "its times give")
            return rate
        given, own = mapping.sample_rate, self.table.sample_rate
        rate = given or own or (stated.rate if stated else None) or 0.0
        if not rate:
            raise InputError(
                "does not state its sample rate; give sample_rate (Hz) or time "
                '({column = "t", unit = "s"}) in the map'
            )
        if own is not None and abs(own - rate) > 1e-6 * rate:
            raise InputError(
                f"is sampled at {own:.9g} Hz, the map says {rate:.9g} Hz; "
                "correct sample_rate in the map or leave it out"
            )
        self._compare(stated, rate, "the map says")
        return rate

    def _compare(self, stated: StatedRate | None, rate: float, what: str) -> None:
        """Tell where a line of the file states another rate, which may be of another clock."""
        if stated is not None and stated.rate and abs(stated.rate / rate - 1.0) > SAME:
            self.facts[f"{_NOTE}rate"] = (
                f"the file states {stated.rate:.6g} Hz ({stated.text!r}), {what} {rate:.6g} Hz"
            )

    @property
    def start(self) -> int:
        """When it began, ns since 1970; 0 where that is not known."""
        return int(self.facts.get("start_time_unix_ns", 0))

    def times_since(self, zero: int, mapping: ImportMap) -> Array:
        """The times (n,) of its rows in s since ``zero`` (ns), by the calendar if it is known."""
        times = self.times
        if times is None:
            times = np.arange(_common_length(self.columns)) / self.rate(mapping)
        if self.start and not is_calendar(times[0]):  # dates: seconds since the first
            return times - times[0] + (self.start - zero) * 1e-9
        return times - zero * 1e-9


def _rises(column: NDArray) -> bool:
    return bool(len(column) > 1 and (np.diff(column.astype(np.int64)) > 0).all())


def table_of(path: Path, mapping: ImportMap) -> SignalTable:
    """The columns that a map names, all where it has no axes; raises InputError."""
    require_fetched(path)
    return _table(path, mapping, find_dialect(path, mapping.format))


def _table(path: Path, mapping: ImportMap, dialect: str) -> SignalTable:
    table = all_dialects()[dialect].read(path, mapping)
    columns = {n: as_numbers(c) for n, c in with_times(table.columns).items()}
    table = replace(table, columns=columns)
    return table.part(*mapping.rows) if mapping.rows else table


def _read(path: Path, mapping: ImportMap) -> _Recording:
    """What a map names of a file; raises InputError."""
    require_fetched(path)
    name = find_dialect(path, mapping.format)
    with open(path, "rb") as stream:
        digest = hashlib.file_digest(stream, "sha256").hexdigest()
    table = _table(path, mapping, name)
    facts = {"original_format": name, "original_sha256": digest}
    scalars = {n: _scalar(n, numbers(n, table.columns[n])) for n in mapping.scalars()}
    parts = {n: numbers(n, table.columns[n]) for c in mapping.columns() for n in c.parts}
    _common_length(parts)
    columns = {c.name: c.raw(parts) for c in mapping.columns()}
    said: list[str] = list(table.said)
    times: Array | None = None
    holes = [hole for n, column in columns.items() if (hole := table.hole(n, column))]
    if holes and (mapping.resample is None or mapping.time is None):
        raise InputError("; ".join(holes))
    for axis, field, c in mapping.signals():
        found = find_wraps(columns[c.name])
        if c.wraps is None and found is not None:
            facts[f"counter.{axis}.{field}"] = found.described(c.name)
        elif c.wraps is not None:
            said.append(f"column '{c.name}': a counter that begins again after {c.wraps:g} goes on")
            columns[c.name] = unwrapped(columns[c.name], c.wraps)
    _common_length(columns)
    if mapping.time is not None:
        raw = mapping.time.raw(table.columns)
        if raw.dtype.kind in "Mm" and mapping.time.seconds != 1.0:
            raise InputError(f"column '{mapping.time.name}' holds dates; state its unit as s")
        times, jumps = times_of(mapping.time.name, raw, mapping.time.seconds)
        said += jumps
        _common_length({**columns, mapping.time.name: times})
        facts |= _start(table, raw, times)
        if (order := order_of(times)) is not None:
            back = np.flatnonzero(np.diff(times) < 0.0)
            first, out = back[0] + 2, len(back)
            times, columns = times[order], {n: c[order] for n, c in columns.items()}
            said.append(f"rows out of order in {out} places, the first row {first}; put in order")
        if holes:
            times, columns = bridged(times, columns)
            said += [f"{hole.partition(';')[0]}; bridged by a straight line" for hole in holes]
        again = repeated_rows(columns, times)
        if mapping.resample is None and len(again):  # a clock leaves them out, and tells
            times, columns = np.delete(times, again), {
                n: np.delete(c, again) for n, c in columns.items()}  # fmt: skip
            rows = f"row {again[0] + 1}" + f" and {len(again) - 1} more" * (len(again) > 1)
            said.append(f"{rows}: what the row before says, once more; left out")
    elif table.start_ns is not None:
        facts["start_time_unix_ns"] = str(table.start_ns)
    facts |= {f"{_NOTE}{k}": text for k, text in enumerate(said, 1)}
    return _Recording(table, columns, times, facts, scalars)


def _scalar(name: str, values: Array) -> float:
    """The value of a column with one alone; raises InputError."""
    if len(values) and np.ptp(values) == 0.0 and values[0] != 0.0 and np.isfinite(values[0]):
        return float(values[0])
    low, high = (float(f(values, initial=np.nan)) for f in (np.fmin.reduce, np.fmax.reduce))
    raise InputError(
        f"scale = '{name}': holds {low:g} to {high:g}; name a scalar of the file other than 0, or "
        "give a number"
    )


def _log(mapping: ImportMap, columns: Columns, rate: float, facts: Mapping[str, str]) -> Log:
    """The log of columns that are sampled at ``rate`` (Hz); raises InputError."""
    count = _common_length(columns)
    delays = [c.delay_samples for c in mapping.columns()]
    # samples for which every column, moved back by its delay, has a value
    span = range(max(0, -min(delays)), count - max(0, *delays))
    if len(span) < 2:
        raise InputError(
            f"delay_samples of {min(delays)} to {max(delays)} leave nothing of {count} rows; "
            "correct them in the map"
        )
    axes = {}
    for name, axis in mapping.axes.items():
        signals = {}
        for field, c in axis.columns.items():
            rows = slice(span.start + c.delay_samples, span.stop + c.delay_samples)
            signals[field] = c.to_si(columns[c.key][rows])
            if c.integrated:
                signals[field] = cumulative_trapezoid(signals[field], dx=1.0 / rate, initial=0.0)
            if axis.side_of(field) == "load":  # what at_joints brings to the load is the motor's
                (ratio,) = axis.ratios(name).values()
                signals[field] = signals[field] * (1.0 / ratio if field in HELD else ratio)
            if not np.isfinite(signals[field]).all():
                raise InputError(
                    f"axes.{name}.{field} is too large for a number after unit, scale and offset; "
                    "correct them in the map"
                )
        axes[name] = AxisLog(signals, axis.units, axis.force_constant)
    metadata = {"source": "import", "import_map": mapping.text, **facts}
    gears = {name: gear for name, axis in mapping.axes.items() if (gear := axis.ratios(name))}
    return Log(rate, at_joints(axes, gears), metadata)


def _start(table: SignalTable, raw: NDArray, times: Array) -> dict[str, str]:
    """When the recording began by the wall clock, where the format or its times say so."""
    start = table.start_ns
    if start is None and raw.dtype.kind == "M" and len(raw):
        start = int(raw[0].astype("datetime64[ns]").astype(np.int64))
    elif start is None and raw.dtype.kind != "m" and len(times) and is_calendar(times[0]):
        start = round(float(times[0]) * 1e9)
    return {} if start is None else {"start_time_unix_ns": str(start)}


def _common_length(columns: Columns) -> int:
    first, values = next(iter(columns.items()))
    for name, other in columns.items():
        if len(other) != len(values):
            raise InputError(
                f"column '{first}' has {len(values)} rows, '{name}' has {len(other)}; "
                "export them with one time base"
            )
    if len(values) < 2:
        raise InputError(f"has {len(values)} rows; a log has at least 2")
    return len(values)


def at_joints(axes: Mapping[str, AxisLog], gears: Gears) -> dict[str, AxisLog]:
    """The axes with their motors' signals brought to the joints; gears: of those that have some.

    Raises InputError where the ratios cannot be inverted, and where a signal is there of one of two
    coupled axes alone.
    """
    if not gears:
        return dict(axes)
    names = list(axes)
    ratios = np.eye(len(names))
    for motor, row in gears.items():
        unknown = [joint for joint in row if joint not in axes]
        if unknown:
            raise InputError(
                f"axes.{motor}.gear: the map has no axis '{unknown[0]}'; it has {', '.join(names)}"
            )
        ratios[names.index(motor)] = [row.get(joint, 0.0) for joint in names]
    if not independent(ratios):
        raise InputError(
            "gear: the motors of the map do not tell all joints, as their ratios depend on each "
            "other; give each motor its own joint"
        )
    driven = {}
    for name, axis in axes.items():  # the force in the place of the current: forces are added
        columns = {f: c for f, c in axis.columns.items() if f not in HELD}
        columns["force"] = axis.force
        driven[name] = replace(axis, columns=columns, force_constant=None)
    out: dict[str, dict[str, Array]] = {name: {} for name in names}
    for field in dict.fromkeys(f for axis in driven.values() for f in axis.columns):
        matrix = ratios.T if field in HELD else np.linalg.inv(ratios)
        for i, name in enumerate(names):
            if field in driven[name].columns:
                out[name][field] = _sum(field, matrix[i], driven)
    return {name: replace(driven[name], columns=columns) for name, columns in out.items()}


def _sum(field: str, row: Array, axes: Mapping[str, AxisLog]) -> Array:
    parts = []
    for factor, (name, axis) in zip(row, axes.items(), strict=True):
        if abs(factor) > 1e-12 * np.abs(row).max():
            if field not in axis.columns:
                raise InputError(
                    f"axes.{name}: has no {field}, but is coupled by a gear to an axis that has; "
                    "map it, or leave it out of both"
                )
            parts.append(factor * axis.columns[field])
    return np.asarray(sum(parts))
