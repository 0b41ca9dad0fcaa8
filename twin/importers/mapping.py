"""The import map: which column of a foreign file is which signal, in which unit.

    sample_rate = 1000.0                  # Hz; or time = {column = "t", unit = "s"}
    resample = 1000.0                     # Hz, with a time whose stamps are uneven
    [axes.x]
    force_constant = 53.4                 # N/A, optional
    position = {column = "qm", unit = "mm"}
    force = {column = "drive", unit = "V", scale = 35.15}     # N a volt

Several files are given in the order of [[files]] tables, each with time or sample_rate and an
offset (s) that is added to its times; a column of the second one says file = 2.

SI value = sign x (scale x raw + offset) x unit. A quantity in volts or counts is brought to SI by
its scale, and its offset is in SI. ``delay_samples``: by how many whole samples the column was
recorded too late; it is moved back by as many.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from twin.entries import read_entries, toml_document
from twin.errors import InputError, at
from twin.importers.units import Unit, field_unit, find_unit
from twin.logs.container import reading
from twin.logs.log import FIELDS, LINEAR_UNITS, ROTARY_UNITS, Array

if TYPE_CHECKING:
    from twin.importers.map_schema import ColumnEntry, MapFile, TimeEntry


@dataclass(frozen=True)
class ColumnMap:
    """How a column becomes a signal; unit: of the column, file: from 1, the rest as in the map."""

    column: str
    unit: Unit
    scale: float = 1.0
    offset: float = 0.0
    sign: int = 1
    delay_samples: int = 0
    file: int = 1

    @property
    def key(self) -> str:
        """A name that no column of another file has."""
        return self.column if self.file == 1 else f"{self.file}:{self.column}"

    def to_si(self, raw: Array) -> Array:
        """Values (n,) of the column in SI."""
        factor = self.sign * self.unit.size
        with np.errstate(over="ignore", invalid="ignore"):  # what is too large is refused later
            return np.asarray(factor * self.scale * raw + factor * self.offset)


@dataclass(frozen=True)
class AxisMap:
    """Signals of one axis: field of the log -> column; force_constant in N/A (N m/A) or None."""

    columns: Mapping[str, ColumnMap]
    force_constant: float | None = None

    @property
    def units(self) -> Mapping[str, str]:
        """SI unit of every field."""
        return ROTARY_UNITS if self._has(ROTARY_UNITS) else LINEAR_UNITS

    def require_one_kind(self) -> None:
        """Raises InputError where some signals are those of a linear, others of a rotary axis."""
        linear, rotary = self._has(LINEAR_UNITS), self._has(ROTARY_UNITS)
        if linear and rotary:
            raise InputError(
                f"{linear[0]} has a linear unit, {rotary[0]} a rotary one; give both of one kind "
                'with unit = "counts" and a scale in SI a count'
            )

    def _has(self, units: Mapping[str, str]) -> list[str]:
        return [f for f, c in self.columns.items() if c.unit.si == units[f] != "A"]


@dataclass(frozen=True)
class CsvLayout:
    """What the map states of a text file; None: found in the file. header_line counts from 1."""

    delimiter: str | None = None
    decimal: str | None = None
    header_line: int | None = None


@dataclass(frozen=True)
class FileMap:
    """One of several files. At most one of sample_rate (Hz) and time; offset: s."""

    sample_rate: float | None
    time: ColumnMap | None
    format: str | None
    offset: float


@dataclass(frozen=True)
class ImportMap:
    """A whole map. At most one of sample_rate (Hz) and time. files: where there are several.

    resample: Hz of the clock that uneven times are brought onto. text: the map as it was written.
    """

    axes: Mapping[str, AxisMap]
    sample_rate: float | None = None
    time: ColumnMap | None = None
    format: str | None = None
    csv: CsvLayout = CsvLayout()
    text: str = ""
    resample: float | None = None
    files: tuple[FileMap, ...] = ()

    def columns(self) -> list[ColumnMap]:
        """The columns of all signals."""
        return [c for axis in self.axes.values() for c in axis.columns.values()]

    def of_file(self, number: int) -> ImportMap:
        """The map of one of several files; raises InputError where no signal is in it."""
        own = self.files[number - 1]
        axes = {
            name: replace(axis, columns={f: c for f, c in axis.columns.items() if c.file == number})
            for name, axis in self.axes.items()
        }
        if not any(axis.columns for axis in axes.values()):
            raise InputError(f"the map has no signal with file = {number}; leave that file out")
        return replace(
            self, axes=axes, files=(), sample_rate=own.sample_rate, time=own.time,
            format=own.format or self.format,
        )  # fmt: skip

    def column_names(self) -> tuple[str, ...]:
        """The columns that are read, each once."""
        every = [self.time, *self.columns()] if self.time else self.columns()
        return tuple(dict.fromkeys(c.column for c in every))


def load_mapping(path: str | Path) -> ImportMap:
    """Read a map; raises InputError naming the file, the entry and what is allowed."""
    from twin.importers.map_schema import MapFile  # its library takes 0.1 s to load

    path = Path(path)
    with reading(path):
        text, document = toml_document(path)
        if not document.get("axes"):
            raise InputError("has no [axes.<name>] table; name at least one axis, as in [axes.x]")
        return _map(read_entries(MapFile, document), text)


def _map(entries: MapFile, text: str) -> ImportMap:
    if entries.time is not None and entries.sample_rate is not None:
        raise InputError("sample_rate and time are both given; give one of them")
    if entries.files is not None:
        _require_files(entries)
    elif entries.resample is not None and entries.time is None:
        raise InputError('resample needs the times; give time = {column = "t", unit = "s"} too')
    axes = {name: _axis(name, entry) for name, entry in entries.axes.items()}
    files = tuple(
        FileMap(f.sample_rate, _time(f.time), f.format, f.offset) for f in entries.files or ()
    )
    most = max(c.file for axis in axes.values() for c in axis.columns.values())
    if most > max(len(files), 1):
        raise InputError(f"file = {most}: the map has {len(files)} [[files]] tables; add one")
    return ImportMap(
        axes=axes,
        sample_rate=entries.sample_rate,
        time=_time(entries.time),
        format=entries.format,
        csv=CsvLayout(entries.delimiter, entries.decimal, entries.header_line),
        text=text,
        resample=entries.resample,
        files=files,
    )


def _require_files(entries: MapFile) -> None:
    if entries.time is not None or entries.sample_rate is not None:
        raise InputError("time and sample_rate are those of each file; give them under [[files]]")
    if entries.resample is None:
        raise InputError("several files have several clocks; give resample (Hz), their common one")
    for number, file in enumerate(entries.files or (), 1):
        if (file.time is None) == (file.sample_rate is None):
            raise InputError(f"files {number}: give either time or sample_rate (Hz)")


def _time(entry: TimeEntry | None) -> ColumnMap | None:
    if entry is None:
        return None
    with at("time"):
        return ColumnMap(str(entry.column), find_unit(entry.unit, "s"))


def _axis(name: str, entry: Any) -> AxisMap:
    with at(f"axes.{name}"):
        columns = {}
        for field in FIELDS:
            if (column := getattr(entry, field)) is not None:
                with at(field):
                    columns[field] = _column(column, field)
        if "position" not in columns or not {"current", "force"} & set(columns):
            raise InputError("an axis needs position and one of current and force; map both")
        axis = AxisMap(columns, entry.force_constant)
        axis.require_one_kind()
        return axis


def _column(entry: ColumnEntry, field: str) -> ColumnMap:
    unit = field_unit(field, entry.unit)
    if unit.si is None and "scale" not in entry.model_fields_set:
        raise InputError(f"unit '{entry.unit}' needs a scale: how much one of it is in SI")
    if entry.scale == 0.0:
        raise InputError("scale = 0: give a number other than 0")
    return ColumnMap(
        str(entry.column), unit, entry.scale, entry.offset, entry.sign, entry.delay_samples,
        entry.file,
    )  # fmt: skip
