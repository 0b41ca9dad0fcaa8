"""Data logs of Siemens WinCC: a value a row, with its variable and its time.

Columns "VarName", "TimeString", "VarValue", "Validity", "Time_ms"; the last is in millionths of a
day since 30.12.1899. Rows such as $RT_OFF$ say when the panel was switched. Source: logs as public
converters of them read them. A variable becomes a column, at the times that all variables have.
"""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twin.errors import InputError
from twin.importers.bad_cells import BadCells, BadRow
from twin.importers.dialects import Dialect
from twin.importers.mapping import ImportMap
from twin.importers.stamps import Stamps
from twin.importers.table import SignalTable, chosen, parsing
from twin.importers.text import ENDINGS, Head

TIME = "time"
_NAMES = ("VarName", "TimeString", "VarValue", "Validity")
_OF_PANEL = "$RT_"  # how the rows begin that are of no variable
_EPOCH = 25_569  # days from 30.12.1899 to 1970


def is_its(path: Path) -> bool:
    """Whether its first line has the names of such a log."""
    first = Head.of(path).lines[0]
    return all(name in first for name in _NAMES)


def read(path: Path, mapping: ImportMap) -> SignalTable:
    """Columns of a log; raises InputError."""
    with parsing("a log of WinCC"):
        logged, invalid = _logged(path)
        shared = _shared_times(logged)
        columns: dict[str, NDArray] = {TIME: shared.astype("datetime64[ns]")}
        for name, (times, values) in logged.items():
            columns[name] = values[np.searchsorted(times, shared)]
    said = []
    if invalid:
        said.append(f"{invalid} values that are not valid are left out")
    most = max(len(times) for times, _ in logged.values())
    if most > len(shared):
        said.append(f"{most - len(shared)} of {most} times, which not all variables have, left out")
    names = chosen(mapping.column_names(), columns)
    return SignalTable({name: columns[name] for name in names}, said=tuple(said))


def _logged(path: Path) -> tuple[dict[str, tuple[NDArray, NDArray]], int]:
    """Times in ns, which rise, and values by variable; and how many values were not valid."""
    head = Head.of(path)
    delimiter = next(d for d in ";\t," if d in head.lines[0])
    found: dict[str, tuple[list[Any], list[Any]]] = {}
    invalid = 0
    with open(path, encoding=head.encoding, errors="replace", newline="") as stream:
        rows = csv.reader(stream, delimiter=delimiter)
        names = [name.strip() for name in next(rows)]
        variable, value, valid = (names.index(n) for n in ("VarName", "VarValue", "Validity"))
        clock = _Clock(names)
        bad = BadCells(names, len(names))
        for cells in rows:
            if len(cells) <= valid or cells[variable].startswith(_OF_PANEL):
                continue
            if cells[valid].strip() != "1":
                invalid += 1
                continue
            row = BadRow(rows.line_num, delimiter.join(cells), cells)
            times, values = found.setdefault(cells[variable], ([], []))
            for k, out, read in ((clock.column, times, clock.read), (value, values, _number)):
                try:
                    out.append(read(row.cell(k)))
                except ValueError:
                    bad.add(row, k)
            bad.end_row(row, (clock.column, value))
    bad.require_none(bad.left_out())
    if not found:
        raise InputError("has no value of a variable; export the log again")
    logged = {}
    for name, (times, values) in found.items():
        when, first = np.unique(clock.times(np.array(times, np.int64)), return_index=True)
        logged[name] = when, np.array(values)[first]
    return logged, invalid


def _number(cell: str) -> float:
    return float(cell.replace(",", "."))


class _Clock:
    """The times of a log: by their exact column where it has one, else as text."""

    def __init__(self, names: Sequence[str]) -> None:
        self._stamps = Stamps("stamp")
        self._exact = "Time_ms" in names
        self.column = names.index("Time_ms" if self._exact else "TimeString")

    def read(self, cell: str) -> int:
        """The number of a time; raises ValueError."""
        if not self._exact:
            return self._stamps.add(cell)
        return round((_number(cell) * 1e-6 - _EPOCH) * 86_400_000) * 10**6

    def times(self, read: NDArray) -> NDArray:
        """Times (n,) in ns, since 1970 where the day is known."""
        return read if self._exact else self._stamps.times(read).astype(np.int64)


def _shared_times(logged: dict[str, tuple[NDArray, NDArray]]) -> NDArray:
    """The times in ns that all variables have; raises InputError where these are few."""
    times = [when for when, _ in logged.values()]
    shared = times[0]
    for other in times[1:]:
        shared = np.intersect1d(shared, other, assume_unique=True)
    if 2 * len(shared) < max(map(len, times)):
        raise InputError(
            f"its variables ({', '.join(logged)}) are logged at different times; log them in one "
            "cycle"
        )
    return shared


DIALECT = Dialect("data logs of WinCC", ENDINGS, read, is_its)
