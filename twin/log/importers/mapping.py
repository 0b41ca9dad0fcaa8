"""The import map: which column of a foreign file is which signal, in which unit.

    sample_rate = 1000.0                  # Hz; or time = {column = "t", unit = "s"}
    [axes.x]
    force_constant = 53.4                 # N/A, optional
    position = {column = "qm", unit = "mm"}
    force = {column = "drive", unit = "V", scale = 35.15}     # N a volt

SI value = sign x (scale x raw + offset) x unit. A quantity in volts or counts is brought to SI by
its scale, and its offset is in SI. ``delay_samples``: by how many whole samples the column was
recorded too late; it is moved back by as many.
"""

from __future__ import annotations

import difflib
import math
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from twin.errors import InputError
from twin.log.container import at, reading
from twin.log.importers.units import Unit, field_unit, find_unit
from twin.log.log import FIELDS, LINEAR_UNITS, ROTARY_UNITS, Array
from twin.log.topics import IDENTIFIER
from twin.model.units import ROTARY

_MAP_KEYS = ("format", "sample_rate", "time", "delimiter", "decimal", "header_line", "axes")
_COLUMN_KEYS = ("column", "unit", "scale", "offset", "sign", "delay_samples")


@dataclass(frozen=True)
class ColumnMap:
    """How a column becomes a signal; unit: of the column, the rest as in the map."""

    column: str
    unit: Unit
    scale: float = 1.0
    offset: float = 0.0
    sign: int = 1
    delay_samples: int = 0

    def to_si(self, raw: Array) -> Array:
        """Values (n,) of the column in SI."""
        factor = self.sign * self.unit.size
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
class ImportMap:
    """A whole map. At most one of sample_rate (Hz) and time; text: the map as it was written."""

    axes: Mapping[str, AxisMap]
    sample_rate: float | None = None
    time: ColumnMap | None = None
    format: str | None = None
    csv: CsvLayout = CsvLayout()
    text: str = ""

    def column_names(self) -> tuple[str, ...]:
        """The columns that are read, each once."""
        signals = [c for axis in self.axes.values() for c in axis.columns.values()]
        every = [self.time, *signals] if self.time else signals
        return tuple(dict.fromkeys(c.column for c in every))


def load_mapping(path: str | Path) -> ImportMap:
    """Read a map; raises InputError naming the file, the entry and what is allowed."""
    path = Path(path)
    with reading(path):
        try:
            text = path.read_text(encoding="utf-8")
            document = tomllib.loads(text)
        except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
            raise InputError(f"is not a TOML file: {error}") from error
        return _map(document, text)


def _map(document: Mapping[str, Any], text: str) -> ImportMap:
    _require_known(document, _MAP_KEYS)
    axes = _table(document.get("axes", {}), "axes")
    if not axes:
        raise InputError("has no [axes.<name>] table; name at least one axis, as in [axes.x]")
    if "time" in document and "sample_rate" in document:
        raise InputError("sample_rate and time are both given; give one of them")
    rate = _number(document, "sample_rate", None)
    if rate is not None and rate <= 0.0:
        raise InputError(f"sample_rate = {rate:g} Hz: give a number above 0")
    time = None
    if "time" in document:
        with at("time"):
            time = _column(document["time"], None)
    return ImportMap(
        axes={name: _axis(name, entry) for name, entry in axes.items()},
        sample_rate=rate,
        time=time,
        format=_text(document, "format"),
        csv=_csv_layout(document),
        text=text,
    )


def _csv_layout(document: Mapping[str, Any]) -> CsvLayout:
    layout = CsvLayout(
        _text(document, "delimiter"),
        _text(document, "decimal"),
        _whole(document, "header_line", None),
    )
    if layout.delimiter is not None and len(layout.delimiter) != 1:
        raise InputError(f"delimiter = {layout.delimiter!r}: give one character")
    if layout.decimal not in (None, ".", ","):
        raise InputError(f"decimal = {layout.decimal!r}: give '.' or ','")
    if layout.header_line is not None and layout.header_line < 1:
        raise InputError(f"header_line = {layout.header_line}: lines count from 1")
    return layout


def _axis(name: str, entry: Any) -> AxisMap:
    with at(f"axes.{name}"):
        if not IDENTIFIER.fullmatch(name):
            raise InputError("an axis name has letters, digits and underscores, as in x")
        entry = _table(entry, "an axis")
        _require_known(entry, ("force_constant", *FIELDS))
        constant = _number(entry, "force_constant", None)
        if constant is not None and constant <= 0.0:
            raise InputError(
                f"force_constant = {constant:g} N/A: give a number above 0 ({ROTARY('N/A')} on a "
                "rotary axis)"
            )
        columns = {}
        for field in FIELDS:
            if field in entry:
                with at(field):
                    columns[field] = _column(entry[field], field)
        if "position" not in columns or not {"current", "force"} & set(columns):
            raise InputError("an axis needs position and one of current and force; map both")
        axis = AxisMap(columns, constant)
        axis.require_one_kind()
        return axis


def _column(entry: Any, field: str | None) -> ColumnMap:
    """One column; ``field`` None is the time."""
    entry = _table(entry, "a column")
    _require_known(entry, _COLUMN_KEYS if field else ("column", "unit"))
    for key in ("column", "unit"):
        if key not in entry:
            raise InputError(f'has no {key}; write {{column = "name in the file", unit = "mm"}}')
    name = entry["column"]
    if isinstance(name, bool) or not isinstance(name, str | int):
        raise InputError(f"column = {name!r}: give a name, or a number where there are no names")
    text = _text(entry, "unit") or ""
    unit = field_unit(field, text) if field else find_unit(text, "s")
    if unit.si is None and "scale" not in entry:
        raise InputError(f"unit '{text}' needs a scale: how much one of it is in SI")
    scale, sign = _number(entry, "scale", 1.0), _whole(entry, "sign", 1)
    if scale == 0.0:
        raise InputError("scale = 0: give a number other than 0")
    if sign not in (1, -1):
        raise InputError(f"sign = {sign}: give 1 or -1")
    return ColumnMap(
        column=str(name),
        unit=unit,
        scale=scale,
        offset=_number(entry, "offset", 0.0),
        sign=sign,
        delay_samples=_whole(entry, "delay_samples", 0),
    )


def _require_known(entry: Mapping[str, Any], known: Iterable[str]) -> None:
    for key in entry:
        if key not in known:
            near = difflib.get_close_matches(key, known, n=1)
            hint = f"did you mean '{near[0]}'? " if near else ""
            raise InputError(f"unknown entry '{key}'; {hint}allowed: {', '.join(known)}")


def _table(entry: Any, what: str) -> Mapping[str, Any]:
    if not isinstance(entry, Mapping):
        raise InputError(f"{what} is {entry!r}; write it as a table: {{...}} or [...]")
    return entry


def _text(entry: Mapping[str, Any], key: str) -> str | None:
    value = entry.get(key)
    if value is not None and not isinstance(value, str):
        raise InputError(f"{key} = {value!r}: give a text in quotes")
    return value


def _number(entry: Mapping[str, Any], key: str, default: float | None) -> Any:
    value = entry.get(key, default)
    if value is default:
        return default
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise InputError(f"{key} = {value!r}: give a finite number")
    return float(value)


def _whole(entry: Mapping[str, Any], key: str, default: int | None) -> Any:
    value = entry.get(key, default)
    if value is not default and (isinstance(value, bool) or not isinstance(value, int)):
        raise InputError(f"{key} = {value!r}: give a whole number")
    return value
