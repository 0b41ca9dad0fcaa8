"""Tables of text: how a file is cut into lines and cells, and its columns, read or refused.

What dialects share. A dialect finds the names and the first row (``Layout``) in the beginning of
the file (``Head``); ``read_table`` reads all rows. Cells that are no numbers are told all at once.
"""

from __future__ import annotations

import codecs
import itertools
import re
from collections import Counter
from collections.abc import Callable, Collection, Generator, Iterable, Iterator, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import isfinite
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from twin.errors import InputError
from twin.importers.bad_cells import BadCells, BadRow
from twin.importers.mapping import ImportMap
from twin.importers.proposal.lexicon import words_of_other_scripts
from twin.importers.proposal.names import unit_of
from twin.importers.stamps import Stamps, is_date, is_stamp, joined_with_dates
from twin.importers.style import Style, quantity_of
from twin.importers.table import SignalTable, chosen, with_unit

ENDINGS = (".csv", ".txt", ".tsv", ".dat", ".asc", ".log", ".lvm", ".prn")
HEAD = 1 << 16  # bytes in which a dialect is known and its first row is found
_DELIMITERS = (",", ";", "\t", "|", None)  # None: any white space
_MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"), (codecs.BOM_UTF16_LE, "utf-16"), (codecs.BOM_UTF16_BE, "utf-16")
)  # fmt: skip
_HUNDREDS = re.compile(r"[-+]?[1-9]\d\d")  # a whole number just below a thousand
_PACKED = (b"PK\x03\x04", b"\x1f\x8b")  # of zip, in which workbooks are too, and of gzip
_ENDS = re.compile(r"\r\n|\r|\n")
_BLOCK = 1024  # lines read at once: few enough that one bad cell makes few of them slow


@dataclass(frozen=True)
class Head:
    """The beginning of a file of text: its whole lines, less empty ones at the end of the file."""

    encoding: str
    lines: tuple[str, ...]

    @classmethod
    def of(cls, path: Path) -> Head:
        """The beginning of a file; raises InputError where it has no text."""
        with open(path, "rb") as stream:
            data = stream.read(HEAD)
            whole = not stream.read(1)
        if data.startswith(_PACKED):
            raise InputError("is compressed, or a workbook, whatever its name; give a .csv of it")
        encoding = _encoding(data)
        lines = _ENDS.split(data.decode(encoding, errors="replace"))
        lines = lines if whole else lines[:-1]
        while lines and not lines[-1].strip():
            lines.pop()
        if not lines:
            raise InputError("has no line of text; give a table of numbers")
        return cls(encoding, tuple(lines))

    def style(self, stated: ImportMap) -> Style:
        """The style of its rows of numbers; raises InputError where it has none."""
        # Of the second half, which is numbers, every so manieth line: the last ones may be of whole
        # numbers, which have no decimal sign.
        rows = self.lines[len(self.lines) // 2 :]
        lines = (*rows[:: -(-len(rows) // 40)], rows[-1])
        delimiters = (stated.delimiter,) if stated.delimiter else _DELIMITERS
        decimals = (stated.decimal,) if stated.decimal else (".", ",")
        quoted = any('"' in line for line in lines)  # "0,1","0,2": one sign may be both
        styles = [Style(d, p) for d in delimiters for p in decimals if d != p or quoted]
        for columns in (2, 1):  # 1,5 is two columns, unless the map states delimiter or decimal
            shares = {style: style.share_of_numbers(lines, columns) for style in styles}
            best = max(styles, key=lambda style: shares[style])
            if shares[best] > 0.0:
                level = [s for s in styles if shares[s] == shares[best]]
                level.sort(key=lambda style: style.grouped(self.lines))
                groups = [s for s in level if s.delimiter == best.delimiter and self._groups(s)]
                return self._of_its_signs([*groups, *level][0])
        raise InputError("has no rows of numbers; state delimiter and decimal in the map")

    def _of_its_signs(self, style: Style) -> Style:
        """The style, without grouping by a sign that is the decimal one of other cells."""
        return replace(style, grouping=not self._mixes(style))

    def _mixes(self, style: Style) -> bool:
        """Whether points are decimal signs too, where commas are."""
        cells = (cell for line in self.lines for cell in style.cells(line) if "." in cell)
        return style.decimal == "," and any(
            "," not in cell and not style.is_grouped(cell) and style.is_number(cell)
            for cell in cells
        )

    def _groups(self, style: Style) -> bool:
        """Whether a column goes from 999 to 1.000: what looks like decimals are thousands."""
        rows = [style.cells(line) for line in self.lines]
        return not self._mixes(style) and any(
            any(map(_HUNDREDS.fullmatch, column)) and any(map(style.is_grouped, column))
            for column in itertools.zip_longest(*rows, fillvalue="")
        )


def _encoding(head: bytes) -> str:
    for mark, encoding in _MARKS:
        if head.startswith(mark):
            return encoding
    # Of UTF-16 without a mark every other byte of what is written in ASCII is 0.
    for first, encoding in ((1, "utf-16-le"), (0, "utf-16-be")):
        zeros, others = head[first::2].count(0), head[1 - first :: 2].count(0)
        if zeros > 0.5 * len(head) / 2 and not others:
            return encoding
    try:
        head[: head.rfind(b"\n") + 1].decode("utf-8")
    except UnicodeDecodeError:
        return _of_windows(head[: head.rfind(b"\n") + 1])
    return "utf-8"


def _of_windows(head: bytes) -> str:
    """What programs on Windows write where it is not UTF-8: in which words of recorders are there.

    Of Russia or the Far East one in which such words are found; else that of the West.
    """
    found = {}
    for encoding in ("cp1251", "shift_jis", "gb18030", "big5", "cp949"):
        with suppress(UnicodeDecodeError):
            text = head.decode(encoding).lower()
            found[encoding] = sum(len(word) for word in words_of_other_scripts() if word in text)
    best = max(found, key=lambda encoding: found[encoding], default="cp1252")
    return best if found.get(best) else "cp1252"


@dataclass(frozen=True)
class Layout:
    """Where the rows of a file are, and what their columns are called.

    names: of the columns, each with its unit in ``units`` ("" or nothing: none). skip: lines before
    the first row of numbers. header: the index of the line with the names, None without one. rows:
    some rows of the beginning, as cells. sample_rate (Hz), start_ns: if stated. is_row: whether a
    line is a row at all, None where each is. end: how the line behind the last row begins. said:
    what is told.
    """

    encoding: str
    style: Style
    names: tuple[str, ...]
    skip: int
    rows: Sequence[Sequence[str]] = field(repr=False)
    units: tuple[str, ...] = ()
    header: int | None = None
    sample_rate: float | None = None
    start_ns: int | None = None
    is_row: Callable[[str], bool] | None = None
    end: str | None = None
    said: tuple[str, ...] = ()

    def called(self, asked: Collection[str]) -> list[str]:
        """The names of the columns, with their units unless they are asked for without."""
        return [with_unit(n, u, asked) for n, u in zip(self.names, self.all_units, strict=True)]

    @cached_property
    def all_units(self) -> tuple[str, ...]:
        """Of each column its unit, "" of one without: that stated for it, or beside its numbers."""
        stated = self.units or ("",) * len(self.names)
        return tuple(u or self._unit_beside(k) for k, u in enumerate(stated))

    def _unit_beside(self, column: int) -> str:
        """The unit of a column whose cells have one each: that of its name, else the usual one."""
        cells = [row[column] for row in self.rows if column < len(row)]
        beside = Counter(q[1] for cell in cells if (q := quantity_of(cell)) is not None)
        if 2 * beside.total() <= len(cells) or not beside:
            return ""
        return unit_of(self.names[column], bracketed=True) or beside.most_common(1)[0][0]

    @cached_property
    def kinds(self) -> tuple[str, ...]:
        """What each column holds by most of the first rows: "number", "stamp", "date", "text"."""
        return tuple(self._kind(k) for k in range(len(self.names)))

    def _kind(self, column: int) -> str:
        cells = [row[column] for row in self.rows if column < len(row) and row[column]]
        found = Counter(self._kind_of(cell) for cell in cells)
        return found.most_common(1)[0][0] if found else "text"

    def _kind_of(self, cell: str) -> str:
        if self.style.is_number(cell):
            return "number"
        return "stamp" if is_stamp(cell) else "date" if is_date(cell) else "text"

    def lines(self, path: Path) -> Generator[tuple[int, str]]:
        """The rows of a file with the number of each line, as they are written."""
        with open(path, encoding=self.encoding, errors="replace") as stream:
            for number, line in itertools.islice(enumerate(stream, 1), self.skip, None):
                if self.end is not None and line.startswith(self.end):
                    return
                if self.is_row is None or self.is_row(line):
                    yield number, line


def read_table(path: Path, mapping: ImportMap, layout: Layout) -> SignalTable:
    """The columns of a table that a map names, all where it names none; raises InputError."""
    asked = mapping.column_names()
    names = layout.called(asked)
    wanted = {name: names.index(name) for name in chosen(asked, names)}
    places = {**wanted, **_dates_of(wanted, layout, names)}
    text = {n: k for n, k in places.items() if layout.kinds[k] == "text"}
    if asked and text:
        raise InputError(_of_text(layout, *next(iter(text.items()))))
    where = [k for name, k in places.items() if name not in text]
    cut = mapping.rows is not None  # what is no number may be in the others
    bridges = mapping.resample is not None
    read, more, in_line = _rows(path, layout, where, every=cut or not asked, bridges=bridges)
    said = (*layout.said, *more)
    first_line = layout.skip + 1 if in_line else None
    for k in text.values():
        first = next((row[k] for row in layout.rows if k < len(row)), "")
        read[k] = np.array([first])
    columns = {name: read[k] for name, k in places.items()}
    columns = {n: c for n, c in joined_with_dates(columns).items() if n in wanted}
    above = tuple(_head_lines(path, layout))
    return SignalTable(columns, layout.sample_rate, layout.start_ns, first_line, said, above)


def _of_text(layout: Layout, name: str, column: int) -> str:
    """What is wrong with a column of which most cells are neither numbers nor times."""
    cells = [row[column] for row in layout.rows if column < len(row) and row[column]]
    if not cells:
        return f"column '{name}' is empty; leave it out of the map"
    clock = ", or give sample_rate (Hz) in place of time" if ":" in cells[0] else ""
    return (
        f"column '{name}' holds text, such as {cells[0]!r}, no numbers and no times such as "
        f"2024-05-01 12:00:00.001; correct it{clock}"
    )


def _head_lines(path: Path, layout: Layout) -> Iterator[str]:
    """The lines above the rows, in which a file may state its rate."""
    with open(path, encoding=layout.encoding, errors="replace") as stream:
        yield from (line.rstrip("\r\n") for line in itertools.islice(stream, layout.skip))


def _dates_of(wanted: Iterable[str], layout: Layout, names: Sequence[str]) -> dict[str, int]:
    """The columns of dates, where a stamp that is asked for has none of its own."""
    if all(layout.kinds[names.index(name)] != "stamp" for name in wanted):
        return {}
    return {names[k]: k for k, kind in enumerate(layout.kinds) if kind == "date"}


def _rows(
    path: Path, layout: Layout, where: Sequence[int], every: bool, bridges: bool
) -> tuple[dict[int, NDArray], tuple[str, ...], bool]:
    """The columns at some places, and sentences about the lines that are no rows.

    Last, whether each line up to the last row is a row, so that one's number tells the other's.

    every: all are read, to be looked at or cut, so that what is no number is NaN there; bridges:
    an empty cell is. Raises InputError that names all bad cells.
    """
    rows = _Rows(layout, where, _header_cells(path, layout))
    with closing(layout.lines(path)) as lines:
        while block := list(itertools.islice(lines, _BLOCK)):
            rows.add(block)
    bad, left_out = rows.bad, rows.bad.left_out()
    if not every or bad.has_header or any(k in bad.columns for k in rows.stamps):
        bad.require_none(left_out, but_empty=bridges and bad.columns.isdisjoint(rows.stamps))
    kept = rows.columns(left_out.rows)
    in_line = rows.blank == 0 and all(k >= rows.count - len(left_out.rows) for k in left_out.rows)
    return kept, left_out.said, in_line


class _Rows:
    """The rows of a table as they are read, in blocks: by NumPy, a block with a bad cell by hand.

    where: the places of the columns. header: the cells of the names, which may come again.
    """

    def __init__(self, layout: Layout, where: Sequence[int], header: list[str] | None) -> None:
        self._layout, self._where, self._header = layout, where, header
        kinds = layout.kinds
        self.stamps = {k: Stamps(kinds[k]) for k in where if kinds[k] in ("stamp", "date")}
        self.bad = BadCells(layout.names, len(layout.names))
        self._type = np.dtype([(str(k), "i8" if k in self.stamps else "f8") for k in where])
        self._blocks: list[NDArray] = []
        self.blank = self.count = 0  # lines that are no rows, and rows

    def add(self, block: Sequence[tuple[int, str]]) -> None:
        """Read some lines, each with its number."""
        values = self._by_numpy([line for _, line in block if not line.isspace()])
        if values is None:
            values = self._one_by_one(block)
        else:
            self.bad.pass_rows(len(values))
        self._blocks.append(values)
        self.count += len(values)
        self.blank += len(block) - len(values)

    def columns(self, left_out: Sequence[int]) -> dict[int, NDArray]:
        """The columns (n,) without some rows."""
        values = np.delete(np.concatenate([np.zeros(0, self._type), *self._blocks]), left_out)
        read = {k: np.ascontiguousarray(values[str(k)]) for k in self._where}
        return {k: self.stamps[k].times(c) if k in self.stamps else c for k, c in read.items()}

    def _by_numpy(self, lines: Sequence[str]) -> NDArray | None:
        """The rows of a block; None where any cell is not what it must be."""
        if not lines:
            return np.zeros(0, self._type)
        style = self._layout.style
        if style.decimal == ",":
            if style.delimiter == "," or any(map(style.has_grouped, lines)):
                return None
            lines = [line.replace(",", ".") for line in lines]
        stamps: dict[int | str, Callable[[str], int]] = {k: s.add for k, s in self.stamps.items()}
        try:
            values = np.loadtxt(
                lines, delimiter=style.delimiter, usecols=self._where, comments=None,
                quotechar='"', dtype=self._type, ndmin=1, encoding=None,
                converters=stamps,
            )  # fmt: skip
        except ValueError:
            return None
        numbers = (values[str(k)] for k in self._where if k not in self.stamps)
        return values if all(np.isfinite(c).all() for c in numbers) else None

    def _one_by_one(self, block: Sequence[tuple[int, str]]) -> NDArray:
        """The rows of a block; a cell that is not what it must be is NaN, or no time."""
        read: list[tuple[float, ...]] = []
        for number, line in block:
            cells = self._layout.style.cells(line)
            if not any(cells):
                continue
            if self._header is not None and cells == self._header:
                self.bad.add_header(number)
                continue
            row = BadRow(number, line, cells)
            read.append(tuple(self._value(row, k) for k in self._where))
            self.bad.end_row(row, self._where)
        return np.array(read, self._type)

    def _value(self, row: BadRow, place: int) -> float:
        cell, stamps = row.cell(place), self.stamps.get(place)
        try:
            unit = self._layout.all_units[place]
            value = self._layout.style.value(cell, unit) if stamps is None else stamps.add(cell)
        except ValueError:
            self.bad.add(row, place)
            return np.nan if stamps is None else -1
        if not isfinite(value):
            self.bad.add_not_finite(row, place)
        return value


def _header_cells(path: Path, layout: Layout) -> list[str] | None:
    """The cells of the line with the names; None where there is none."""
    if layout.header is None:
        return None
    line = next(itertools.islice(_head_lines(path, layout), layout.header, None), None)
    return None if line is None else layout.style.cells(line)
