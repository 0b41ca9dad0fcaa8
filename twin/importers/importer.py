"""Foreign files + map -> Log: SI units, one time base, delays removed, motors brought to joints.

    [axes.wrist]
    gear = {elbow = 32.0, wrist = 32.0}     # the wrist's motor turns with both joints

A motor turns by R q, with q the joints' positions and R a row of gear ratios for each motor; as no
power is lost in it, the forces at the joints are R^T times those of the motors.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from twin.errors import InputError, at
from twin.importers import csv_text
from twin.importers.formats import (
    read_hdf5,
    read_json,
    read_mat,
    read_mcap,
    read_parquet,
    read_tdms,
)
from twin.importers.mapping import ImportMap
from twin.importers.table import SignalTable, numbers
from twin.importers.time_base import TimeBase, even_times, rate_of, time_base_of
from twin.logs.container import reading
from twin.logs.log import HELD, Array, AxisLog, Log
from twin.logs.topics import instant, is_calendar
from twin.numbers import independent

Columns = Mapping[str, Array]
Gears = Mapping[str, Mapping[str, float]]  # motor (named as its axis) -> joint -> ratio
FORMATS: Mapping[str, tuple[tuple[str, ...], Callable[[Path, ImportMap], SignalTable]]] = {
    "csv": ((".csv", ".txt", ".tsv", ".dat", ".asc"), csv_text.read),
    "mat": ((".mat",), read_mat),
    "hdf5": ((".h5", ".hdf5", ".hdf", ".he5"), read_hdf5),
    "parquet": ((".parquet", ".pq"), read_parquet),
    "json": ((".json",), read_json),
    "tdms": ((".tdms",), read_tdms),
    "mcap": ((".mcap",), read_mcap),
}
"""Each format by name: how its files end, and what reads them."""


def import_log(path: str | Path | Sequence[str | Path], mapping: ImportMap) -> Log:
    """Read a log of another program as ``mapping`` says; see ``load_mapping``.

    path: the file, or the files in the order of the map's. Samples are in SI, those that delays
    leave without a partner are cut off at the ends. Raises InputError for a missing file, column or
    package, a cell that is not a finite number, columns of different length, and times that are not
    even.
    """
    paths = [Path(p) for p in ([path] if isinstance(path, str | Path) else path)]
    if mapping.files:
        return _of_several(paths, mapping)
    if len(paths) != 1:
        raise InputError(
            f"{len(paths)} files are given; several need a table [[files]] for each in the map"
        )
    with reading(paths[0]):
        table, columns, facts, scalars = _read(paths[0], mapping)
        mapping = mapping.scaled_by(scalars, 1)
        facts |= _start(table, mapping, columns)
        if mapping.resample is None or mapping.time is None:
            return _log(mapping, columns, _sample_rate(table, mapping, columns), facts)
        with at(f"column '{mapping.time.name}'"):
            base = time_base_of(mapping.time.to_si(columns[mapping.time.name]), mapping.resample)
        even = {n: base.resampled(c) for n, c in columns.items() if n != mapping.time.name}
        if not base.leaves_all:
            facts["resampled"] = base.costs(mapping, columns)
        return _log(mapping, even, mapping.resample, facts)


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
    for number, path in enumerate(paths, 1):
        own = mapping.of_file(number)
        with reading(path):
            table, columns, of_file, scalars = _read(path, own)
            own, mapping = (m.scaled_by(scalars, number) for m in (own, mapping))
            times = _times(table, own, columns) + files[number - 1].offset
            bases.append((own, columns, time_base_of(times, rate)))
        facts = {key: ",".join(filter(None, (facts.get(key), of_file[key]))) for key in of_file}
    begin = max(base.times[0] for _, _, base in bases)
    end = min(base.times[-1] for _, _, base in bases)
    if not (end - begin) * rate >= 2.0:
        ends = ((instant(base.times[0]), instant(base.times[-1])) for _, _, base in bases)
        spans = "; ".join(f"{p} {a} to {b}" for p, (a, b) in zip(paths, ends, strict=True))
        raise InputError(f"the files have no time in common ({spans}); correct their offset (s)")
    grid = even_times(begin, end, rate)
    even: dict[str, Array] = {}
    for number, (own, columns, base) in enumerate(bases, 1):
        shared = replace(base, grid=grid)
        if not shared.leaves_all:
            facts[f"resampled_{number}"] = shared.costs(own, columns)
        even |= {c.key: shared.resampled(columns[c.name]) for c in own.columns()}
    if is_calendar(float(grid[0])):
        facts["start_time_unix_ns"] = str(round(float(grid[0]) * 1e9))
    return _log(mapping, even, rate, facts)


def _times(table: SignalTable, mapping: ImportMap, columns: Columns) -> Array:
    """The times (n,) of the rows of one of several files, s."""
    if mapping.time is None:
        rate = _sample_rate(table, mapping, columns)
        return np.arange(_common_length(columns)) / rate
    times = mapping.time.to_si(columns[mapping.time.name])
    start = _start(table, mapping, columns).get("start_time_unix_ns")
    if start is not None and not is_calendar(times[0]):  # dates: seconds since the first
        times = times - times[0] + int(start) * 1e-9
    return times


def table_of(path: Path, mapping: ImportMap) -> SignalTable:
    """The columns that a map names, all where it has no axes; raises InputError."""
    return FORMATS[_format_name(path, mapping)][1](path, mapping)


def _read(
    path: Path, mapping: ImportMap
) -> tuple[SignalTable, Columns, dict[str, str], dict[str, float]]:
    """The table, its columns as numbers, format and sha256 of the file, and scalars by name."""
    name = _format_name(path, mapping)
    with open(path, "rb") as stream:
        digest = hashlib.file_digest(stream, "sha256").hexdigest()
    table = table_of(path, mapping)
    columns = {n: numbers(n, raw) for n, raw in table.columns.items()}
    scalars = {n: _scalar(n, columns[n]) for n in mapping.scalars()}
    for c in mapping.columns():
        if hole := table.hole(c.name, columns[c.name]):
            raise InputError(hole)
    signals = {c.name for c in mapping.columns()} | ({mapping.time.name} if mapping.time else set())
    columns = {n: c for n, c in columns.items() if n in signals}
    _common_length(columns)
    return table, columns, {"original_format": name, "original_sha256": digest}, scalars


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
            if not np.isfinite(signals[field]).all():
                raise InputError(
                    f"axes.{name}.{field} is too large for a number after unit, scale and offset; "
                    "correct them in the map"
                )
        axes[name] = AxisLog(signals, axis.units, axis.force_constant)
    metadata = {"source": "import", "import_map": mapping.text, **facts}
    gears = {name: axis.gear for name, axis in mapping.axes.items() if axis.gear}
    return Log(rate, at_joints(axes, gears), metadata)


def _start(table: SignalTable, mapping: ImportMap, columns: Columns) -> dict[str, str]:
    """When the recording began by the wall clock, where the format or its times say so."""
    start = table.start_ns
    if start is None and mapping.time is not None:
        raw = np.asarray(table.columns[mapping.time.name])
        (first,) = mapping.time.to_si(columns[mapping.time.name][:1])
        if raw.dtype.kind == "M":
            start = int(raw[0].astype("datetime64[ns]").astype(np.int64))
        elif is_calendar(first):
            start = round(float(first) * 1e9)
    return {} if start is None else {"start_time_unix_ns": str(start)}


def _format_name(path: Path, mapping: ImportMap) -> str:
    by_ending = {ending: name for name, (endings, _) in FORMATS.items() for ending in endings}
    name = mapping.format
    if name is None and (name := by_ending.get(path.suffix.lower())) is None:
        raise InputError(
            f"ends in '{path.suffix}', known are {', '.join(by_ending)}; state format in the map: "
            f"{', '.join(FORMATS)}"
        )
    if name not in FORMATS:
        raise InputError(f"the map gives format = '{name}'; allowed: {', '.join(FORMATS)}")
    return name


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


def _sample_rate(table: SignalTable, mapping: ImportMap, columns: Columns) -> float:
    if mapping.time is not None:
        dated = table.columns[mapping.time.name].dtype.kind == "M"
        if dated and mapping.time.seconds != 1.0:
            raise InputError(f"column '{mapping.time.name}' holds dates; state its unit as s")
        with at(f"column '{mapping.time.name}'"):
            return rate_of(mapping.time.to_si(columns[mapping.time.name]))
    if (rate := mapping.sample_rate or table.sample_rate) is None:
        raise InputError(
            "does not state its sample rate; give sample_rate (Hz) or time "
            '({column = "t", unit = "s"}) in the map'
        )
    if table.sample_rate is not None and abs(table.sample_rate - rate) > 1e-6 * rate:
        raise InputError(
            f"is sampled at {table.sample_rate:.9g} Hz, the map says {rate:.9g} Hz; "
            "correct sample_rate in the map or leave it out"
        )
    return rate


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
