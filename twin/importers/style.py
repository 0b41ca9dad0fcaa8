"""How a line of text is cut into cells, and how a cell is a number, or a number with its unit."""

from __future__ import annotations

import csv
import itertools
import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property

from twin.importers.proposal.names import units_of
from twin.importers.units import QUANTITIES, Unit, find_unit, is_usual_unit

_BY_POINTS = re.compile(r"(?<![\d:.])[1-9]\d{0,2}(\.\d{3})+(?![\d.])")  # 1.234, in no time of day
# a number and what may be its unit: 12.3 mm, 80%, 1.2 N m
_QUANTITY = re.compile(r"([-+]?[\d.,]*\d(?:[eE][-+]?\d+)?)\s*([^\W\d][^\s,;]{0,9}(?: m)?|[°%])")
_DURATIONS = {"sec": "s", "hr": "h"}  # of MATLAB


def quantity_of(cell: str) -> tuple[str, str] | None:
    """The number in a cell and the known unit behind it; None where it is no such cell."""
    parts = _QUANTITY.fullmatch(cell)
    return None if parts is None or _unit(parts[2]) is None else (parts[1], parts[2])


def _bare(cell: str) -> str:
    quantity = quantity_of(cell)
    return cell if quantity is None else quantity[0]


@cache
def _unit(text: str) -> Unit | None:
    """A unit as a recorder spells it; None where it is none."""
    spelled = (_DURATIONS.get(text, text), *(unit for _, unit in units_of(text)))
    usual = next((unit for unit in spelled if is_usual_unit(unit)), None)
    return None if usual is None else find_unit(usual, *QUANTITIES)


@cache
def _times(given: str, unit: str | None) -> float:
    """How many of a unit one of the given one is; raises ValueError for another quantity's."""
    here = _unit(given)
    if unit is None or unit == given or here is None:
        return 1.0
    there = _unit(unit)
    if there is None or there.si != here.si or here.si is None or here.zero != there.zero:
        raise ValueError(given)
    return here.size / there.size


@dataclass(frozen=True)
class Style:
    """How a line is cut into cells, and how a cell is a number.

    grouping: whether the sign that is not the decimal one groups thousands, as in 1.234,5; else a
    file mixes both as decimal signs.
    """

    delimiter: str | None
    decimal: str
    grouping: bool = True

    def cells(self, line: str) -> list[str]:
        """The cells of a line; one that begins with # or % has no other first cell for that."""
        text = line.strip(" \r\n").removeprefix("#").removeprefix("%").strip(" ")
        if self.delimiter is None:
            return text.split()
        if '"' not in text:  # of a million lines nearly all
            return [cell.strip() for cell in text.split(self.delimiter)] if text else []
        return [cell.strip() for cell in next(csv.reader([text], delimiter=self.delimiter), [])]

    def value(self, cell: str, unit: str | None = None) -> float:
        """The number in a cell, which may group its thousands; raises ValueError.

        unit: in which it is, where the cell states a unit too; None: whatever that is.
        """
        if self.decimal == "," and "." in cell and self.is_grouped(cell):
            return self._less_groups(cell)
        try:
            return float(cell if self.decimal == "." else cell.replace(self.decimal, "."))
        except ValueError:
            if "\u2212" in cell:  # the minus of typography
                return self.value(cell.replace("\u2212", "-"), unit)
            if re.fullmatch(r"[-+\d.,]+[dD][-+]?\d+", cell):  # of Fortran: 1.5D-03
                return self.value(re.sub("[dD]", "e", cell))
            if re.fullmatch(r"[-+]?0[xX][\da-fA-F]+", cell):  # of a register: 0x1A2B
                return float(int(cell, 16))
            if self.is_grouped(cell):
                return self._less_groups(cell)
            if (quantity := quantity_of(cell)) is None:
                raise
            return self.value(quantity[0]) * _times(quantity[1], unit)

    def is_grouped(self, cell: str) -> bool:
        """Whether a cell is a number with grouped thousands, which never begins with 0."""
        return self._grouped.fullmatch(cell) is not None

    def has_grouped(self, line: str) -> bool:
        """Whether any part of a line may be such a number by the other sign."""
        return self.grouping and _BY_POINTS.search(line) is not None

    @cached_property
    def _grouped(self) -> re.Pattern[str]:
        other = {",": ".", ".": ","}[self.decimal] if self.grouping else ""
        return re.compile(
            rf"[-+]?[1-9]\d{{0,2}}([{other}'’\s])\d{{3}}(\1\d{{3}})*({re.escape(self.decimal)}\d+)?"
        )

    def _less_groups(self, cell: str) -> float:
        signs = {c for c in cell if not c.isalnum() and c not in "+-"} - {self.decimal}
        return float("".join(c for c in cell if c not in signs).replace(self.decimal, "."))

    def is_number(self, cell: str) -> bool:
        """Whether a cell is a number."""
        try:
            self.value(cell)
        except ValueError:
            return False
        return True

    def share_of_numbers(self, lines: Sequence[str], columns: int) -> float:
        """Of the cells of ``lines``; 0 where most of them have fewer than so many columns."""
        rows = [self.cells(line) for line in lines]
        if sum(len(row) >= columns for row in rows) * 2 <= len(rows):
            return 0.0
        cells = list(itertools.chain.from_iterable(rows))
        return sum(map(self.is_number, cells)) / max(len(cells), 1)

    def grouped(self, lines: Sequence[str]) -> int:
        """How many cells are numbers with grouped thousands, or none where the other sign counts.

        Of two styles that read as many numbers the plainer is right: 1,234 is no thousand where
        every number has three digits behind its comma, and 0,012 is none at all.
        """
        cells = [cell for line in lines for cell in self.cells(line)]
        return sum(self.is_grouped(_bare(c)) or not self.is_number(c) for c in cells)
