"""What is wrong with the rows of a table of text, all of it in one sentence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from twin.errors import InputError
from twin.importers.table import MOST_NAMED

_COMMENTS = ("#", "%", "//", "!")


@dataclass(frozen=True)
class BadRow:
    """A row of a file: the number of its line, its text and its cells."""

    line: int
    text: str
    cells: Sequence[str]

    def cell(self, column: int) -> str:
        """One of its cells, "" where it is too short."""
        return self.cells[column] if column < len(self.cells) else ""


@dataclass(frozen=True)
class LeftOut:
    """Rows (by their index) that are no samples, and a sentence about each kind."""

    rows: tuple[int, ...]
    said: tuple[str, ...]


class BadCells:
    """Bad cells as they are met, of rows that are so wide."""

    def __init__(self, names: Sequence[str], width: int) -> None:
        self._names = names
        self._width = width
        self._cells: list[tuple[BadRow, int]] = []
        self._not_finite: list[tuple[BadRow, int]] = []
        self._headers: list[int] = []
        self._rows = 0
        self._bad_rows: list[tuple[int, BadRow, bool]] = []  # index, row, whether any cell is good
        self._bad_here = 0

    @property
    def has_header(self) -> bool:
        """Whether the names of the columns come again."""
        return bool(self._headers)

    @property
    def columns(self) -> set[int]:
        """The columns with a bad cell in a row that has good ones."""
        bad = {row.line for _, row, good in self._bad_rows if not good}
        return {k for row, k in self._cells if row.line not in bad}

    def add_header(self, line: int) -> None:
        """The names of the columns stand in a line again."""
        self._headers.append(line)

    def add(self, row: BadRow, column: int) -> None:
        """A cell is not what it must be."""
        self._cells.append((row, column))
        self._bad_here += 1

    def add_not_finite(self, row: BadRow, column: int) -> None:
        """A cell is a NaN, which is told beside others that are bad."""
        self._not_finite.append((row, column))

    def pass_rows(self, count: int) -> None:
        """So many rows have no bad cell."""
        self._rows += count

    def end_row(self, row: BadRow, read: Sequence[int]) -> None:
        """All cells of a row were looked at."""
        if self._bad_here:
            self._bad_rows.append((self._rows, row, self._bad_here < len(read)))
        self._rows += 1
        self._bad_here = 0

    def left_out(self) -> LeftOut:
        """Comments, text behind the last row, and a last line that is cut off."""
        out: dict[int, str] = {}
        last = self._rows - 1
        for index, row, good in reversed(self._bad_rows):
            cut = index == self._rows - 1 and len(row.cells) < self._width
            if index == last and (cut or not good):
                kind = "cut off" if cut and good else "text behind the last row"
                out[index] = f"line {row.line} is {kind} and left out: {row.text.strip()[:40]!r}"
                last -= 1
            elif not good and row.text.lstrip().startswith(_COMMENTS):
                out[index] = f"line {row.line} is a comment and left out: {row.text.strip()[:40]!r}"
        return LeftOut(tuple(sorted(out)), tuple(out[k] for k in sorted(out)))

    def require_none(self, left_out: LeftOut, *, but_empty: bool = False) -> None:
        """Raise InputError that names every bad cell of the other rows, or all but empty ones."""
        if self._headers:
            named = ", ".join(map(str, self._headers))
            one = len(self._headers) == 1
            count = {2: "two", 3: "three"}.get(len(self._headers) + 1, len(self._headers) + 1)
            raise InputError(
                f"line{'' if one else 's'} {named} {'is' if one else 'are'} the header again: "
                f"{count} recordings in one file; cut it there and import each as a log of its own"
            )
        rows = {row.line for index, row, _ in self._bad_rows if index in left_out.rows}
        cells = [
            (row, k) for row, k in self._cells
            if row.line not in rows and not (but_empty and not row.cell(k))
        ]  # fmt: skip
        if not cells:
            return
        cells = sorted(cells + self._not_finite, key=lambda cell: (cell[0].line, cell[1]))
        told = [self._cell_reason(row, k) for row, k in cells[:MOST_NAMED]]
        if len(told) == 1:
            raise InputError(f"{told[0]}{_remedy(cells[0][0].cell(cells[0][1]))}")
        more = f"; and {len(cells) - MOST_NAMED} more" if len(cells) > MOST_NAMED else ""
        empty = all(not row.cell(k) for row, k in cells)
        what = "empty" if empty else "no numbers"
        raise InputError(
            f"{len(cells)} cells are {what}: {'; '.join(told)}{more}; correct them or cut out "
            "their rows, or state header_line, delimiter or decimal in the map"
        )

    def _cell_reason(self, row: BadRow, column: int) -> str:
        cell = row.cell(column)
        what = f"{cell!r} is not" if cell else "is empty"
        return f"line {row.line}, column '{self._names[column]}': {what}"


def _remedy(cell: str) -> str:
    """What a cell ought to be."""
    if not cell:
        return "; complete or cut out the row"
    if ":" in cell:
        return (
            " a number, nor a time such as 2024-05-01 12:00:00.001; correct it, or give "
            "sample_rate (Hz) in place of time"
        )
    return " a number; correct it, or state header_line, delimiter or decimal in the map"
