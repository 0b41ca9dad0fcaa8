"""Text tables: delimiter, decimal sign, header and first row of numbers are found in the file.

Lines above the header are ignored. A unit in a line below it is part of the name, as in
"Position [mm]"; "Position" finds the column as well. Where there is no header the columns are
called "1", "2", ... Times may be stamps of ISO 8601, such as 2024-05-01 12:00:00.001.

An export of TwinCAT Scope is known by its own header, rows of a key and its value for each channel.
Source: Beckhoff Infosys, TE13xx TwinCAT 3 Scope View, "Export to CSV". A column under the key is
that of the times, in ms since the first sample or, as full time stamps, in 100 ns since 1601.
"""

from __future__ import annotations

import codecs
import csv
import itertools
from collections.abc import Collection, Generator, Iterable, Sequence
from contextlib import closing
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np

from twin.errors import InputError
from twin.importers.mapping import ImportMap, is_unit, raw_unit
from twin.importers.table import SignalTable, chosen, parsing
from twin.logs.log import LINEAR_UNITS, ROTARY_UNITS

TIME = "time"
END = "EOF"  # the last line of an export, where it was asked for
_NAME, _SYMBOL, _STEP = "Name", "SymbolName", "SampleTime[ms]"
_STARTS = ("StartRecord", "Starttime of export", "StartTime")
_DELIMITERS = (",", ";", "\t", "|", None)  # None: any white space
_UNITS_OF = ("s", *LINEAR_UNITS.values(), *ROTARY_UNITS.values())
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
_MARKS = ((codecs.BOM_UTF8, "utf-8-sig"), (codecs.BOM_UTF16_LE, "utf-16"))


@dataclass(frozen=True)
class _Style:
    """How a line is cut into cells, and how a cell is a number."""

    delimiter: str | None
    decimal: str

    def cells(self, line: str) -> list[str]:
        text = line.strip(" \r\n").removeprefix("#").strip(" ")
        if self.delimiter is None:
            return text.split()
        return [cell.strip() for cell in next(csv.reader([text], delimiter=self.delimiter), [])]

    def value(self, cell: str) -> float:
        return float(cell.replace(self.decimal, "."))

    def is_number(self, cell: str) -> bool:
        try:
            self.value(cell)
        except ValueError:
            return False
        return True

    def is_stamp(self, cell: str) -> bool:
        """Whether a cell is a date and a time."""
        try:
            return ":" in cell and _microseconds(cell.replace(self.decimal, ".")) > 0.0
        except ValueError:
            return False

    def share_of_numbers(self, lines: Sequence[str], columns: int) -> float:
        """Of the cells of ``lines``; 0 where there are fewer columns."""
        rows = [self.cells(line) for line in lines]
        if len(rows[-1]) < columns:
            return 0.0
        cells = list(itertools.chain.from_iterable(rows))
        return sum(map(self.is_number, cells)) / len(cells)


@dataclass(frozen=True)
class _Layout:
    """skip: lines before the first row of numbers; sample_rate: Hz, start_ns: if stated.

    first: the cells of that row. units: what the names have as units in a line of their own.
    """

    encoding: str
    style: _Style
    names: tuple[str, ...]
    skip: int
    first: Sequence[str]
    units: tuple[str, ...] = ()
    sample_rate: float | None = None
    start_ns: int | None = None

    def called(self, asked: Collection[str]) -> list[str]:
        """The names of the columns, with their units unless they are asked for without."""
        units = self.units or ("",) * len(self.names)
        both = zip(self.names, units, strict=True)
        return [f"{n} [{unit}]" if unit and n not in asked else n for n, unit in both]

    def holds_numbers(self, column: int) -> bool:
        """Whether its first cell is a number or a time."""
        cell = self.first[column]
        return self.style.is_number(cell) or self.style.is_stamp(cell)


def read(path: Path, mapping: ImportMap) -> SignalTable:
    """Columns of a text table; raises InputError."""
    with parsing("a text table"):
        layout = _find_layout(path, mapping)
        asked = mapping.column_names()
        names = layout.called(asked)
        places = {name: names.index(name) for name in chosen(asked, names)}
        text = {} if asked else {n: np.array(layout.first[k : k + 1]) for n, k in places.items()
                                 if not layout.holds_numbers(k)}  # fmt: skip
        where = [k for name, k in places.items() if name not in text]
        stamps = {k for k in where if layout.style.is_stamp(layout.first[k])}
        try:
            with closing(_lines(path, layout)) as lines:
                values = np.loadtxt(
                    lines, delimiter=layout.style.delimiter, usecols=where, comments=None,
                    quotechar='"', ndmin=2, unpack=True, encoding=None,
                    converters=dict.fromkeys(stamps, _microseconds),
                )  # fmt: skip
        except ValueError as error:
            raise _first_fault(path, layout, where, stamps) or InputError(str(error)) from error
    read = dict(zip(where, values, strict=True))
    for k in stamps:
        read[k] = read[k].astype(np.int64).astype("datetime64[us]")
    columns = {name: read[k] if name not in text else text[name] for name, k in places.items()}
    return SignalTable(columns, layout.sample_rate, layout.start_ns, layout.skip + 1)


def _microseconds(stamp: str) -> float:
    """Since 1970, of a date and a time, which are those of UTC where they state no zone.

    They are whole and far below 2^53, so exact. Raises ValueError.
    """
    time = datetime.fromisoformat(stamp.strip())
    aware = time if time.tzinfo else time.replace(tzinfo=UTC)
    return float((aware - _EPOCH) // timedelta(microseconds=1))


def _lines(path: Path, layout: _Layout) -> Generator[str]:
    """Lines of numbers, with a point as decimal sign."""
    with open(path, encoding=layout.encoding, errors="replace") as stream:
        rows: Iterable[str] = itertools.islice(stream, layout.skip, None)
        rows = itertools.takewhile(lambda line: not line.startswith(END), rows)
        comma = layout.style.decimal == ","
        yield from (line.replace(",", ".") for line in rows) if comma else rows


def _find_layout(path: Path, stated: ImportMap) -> _Layout:
    with open(path, "rb") as stream:
        head = stream.read(1 << 16)
        whole = not stream.read(1)
    encoding = _encoding(head)
    text = head.decode(encoding, errors="replace")
    lines = text.split("\n") if whole else text.split("\n")[:-1]
    while lines and lines[-1].strip() in ("", END):
        lines.pop()
    if not lines:
        raise InputError("has no line of text; give a table of numbers")
    # Of the second half, which is numbers, every so manieth line: the last ones may be of whole
    # numbers, which have no decimal sign.
    rows_of_numbers = lines[len(lines) // 2 :]
    style = _find_style(rows_of_numbers[:: -(-len(rows_of_numbers) // 40)] + lines[-1:], stated)
    rows = [style.cells(line) for line in lines]
    if (scope := _scope_layout(rows, encoding, style)) is not None:
        return scope
    skip = _first_row(rows, style, stated.header_line)
    names, below = _names(rows, skip, stated.header_line)
    return _Layout(encoding, style, names, skip, rows[skip], _units(rows[below:skip], names))


def _units(rows: Sequence[Sequence[str]], names: Sequence[str]) -> tuple[str, ...]:
    """Those in the first row between names and numbers that has some; "" of a column without."""
    for row in rows:
        cells = [cell.strip("[]() ") for cell in row]
        units = [c if is_unit(c, *_UNITS_OF) or raw_unit(c) else "" for c in cells]
        if any(units) and len(units) >= len(names) - 1:
            return (*units, "")[: len(names)]
    return ()


def _scope_layout(rows: Sequence[Sequence[str]], encoding: str, style: _Style) -> _Layout | None:
    """The layout of an export of TwinCAT Scope, None where it is none; raises InputError."""
    keys = [row[0] if row else "" for row in rows]
    if _STEP not in keys or _NAME not in keys:
        return None
    step = keys.index(_STEP)
    first = next((k for k in range(step, len(rows)) if style.is_number(keys[k])), None)
    if first is None:
        raise InputError("has no numbers below the header of TwinCAT Scope; export it again")
    symbols = _SYMBOL in keys[:first]  # above the steps each channel has its name
    named = keys.index(_SYMBOL) if symbols else max(k for k in range(step) if keys[k] == _NAME)
    names = [TIME if cell in (keys[named], "") else cell for cell in rows[named]]
    width = len(rows[first])
    if width < len(names):  # exported without times
        names = [name for name in names if name != TIME]
    if width > len(names) or not names:
        raise InputError(
            f"has {len(names)} names of channels, but rows of {width} cells; export it from "
            "TwinCAT Scope with the whole header and one time column"
        )
    # the time of the first channel is that of all; others are called time[2], time[3], ...
    places = [k for k, name in enumerate(names) if name == TIME]
    for number, k in enumerate(places[1:], 2):
        names[k] = f"{TIME}[{number}]"
    stated = (row[1] for row in rows[:first] if len(row) > 1 and row[0] in _STARTS)
    unix_epoch = 116_444_736_000_000_000  # in 100 ns since 1601
    ticks = (int(cell) - unix_epoch for cell in stated if cell.isdigit())
    start_ns = next((100 * t for t in ticks if t > 0), None)
    steps = sorted({style.value(cell) for cell in rows[step] if style.is_number(cell)})
    if len(steps) > 1:
        raise InputError(
            f"has channels with sample times of {', '.join(f'{s:g}' for s in steps)} ms; export "
            "those of one sample time at once"
        )
    rate = 1e3 / steps[0] if steps and steps[0] > 0.0 else None
    return _Layout(encoding, style, tuple(names[:width]), first, rows[first], (), rate, start_ns)


def _encoding(head: bytes) -> str:
    for mark, encoding in _MARKS:
        if head.startswith(mark):
            return encoding
    try:
        head[: head.rfind(b"\n") + 1].decode("utf-8")
    except UnicodeDecodeError:
        return "cp1252"  # what programs on Windows write where it is not UTF-8
    return "utf-8"


def _find_style(lines: Sequence[str], stated: ImportMap) -> _Style:
    delimiters = (stated.delimiter,) if stated.delimiter else _DELIMITERS
    decimals = (stated.decimal,) if stated.decimal else (".", ",")
    styles = [_Style(d, p) for d in delimiters for p in decimals if d != p]
    for columns in (2, 1):  # 1,5 is two columns, unless the map states delimiter or decimal
        best = max(styles, key=lambda style: style.share_of_numbers(lines, columns))
        if best.share_of_numbers(lines, columns) > 0.0:
            return best
    raise InputError("has no rows of numbers; state delimiter and decimal in the map")


def _first_row(rows: Sequence[Sequence[str]], style: _Style, header_line: int | None) -> int:
    """Index of the first row with a number, as wide as the last row."""
    for index in range(header_line or 0, len(rows)):
        if len(rows[index]) == len(rows[-1]) and any(map(style.is_number, rows[index])):
            return index
    raise InputError(
        f"has no rows of numbers below line {header_line or 0} that are as wide as its last line; "
        "cut off what follows the numbers, or correct header_line"
    )


def _names(
    rows: Sequence[Sequence[str]], skip: int, header_line: int | None
) -> tuple[tuple[str, ...], int]:
    """Names of the columns: the topmost of the rows above the numbers that are as wide.

    With the index of the row below them.
    """
    width = len(rows[skip])
    widths = (width, width - 1) if not rows[skip][-1] else (width,)  # rows may end in a delimiter
    if header_line is not None:
        top = header_line - 1
    else:
        top = skip
        while top > 0 and len(rows[top - 1]) in widths:
            top -= 1
        if top == skip and (skip == 0 or len(rows[skip - 1]) < 2):
            return tuple(str(k + 1) for k in range(width)), skip
        top = min(top, skip - 1)
    if len(rows[top]) not in widths:
        raise InputError(
            f"line {top + 1} has {len(rows[top])} names, the rows have {width} cells; "
            "state header_line, delimiter or decimal in the map"
        )
    return tuple(rows[top]), top + 1


def _first_fault(
    path: Path, layout: _Layout, where: Sequence[int], stamps: Collection[int]
) -> InputError | None:
    """The first cell that is not a number, nor a time where the first row has one."""
    with open(path, encoding=layout.encoding, errors="replace") as stream:
        for number, line in itertools.islice(enumerate(stream, 1), layout.skip, None):
            if not line.strip():
                continue
            cells = layout.style.cells(line)
            for index in where:
                place = f"line {number}, column '{layout.names[index]}'"
                if index >= len(cells) or not cells[index]:
                    return InputError(f"{place}: is empty; complete or cut out the row")
                fits = layout.style.is_stamp if index in stamps else layout.style.is_number
                if not fits(cells[index]):
                    return InputError(f"{place}: {cells[index]!r} is not {_remedy(cells[index])}")
    return None


def _remedy(cell: str) -> str:
    """What a cell that is no number ought to be."""
    if ":" in cell:
        return (
            "a number, nor a time such as 2024-05-01 12:00:00.001; correct it, or give "
            "sample_rate (Hz) in place of time"
        )
    return "a number; correct it, or state header_line, delimiter or decimal in the map"
