"""Trends of Rockwell's Studio 5000 and RSLogix 5000, saved as CSV.

A head of keys ("Controller Name:", "Sample Period:", ...), a row "Header:" with "Date", "Time" and
the tags, and rows that begin with "Data", whose times are such as 10:05:03;125. Source: exports as
public parsers of them read them; the times are those of the computer that polled the tags.
"""

from __future__ import annotations

from pathlib import Path

from twin.errors import InputError
from twin.importers.dialects import Dialect
from twin.importers.mapping import ImportMap
from twin.importers.style import Style
from twin.importers.table import SignalTable, parsing
from twin.importers.text import ENDINGS, Head, Layout, read_table

_HEADER, _DATA = "Header:", "Data"
_KEYS = ("Controller Name:", "Trend Name:", "Sample Period:")


def is_its(path: Path) -> bool:
    """Whether it has the keys of a trend."""
    lines = [line.lstrip('" ') for line in Head.of(path).lines]
    return any(s.startswith(_HEADER) for s in lines) and any(s.startswith(_KEYS) for s in lines)


def read(path: Path, mapping: ImportMap) -> SignalTable:
    """Columns of a trend; raises InputError."""
    with parsing("a trend of Rockwell"):
        head = Head.of(path)
        style = Style(",", ".")
        rows = [style.cells(line) for line in head.lines]
        header = next(k for k, row in enumerate(rows) if row and row[0] == _HEADER)
        first = next((k for k in range(header, len(rows)) if _is_row(head.lines[k])), None)
        if first is None:
            raise InputError("has no rows of data below its header; save the trend again")
        names = tuple(rows[header][: len(rows[first])])
        some = rows[first : first + 40]
        return read_table(
            path, mapping, Layout(head.encoding, style, names, first, some, (), header)
        )


def _is_row(line: str) -> bool:
    return line.lstrip('"').startswith(_DATA)


DIALECT = Dialect("trends of Rockwell", ENDINGS, read, is_its)
