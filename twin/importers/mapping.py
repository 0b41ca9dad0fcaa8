"""The import map: which column of a foreign file is which signal, in which unit.

    sample_rate = 1000.0                  # Hz; or time = {column = "t", unit = "s"}
    resample = 1000.0                     # Hz, with a time whose stamps are uneven
    [axes.x]
    force_constant = 53.4                 # N/A, optional
    position = {column = "qm", unit = "mm"}
    force = {column = "drive", unit = "V", scale = 35.15}     # N a volt; or scale = "gtau"
    gear = 32.0                           # the columns are those of a motor, 32 turns for one

A counter has unit = "counts" with counts_per_turn or counts_per_metre, of its own or of its axis,
and where it begins again wraps, such as 65536.

Several files are given in the order of [[files]] tables, each with time or sample_rate and an
offset (s) that is added to its times; a column of the second one says file = 2.

SI value = sign x (scale x raw + offset) x unit. A quantity in volts or counts is brought to SI by
its scale, and its offset is in SI. A scale may be the name of a scalar of the file.
``delay_samples``: by how many whole samples the column was recorded too late; it is moved back by
as many.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, PrivateAttr, model_validator

from twin.entries import Entries, read_entries, toml_document
from twin.errors import InputError, at
from twin.importers.table import numbers
from twin.importers.units import COUNTS, Unit, find_unit
from twin.logs.container import reading
from twin.logs.log import FIELDS, LINEAR_UNITS, ROTARY_UNITS, Array
from twin.logs.topics import IDENTIFIER, is_calendar

PER_ENCODER = ("counts_per_turn", "counts_per_metre")
AXIS_NAME = rf"^{IDENTIFIER.pattern}$"


class _Column(Entries):
    column: str | int
    """a name, or a number where there are no names"""

    @property
    def name(self) -> str:
        """Of the column in its file."""
        return str(self.column)


class RestMap(_Column):
    """The column of what is left of each second, as the nanoseconds of a stamp of ROS."""

    unit: str
    """a unit of time in quotes, such as "ns" """


class TimeMap(_Column):
    """The column of the time stamps, or of a counter of the samples."""

    unit: str | None = None
    """a unit of time in quotes, such as "s", "ms" or "us"; or step"""
    step: float | None = Field(None, gt=0.0)
    """a number above 0: s for one, of a column that counts the samples"""
    plus: RestMap | None = None
    """the column of what is left of each second, which is added"""

    @property
    def seconds(self) -> float:
        """One of its unit, s; raises InputError for what is no unit of time."""
        if (self.unit is None) == (self.step is None):
            raise InputError('give unit, such as "s", or step (s for one, of a counter of samples)')
        return self.step or find_unit(self.unit or "", "s").size

    @property
    def parts(self) -> tuple[str, ...]:
        """The columns of its file that it is made of."""
        return (self.name,) if self.plus is None else (self.name, self.plus.name)

    def raw(self, columns: Mapping[str, NDArray]) -> NDArray:
        """The times (n,) of the columns of its file: in its unit, or dates.

        Whole seconds since 1970 and their rest are a date, as a number would lose its digits.
        Raises InputError where one of two columns is not one of numbers.
        """
        if self.plus is None:
            return np.asarray(columns[self.name])
        whole, rest = (numbers(name, columns[name]) for name in self.parts)
        rest = rest * find_unit(self.plus.unit, "s").size
        if len(whole) and is_calendar(self.seconds * float(whole[0])):
            ns = np.rint(self.seconds * whole).astype(np.int64) * 10**9
            return (ns + np.rint(rest * 1e9).astype(np.int64)).astype("datetime64[ns]")
        return whole + rest / self.seconds


class ColumnMap(_Column):
    """The column of a signal: SI value = sign x (scale x raw + offset) x unit."""

    less: str | int | None = None
    """another column in its unit, which is taken off it: of a set point the following error"""
    plus: str | int | None = None
    """another column in its unit, which is added: an error that is position less set point"""
    integrated: bool = False
    """true: it is a velocity, whose integral from 0 on is the position"""
    unit: str = Field(description='a unit in quotes, such as "mm", "A", "V" or "counts"')
    scale: float | str = 1.0
    """a finite number other than 0: SI units a raw one; or a scalar of the file"""
    offset: float = 0.0
    """a finite number, in the unit; in SI where a scale brings it"""
    sign: Literal[1, -1] = 1
    """1 or -1"""
    delay_samples: int = Field(0, ge=-(10**6), le=10**6)
    """a whole number, -1000000 to 1000000: by how many samples the column was recorded too late"""
    counts_per_turn: float | None = Field(None, gt=0.0)
    """a number above 0: counts of the encoder in one turn"""
    counts_per_metre: float | None = Field(None, gt=0.0)
    """a number above 0: counts of the encoder in one metre"""
    wraps: float | None = Field(None, gt=0.0)
    """a number above 0: counts after which the counter begins again, such as 65536"""
    side: Literal["motor", "load"] | None = Field(
        None, description='"motor" or "load": on which side of the gear it is measured'
    )
    file: int = Field(1, ge=1, le=1000)
    """a whole number: which of several files, the first is 1"""
    _si: Unit = PrivateAttr(Unit(1.0, None))

    @property
    def name(self) -> str:
        """What it is called: its column, and the one that is added or taken off."""
        taken = "" if self.less is None else f" less {self.less}"
        added = "" if self.plus is None else f" plus {self.plus}"
        return f"{self.column}{taken}{added}"

    @property
    def parts(self) -> tuple[str, ...]:
        """The columns of its file that it is made of."""
        return tuple(str(n) for n in (self.column, self.less, self.plus) if n is not None)

    def raw(self, columns: Mapping[str, Array]) -> Array:
        """Its numbers (n,) of the columns of its file."""
        made = columns[str(self.column)]
        made = made if self.less is None else made - columns[str(self.less)]
        return made if self.plus is None else made + columns[str(self.plus)]

    @property
    def key(self) -> str:
        """A name that no column of another file has."""
        return self.name if self.file == 1 else f"{self.file}:{self.name}"

    @property
    def si(self) -> Unit:
        """Its unit in SI."""
        return self._si

    def require_unit(self, field: str) -> None:
        """Find the unit, of a signal of that name; raises InputError where there is none."""
        either = dict.fromkeys((LINEAR_UNITS[field], ROTARY_UNITS[field]))
        self._si = self._of_a_rate(field) if self.integrated else find_unit(self.unit, *either)
        counted = self._per_count(field)
        if counted is not None:
            self._si = counted
        elif self.si.si is None and "scale" not in self.model_fields_set:
            how = "a scale: how much one of it is in SI"
            if self.is_counted and len(either) > 1 and not field.endswith("force"):
                how = "counts_per_turn or counts_per_metre of the encoder"
            raise InputError(f"unit '{self.unit}' needs {how}")
        if self.scale == 0.0:
            raise InputError("scale = 0: give a number other than 0")
        if isinstance(self.scale, str) and not self.scale.strip("+-.0123456789eE"):
            raise InputError(
                f"scale = '{self.scale}': give a finite number without quotes, or the name of a "
                "scalar of the file"
            )

    def _of_a_rate(self, field: str) -> Unit:
        """The unit of a position that is a velocity's integral; raises InputError."""
        if not field.endswith("position"):
            raise InputError(f"integrated: of a velocity a position is made, no {field}")
        rate = field.replace("position", "velocity")
        found = find_unit(self.unit, LINEAR_UNITS[rate], ROTARY_UNITS[rate])
        if found.si is None:
            raise InputError(f"unit '{self.unit}': to be integrated it must be one of a velocity")
        linear = found.si == LINEAR_UNITS[rate]
        return Unit(found.size, (LINEAR_UNITS if linear else ROTARY_UNITS)[field])

    @property
    def is_counted(self) -> bool:
        """Whether its unit is that of a counter."""
        return self.unit.partition("/")[0].strip() in COUNTS

    def _per_count(self, field: str) -> Unit | None:
        """One of its counts in SI, where an encoder tells; None where the map has none."""
        given = {name: c for name in PER_ENCODER if (c := getattr(self, name)) is not None}
        if not given:
            return None
        name, counts = next(iter(given.items()))
        si = (ROTARY_UNITS if name == "counts_per_turn" else LINEAR_UNITS)[field]
        if len(given) > 1 or not self.is_counted or field in ("current", "force"):
            raise InputError(
                f"{name} = {counts:g}: give one of {' and '.join(PER_ENCODER)}, of a position or "
                'velocity with unit = "counts" (or "counts/s")'
            )
        if "scale" in self.model_fields_set:
            raise InputError(f"scale and {name} are both given; give one of them")
        turn = 2.0 * math.pi if name == "counts_per_turn" else 1.0
        return Unit(self.si.size * turn / counts, si)

    def to_si(self, raw: Array) -> Array:
        """Values (n,) of the column in SI."""
        factor = self.sign * self.si.size
        with np.errstate(over="ignore", invalid="ignore"):  # what is too large is refused later
            return np.asarray(
                factor * float(self.scale) * raw + factor * self.offset + self.si.zero
            )


_SIGNAL: Any = Field(None, description='a table such as {column = "name in the file", unit = "mm"}')


class AxisMap(Entries):
    """Signals of one axis; force_constant in N/A (N m/A on a rotary axis) or None."""

    force_constant: float | None = Field(None, gt=0.0)
    """a number above 0, in N/A (N m/A on a rotary axis)"""
    gear: float | dict[str, float] | None = Field(
        None,
        description="turns of this axis' motor, whose signals are mapped, for one of the load: a "
        "number other than 0; or for one of each joint, such as {elbow = 32.0, wrist = 32.0}; the "
        "log then has the signals of the loads",
    )
    side: Literal["motor", "load"] = Field(
        "motor",
        description='"motor" or "load": on which side of the gear position and velocity are '
        "measured; current and force are the motor's, unless a column says its own side",
    )
    counts_per_turn: float | None = Field(None, gt=0.0)
    """a number above 0: of each signal in counts that has none itself"""
    counts_per_metre: float | None = Field(None, gt=0.0)
    """a number above 0: of each signal in counts that has none itself"""
    setpoint_position: ColumnMap | None = _SIGNAL
    setpoint_velocity: ColumnMap | None = _SIGNAL
    setpoint_acceleration: ColumnMap | None = _SIGNAL
    position: ColumnMap | None = _SIGNAL
    velocity: ColumnMap | None = _SIGNAL
    current: ColumnMap | None = _SIGNAL
    force: ColumnMap | None = _SIGNAL
    pressure: ColumnMap | None = _SIGNAL
    pressure_2: ColumnMap | None = _SIGNAL
    temperature: ColumnMap | None = _SIGNAL

    @model_validator(mode="after")
    def _by_one_encoder(self) -> AxisMap:
        """What the axis says of its encoder holds for each of its signals in counts."""
        known = {n: v for n in PER_ENCODER if (v := getattr(self, n)) is not None}
        if not known:
            return self
        own = {"scale", *PER_ENCODER}
        told = {
            field: column.model_copy(update=known)
            for field, column in self.columns.items()
            if column.is_counted and field not in ("current", "force")
            and not own & column.model_fields_set
        }  # fmt: skip
        return self.model_copy(update={**told, **dict.fromkeys(PER_ENCODER)}) if told else self

    @property
    def columns(self) -> dict[str, ColumnMap]:
        """Field of the log -> its column."""
        return {field: c for field in FIELDS if (c := getattr(self, field)) is not None}

    @property
    def units(self) -> Mapping[str, str]:
        """SI unit of every field."""
        return ROTARY_UNITS if self._has(ROTARY_UNITS) else LINEAR_UNITS

    def ratios(self, name: str) -> dict[str, float]:
        """Turns of the motor of the axis called ``name`` for one of each load; none: its own."""
        return self.gear if isinstance(self.gear, dict) else {name: self.gear} if self.gear else {}

    def side_of(self, field: str) -> str:
        """On which side of the gear a signal is measured."""
        column = self.columns[field]
        return column.side or ("motor" if field in ("current", "force") else self.side)

    def require_signals(self) -> None:
        """Find the units; raises InputError where one or a signal is missing or of another kind."""
        for field, column in self.columns.items():
            with at(field):
                column.require_unit(field)
        if idle := [n for n in PER_ENCODER if getattr(self, n) is not None]:
            raise InputError(
                f"{idle[0]}: none of the axis' signals is in counts without a scale of its own; "
                'give one unit = "counts", or remove the entry'
            )
        if "position" not in self.columns or not {"current", "force"} & set(self.columns):
            raise InputError("an axis needs position and one of current and force; map both")
        if self.gear in ({}, 0.0):
            raise InputError("gear: give a number other than 0, or one for each joint")
        sided = any(c.side for c in self.columns.values()) or "side" in self.model_fields_set
        if sided and (self.gear is None or isinstance(self.gear, dict)):
            raise InputError("side: needs the ratio of the gear; give gear, such as gear = 10.0")
        linear, rotary = self._has(LINEAR_UNITS), self._has(ROTARY_UNITS)
        counted = [f for f, c in self.columns.items() if c.is_counted and c.si.si is None]
        if counted and counted != ["current"] and not linear and not rotary:
            raise InputError(
                f"{counted[0]}: counts with a scale are of an axis that turns or one that travels; "
                "say which: counts_per_turn or counts_per_metre in place of the scale, or "
                'unit = "rad" or "m" with it'
            )
        if linear and rotary:
            raise InputError(
                f"{linear[0]} has a linear unit, {rotary[0]} a rotary one; give both of one kind "
                'with unit = "counts" and a scale in SI a count'
            )

    def _has(self, units: Mapping[str, str]) -> list[str]:
        return [
            f for f, c in self.columns.items()
            if c.si.si == units[f] and LINEAR_UNITS[f] != ROTARY_UNITS[f]
        ]  # fmt: skip


class _File(Entries):
    format: str | None = Field(None, description='a format in quotes, such as "csv"')
    sample_rate: float | None = Field(None, gt=0.0)
    """a finite number above 0, in Hz"""
    time: TimeMap | None = None
    """a table such as {column = "t", unit = "s"}"""
    rows: list[Annotated[int, Field(ge=1)]] | None = Field(None, min_length=2, max_length=2)
    """the first and the last row to take, such as [13, 5000]; rows count from 1"""


class FileMap(_File):
    """One of several files that are given together, in their order."""

    offset: float = 0.0
    """a finite number, in s, which is added to its times"""


class ImportMap(_File):
    """A whole map; at most one of sample_rate and time."""

    resample: float | None = Field(None, gt=0.0)
    """a number above 0, in Hz: uneven time stamps are brought onto this clock"""
    files: list[FileMap] | None = Field(None, min_length=2)
    """tables [[files]], one for each file; resample brings their columns onto one clock"""
    delimiter: str | None = Field(None, min_length=1, max_length=1)
    """one character, such as ';'"""
    decimal: Literal[".", ","] | None = None
    """'.' or ','"""
    header_line: int | None = Field(None, ge=1)
    """a whole number; lines count from 1"""
    axes: dict[Annotated[str, Field(pattern=AXIS_NAME)], AxisMap] = Field(min_length=1)
    """a table for each axis, as [axes.x]; an axis name has letters, digits and underscores"""
    _text: str = PrivateAttr("")

    @property
    def text(self) -> str:
        """The map as it was written."""
        return self._text

    def columns(self) -> list[ColumnMap]:
        """The columns of all signals."""
        return [c for _, _, c in self.signals()]

    def signals(self) -> list[tuple[str, str, ColumnMap]]:
        """Axis, field and column of all signals."""
        return [(a, f, c) for a, axis in self.axes.items() for f, c in axis.columns.items()]

    def column_names(self) -> tuple[str, ...]:
        """The columns that are read, each once."""
        names = [*self.time.parts] if self.time else []
        return tuple(
            dict.fromkeys([*names, *(n for c in self.columns() for n in c.parts), *self.scalars()])
        )

    def scalars(self) -> tuple[str, ...]:
        """The scalars of a file that scales name."""
        return tuple(dict.fromkeys(c.scale for c in self.columns() if isinstance(c.scale, str)))

    def scaled_by(self, scalars: Mapping[str, float], file: int) -> ImportMap:
        """The same with the scalars of a file in the scales of its columns that name them."""

        def change(c: ColumnMap) -> ColumnMap:
            if c.file != file or not isinstance(c.scale, str):
                return c
            return c.model_copy(update={"scale": scalars[c.scale]})

        return self._changed(change)

    def _changed(self, change: Callable[[ColumnMap], ColumnMap | None], **other: Any) -> ImportMap:
        """The same with other columns, and other entries."""
        axes = {
            name: axis.model_copy(update={f: change(c) for f, c in axis.columns.items()})
            for name, axis in self.axes.items()
        }
        return self.model_copy(update={"axes": axes, **other})

    def of_file(self, number: int) -> ImportMap:
        """The map of one of several files; raises InputError where no signal is in it."""
        own = (self.files or [])[number - 1]
        if all(c.file != number for c in self.columns()):
            raise InputError(f"the map has no signal with file = {number}; leave that file out")
        return self._changed(
            lambda c: c if c.file == number else None, files=None, sample_rate=own.sample_rate,
            time=own.time, rows=own.rows, format=own.format or self.format,
        )  # fmt: skip

    def require_consistent(self) -> None:
        """Raise InputError where entries contradict each other, or need one that is not there."""
        if self.time is not None and self.sample_rate is not None:
            raise InputError("sample_rate and time are both given; give one of them")
        if self.files is not None:
            self._require_time_bases(self.files)
        elif self.resample is not None and self.time is None:
            raise InputError('resample needs the times; give time = {column = "t", unit = "s"} too')
        for name, axis in self.axes.items():
            with at(f"axes.{name}"):
                axis.require_signals()
        for time in (self.time, *(file.time for file in self.files or ())):
            with at("time"):
                _ = time and time.seconds
        most, count = max(c.file for c in self.columns()), len(self.files or ())
        if most > max(count, 1):
            raise InputError(f"file = {most}: the map has {count} [[files]] tables; add one")

    def _require_time_bases(self, files: list[FileMap]) -> None:
        if self.time is not None or self.sample_rate is not None:
            raise InputError(
                "time and sample_rate are those of each file; give them under [[files]]"
            )
        rates = {file.sample_rate for file in files}
        if self.resample is None and (rates == {None} or len(rates) > 1):
            raise InputError(
                "several files have several clocks; give resample (Hz), their common one"
            )
        for number, file in enumerate(files, 1):
            if (file.time is None) == (file.sample_rate is None):
                raise InputError(f"files {number}: give either time or sample_rate (Hz)")


EVERY_COLUMN = ImportMap.model_construct(axes={})  # of a file whose columns nobody has named


def load_mapping(path: str | Path) -> ImportMap:
    """Read a map; raises InputError naming the file, the entry and what is allowed."""
    path = Path(path)
    with reading(path):
        return parse_mapping(toml_document(path)[0])


def parse_mapping(text: str) -> ImportMap:
    """The map of a TOML text; raises InputError naming the entry and what is allowed."""
    document = tomllib.loads(text)
    if not document.get("axes"):
        raise InputError("has no [axes.<name>] table; name at least one axis, as in [axes.x]")
    mapping = read_entries(ImportMap, document)
    mapping.require_consistent()
    mapping._text = text
    return mapping


def json_schema() -> dict[str, Any]:
    """The JSON schema of an import map."""
    return {**ImportMap.model_json_schema(), "title": "Import map of the Proton twin"}
