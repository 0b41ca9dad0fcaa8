"""Tables of text as programs write them: names, units and first row are found in the file.

Lines above the header are ignored, but for a rate that they state. A unit in a line below it is
part of the name, as in "Position [mm]"; "Position" finds the column as well. Where there is no
header the columns are called "1", "2", ...
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from itertools import accumulate, pairwise
from pathlib import Path

from twin.errors import InputError
from twin.importers.dialects import Dialect
from twin.importers.mapping import ImportMap
from twin.importers.proposal.names import units_of
from twin.importers.stamps import is_date, is_stamp
from twin.importers.style import Style
from twin.importers.table import SignalTable, key_in_turns, parsing
from twin.importers.text import ENDINGS, Head, Layout, read_table
from twin.importers.units import is_unit, is_usual_unit, raw_unit
from twin.logs.log import LINEAR_UNITS, ROTARY_UNITS

_UNITS_OF = ("s", *LINEAR_UNITS.values(), *ROTARY_UNITS.values())
_WITHOUT_CELLS = 2  # names at the end, such as LabVIEW's comment, that rows may have no cell of
_SOME = 40  # rows by which the kinds of the columns are told

Rows = Sequence[Sequence[str]]


def read(path: Path, mapping: ImportMap) -> SignalTable:
    """Columns of a text table; raises InputError."""
    with parsing("a text table"):
        return read_table(path, mapping, find_layout(Head.of(path), mapping))


def find_layout(head: Head, stated: ImportMap) -> Layout:
    """The layout of a table of which nothing is known; raises InputError."""
    style = head.style(stated)
    rows = [style.cells(line) for line in head.lines]
    if style.delimiter is None:  # names may be of several words
        lines = (re.sub(r"^\s*[#%]", "", line).strip() for line in head.lines)
        spaced = [re.split(r"\s{2,}|\t", line) for line in lines]
    else:
        spaced = rows
    width = _width(rows)
    counting = _counting(rows, width, style)
    skip, header = _top(rows, spaced, counting, style, stated.header_line)
    if header is not None:  # a row with a bad cell is one, too
        between = range(header + 1, skip)
        skip = next((k for k in between if _good(rows[k], counting, style)), skip)
    # Of all the beginning, and some that follow each other: of several recorders in turn each is in
    # the latter.
    some = [*rows[skip :: max(1, (len(rows) - skip) // _SOME)], *rows[skip : skip + _SOME]]
    if header is None:
        names: tuple[str, ...] = tuple(str(k + 1) for k in range(width))
        return Layout(head.encoding, style, names, skip, some)
    given = [len(named[header]) for named in (rows, spaced)]
    several = given[0] != width and (given[1] == width or given[0] < width)  # words a name
    named = spaced if several else rows
    groups = named[header - 1] if header > 0 else ()
    names = _each_once(_names(named[header], rows[skip]), groups)
    units = _units(rows[header + 1 : skip], names)
    _require_samples(names, rows[skip : skip + _SOME], style)
    return Layout(head.encoding, style, names, skip, some, units, header)


def _top(
    rows: Rows, spaced: Rows, counting: Sequence[int], style: Style, header_line: int | None
) -> tuple[int, int | None]:
    """Index of the first row of numbers and of that with the names, None where there is none.

    Lines of numbers above the names, as of a block of settings, are passed by: where the first line
    that may be a row is none in all its cells, one that is, below names, is taken.
    """
    skip = _first_row(rows, counting, style, header_line)
    if header_line is None and _good(rows[skip], counting, style) < len(counting):
        whole = [k for k in range(skip, len(rows)) if _good(rows[k], counting, style)
                 == len(counting)]  # fmt: skip
        with suppress(InputError):
            named = whole and _header(rows, spaced, whole[0], None)
            if named and named > skip:
                return whole[0], named
    return skip, _header(rows, spaced, skip, header_line)


def _width(rows: Rows) -> int:
    """How many cells most rows of the second half have."""
    return Counter(len(row) for row in rows[len(rows) // 2 :]).most_common(1)[0][0]


def _counting(rows: Rows, width: int, style: Style) -> tuple[int, ...]:
    """The columns that hold numbers or times in most rows of the second half."""
    wide = [row for row in rows[len(rows) // 2 :] if len(row) == width]
    wide = wide[:: max(1, len(wide) // _SOME)]
    found = [k for k in range(width) if 2 * sum(_is_value(r[k], style) for r in wide) >= len(wide)]
    return tuple(found)


def _is_value(cell: str, style: Style) -> bool:
    return style.is_number(cell) or is_stamp(cell) or is_date(cell)


def _good(row: Sequence[str], counting: Sequence[int], style: Style) -> int:
    """How many of the columns that hold numbers or times do so in a row."""
    return sum(k < len(row) and _is_value(row[k], style) for k in counting)


def _first_row(rows: Rows, counting: Sequence[int], style: Style, header_line: int | None) -> int:
    """Index of the first row that is one of the table, as those that follow it are."""
    start = header_line or 0
    looked = 3  # rows: a line with a number above the header is followed by what is none
    fits = [2 * _good(row, counting, style) > len(counting) for row in rows]
    for index in range(start, len(rows)):
        following = fits[index : index + looked]
        if following[0] and 2 * sum(following) > len(following):
            return index
    raise InputError(
        f"has no rows of numbers below line {start} that are as wide as most of its lines; "
        "correct header_line, delimiter or decimal in the map"
    )


def _header(rows: Rows, spaced: Rows, skip: int, header_line: int | None) -> int | None:
    """Index of the row with the names of the columns; None where there is none."""
    width = len(rows[skip])
    if header_line is not None:
        top = header_line - 1
        if not {len(rows[top]), len(spaced[top])} & set(_widths(rows[skip])):
            raise InputError(
                f"line {top + 1} has {len(rows[top])} names, the rows have {width} cells; "
                "state header_line, delimiter or decimal in the map"
            )
        return top
    near = range(skip - 1, max(skip - 6, -1), -1)  # names, units, types, descriptions, an empty one
    widths = set(_widths(rows[skip]))
    fitting = [k for k in near if {len(rows[k]), len(spaced[k])} & widths]
    wider = {width + more for more in range(1, _WITHOUT_CELLS + 1)}
    for k in near:
        if k not in fitting and len(rows[k]) not in wider:
            continue
        row = spaced[k] if len(spaced[k]) in widths else rows[k]
        filled = [cell for cell in row if cell]
        if len(filled) >= width - 1 and len(set(filled)) == len(filled) and _is_names(filled):
            return k
    named = [k for k in fitting if any(re.search(r"\w", cell) for cell in rows[k])]
    if named:  # the one with most names, of like ones the first
        return max(named, key=lambda k: (_count_of_names(rows[k]), -k))
    above = next((rows[k] for k in near if any(rows[k])), [])
    if len(above) > 1:
        raise InputError(
            f"line {skip} has {len(above)} names, the rows have {width} cells; "
            "state header_line, delimiter or decimal in the map"
        )
    return None


def _widths(row: Sequence[str]) -> tuple[int, ...]:
    """How many names a row may have: rows may end in a delimiter, and times have a date before."""
    dated = any(is_date(a) and is_stamp(b) for a, b in pairwise(row))
    return (len(row), len(row) - 1) if not row[-1] or dated else (len(row),)


def _count_of_names(cells: Sequence[str]) -> int:
    """How many of some cells are words, and no units."""
    words = (cell for cell in cells if re.search(r"[^\W\d_]", cell))
    return sum(not _is_usual(cell) for cell in words)


def _is_names(cells: Sequence[str]) -> bool:
    """Whether cells are names, and neither units nor numbers nor a line that is drawn."""
    units = sum(_is_usual(cell) for cell in cells)
    words = sum(1 for cell in cells if re.search(r"[^\W\d_]", cell))
    return 2 * units < len(cells) and 2 * words > len(cells)


def _is_usual(cell: str) -> bool:
    """Whether a cell is a unit as drives and programs write it."""
    unit = cell.strip("[]() ")
    return is_usual_unit(unit) or bool(units_of(unit))


def _require_samples(names: Sequence[str], rows: Rows, style: Style) -> None:
    """Raise InputError where a column goes through the same words again and again."""
    for name, cells in zip(names, zip(*rows, strict=False), strict=False):
        words = all(c and not style.is_number(c) and not is_stamp(c) for c in {*cells})
        if words and (key := key_in_turns(name, cells)) is not None:
            raise InputError(key)


def _names(header: Sequence[str], row: Sequence[str]) -> tuple[str, ...]:
    """The names of all columns: of those without one their numbers."""
    names = list(header)[: len(row)]
    if len(names) < len(row) and row[-1]:
        place = next(k for k, cell in enumerate(row) if is_date(cell))
        names.insert(place, "date")
    names += [""] * (len(row) - len(names))
    return tuple(name or str(k + 1) for k, name in enumerate(names))


def _each_once(names: Sequence[str], groups: Sequence[str]) -> tuple[str, ...]:
    """Names of which each is there once: by the groups of columns above them, else by a number.

    groups: the cells of the line above, each the name of its column and of those behind it that
    have none.
    """
    if len(set(names)) == len(names):
        return tuple(names)
    of_each = accumulate((*groups, *[""] * len(names)), lambda group, cell: cell or group)
    grouped = tuple(f"{g} {n}".strip() for g, n in zip(of_each, names, strict=False))
    if len(set(grouped)) == len(names):
        return grouped
    counts, again = Counter[str](), Counter(names)
    out = []
    for name in names:
        counts[name] += 1
        bracket = "".join(re.findall(r"\s*[\[(][^\])]*[\])]$", name))
        bare = name.removesuffix(bracket)
        out.append(f"{bare} {counts[name]}{bracket}" if again[name] > 1 else name)
    return tuple(out)


def _unit(cell: str) -> str:
    """The unit that a cell is; "" where it is none."""
    unit = cell.strip("[]() ")
    return unit if units_of(unit) or is_unit(unit, *_UNITS_OF) or raw_unit(unit) else ""


def _units(rows: Rows, names: Sequence[str]) -> tuple[str, ...]:
    """Those in the first row between names and numbers that has some; "" of a column without."""
    for row in rows:
        units = [_unit(cell) for cell in row]
        if any(units) and len(units) >= len(names) - 1:
            return (*units, "")[: len(names)]
    return ()


DIALECT = Dialect("tables of text", ENDINGS, read)
