"""A map proposed from a file alone, each entry with its reason; the user corrects and keeps it.

Which columns are which signals of an axis is told by their names and by the physics
(``twin.importers.proposal``).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from twin.errors import InputError
from twin.importers.importer import table_of
from twin.importers.mapping import EVERY_COLUMN, ImportMap
from twin.importers.nested import recordings_of
from twin.importers.own_rows import on_one_time_base
from twin.importers.proposal.axes import axes_of
from twin.importers.proposal.channels import with_channels
from twin.importers.proposal.courses import columns_of
from twin.importers.proposal.following import made_positions
from twin.importers.proposal.forces import exchanged, with_force
from twin.importers.proposal.lexicon import Quantity
from twin.importers.proposal.names import names_of, unit_of
from twin.importers.proposal.positions import with_position, with_rates, with_setpoints
from twin.importers.proposal.signals import File, ProposedAxis
from twin.importers.proposal.text import (
    PER_ONE,
    Answers,
    MapEntry,
    Need,
    entries_of,
    lines_of,
    needs_of,
    why_not,
)
from twin.importers.proposal.units import position_unit
from twin.importers.stated_time_base import find_time_base
from twin.importers.table import SignalTable, numbers
from twin.importers.units import find_unit, is_unit
from twin.logs.container import reading
from twin.logs.log import LINEAR_UNITS, ROTARY_UNITS, Array

_KINDS = tuple(dict.fromkeys((*LINEAR_UNITS.values(), *ROTARY_UNITS.values())))


@dataclass(frozen=True)
class ColumnRow:
    """A column, its range and course (n,), and what it is taken for, if anything, and why.

    assumed: whether its unit is.
    """

    column: str
    unit: str | None
    assumed: bool
    low: float
    high: float
    course: Array
    why: str
    axis: str | None = None
    field: str | None = None
    certainty: str | None = None


@dataclass(frozen=True)
class Proposal:
    """What is proposed for a file.

    head: the lines before the axes. tail: those behind them, of columns of no axis. holes: by
    column, where it has no number. timeless: what the file does not tell of its times. words: of
    columns that hold no numbers. asking: the line that asks for the sample rate, if any.
    """

    name: str
    file: File
    axes: tuple[ProposedAxis, ...]
    head: tuple[str, ...]
    tail: tuple[str, ...]
    holes: Mapping[str, str]
    timeless: tuple[str, ...] = ()
    words: tuple[str, ...] = ()
    asking: str = ""

    def map_text(self, answers: Answers) -> str:
        """The map, with what the user knows."""
        lines = [*self.head]
        if (rate := answers.get(RATE)) is not None:
            given = f"sample_rate = {rate} # Hz, as given"
            lines = [given if line == self.asking else line for line in lines]
        for axis in self.axes:
            lines += lines_of(self.file, axis, answers)
        return "\n".join([*lines, *self.tail]) + "\n"

    @property
    def asks_rate(self) -> bool:
        """Whether the file tells no sample rate."""
        return bool(self.asking)

    @cached_property
    def needs(self) -> list[Need]:
        """What the file does not tell."""
        return [need for axis in self.axes for need in needs_of(self.file, axis)]

    def lacks(self, answers: Answers) -> tuple[str, ...]:
        """What the user must still add for the map to be of use, one sentence each."""
        asked = [what for axis in self.axes for what in axis.asked.values()]
        scales = [
            f"axis {n.axis}: the scale of its {n.field} is not known: {n.what}"
            for n in self.needs
            if n.entry in PER_ONE and n.given(answers) is None
        ]
        words = self.words if asked or self.timeless else ()
        timeless = () if RATE in answers else self.timeless
        return (*timeless, *self.holes.values(), *asked, *scales, *words)

    @cached_property
    def rows(self) -> list[ColumnRow]:
        """Each column that varies, with what it is taken for."""
        rows = []
        for axis in self.axes:
            by_column = {e.signal.column: e for e in entries_of(self.file, axis)}
            rows += [self._row(axis, c, by_column.get(c)) for c in axis.columns]
        known = {row.column for row in rows}
        of_none = [c for c in self.file.columns if c not in known]
        return [*rows, *(self._row(None, c, None) for c in of_none)]

    def _row(self, axis: ProposedAxis | None, column: str, entry: MapEntry | None) -> ColumnRow:
        values, unit = self.file.columns[column], self.file.names[column].unit
        low, high = float(values.values.min()), float(values.values.max())
        if axis is None or entry is None:
            why = "of no axis by its name" if axis is None else why_not(self.file, axis, column)
            return ColumnRow(column, unit, False, low, high, values.short, why)
        signal, assumed = entry.signal, any(need.assumed for need in entry.needs)
        shown = position_unit(self.file, axis)[0] if signal.name.is_integral else entry.unit
        return ColumnRow(
            column, shown, assumed, low, high, values.short, ", ".join(signal.reasons),
            axis.name, signal.field, signal.certainty.value,
        )  # fmt: skip


def propose(path: Path) -> Proposal:
    """What is proposed for a file of any of the formats; raises InputError without a column."""
    with reading(path):
        table = table_of(path, EVERY_COLUMN)
        _require_one_recording(table)
        one = on_one_time_base(table)
        table = table if one is None else one.table
        columns, holes = _distinct(table)
        if not columns:
            raise InputError("has no column of numbers; give another file")
        if len(columns) > _MOST:
            raise InputError(
                f"has {len(columns)} columns, at most {_MOST} are looked at; is it written "
                "sideways, a signal a row? turn it, or give a map that names the columns"
            )
    stated = find_time_base(table, columns)
    if one is not None:
        clock = f"resample = {one.rate:g} # Hz, because each column has rows of its own"
        stated = replace(stated, lines=(*stated.lines, clock))
    moving = {n: c for n, c in columns.items() if n not in stated.used and np.ptp(c) > 0.0}
    known, made = not stated.missing, made_positions(moving, stated.step)
    moving |= {m.name.column: m.values for m in made}
    errors = {m.error for m in made if m.error is not None}
    moving = {n: c for n, c in moving.items() if n not in errors}
    names = names_of([*moving]) | {m.name.column: m.name for m in made}
    file = File(names, columns_of(moving), stated.step if known else None)
    axes = tuple(_axis(file, a, names) for a, names in axes_of(file.names, file.columns).items())
    used = {*stated.used, *(c for axis in axes for c in axis.columns), *errors}
    taken = {*stated.used, *(s.column for axis in axes for s in axis.signals.values())}
    left = {n: c for n, c in table.columns.items() if n not in used}
    others = [_about(n, c) + ", of no axis by its name" * (n in moving) for n, c in left.items()]
    head = f"# Proposed from {path.name}; correct what is wrong, above all what is ASSUMED"
    tail = ("", *(f"# not used: {other}" for other in others)) if others else ()
    missing = {n: hole for n, hole in holes.items() if n in taken}
    usual = max((len(c) for c in columns.values()), default=0)
    words = (*_in_words(table.columns), *_other_lengths(table, usual))
    lines = (head, *stated.lines)
    return Proposal(
        path.name, file, axes, lines, tail, missing, stated.missing, words, stated.asking
    )


def _require_one_recording(table: SignalTable) -> None:
    """Raise InputError where a file holds several, which are no axes of one machine."""
    if found := recordings_of(table.columns):
        some = next(name for name in table.columns if name.startswith(found[0]))
        raise InputError(
            f"holds {len(found)} recordings: {', '.join(found)}; give each as a file of its own, "
            f"or name the columns of one in a map, such as '{some}'"
        )


def _other_lengths(table: SignalTable, usual: int) -> Iterator[str]:
    """Of columns that are called as signals and have other rows than the usual ones, what to do."""
    lengths = {n: len(c) for n, c in table.columns.items() if len(c) not in (1, usual)}
    signals = (Quantity.POSITION, Quantity.FORCE, Quantity.CURRENT)
    for name, said in names_of([*lengths]).items():
        if said.quantity in signals:
            yield (
                f"'{name}' has {lengths[name]} rows, the others {usual}: give the file twice, with "
                "a table [[files]] and its time for each"
            )


def _axis(file: File, name: str, columns: Sequence[str]) -> ProposedAxis:
    """What is proposed for an axis of these columns."""
    axis = with_position(file, ProposedAxis(name, tuple(columns)))
    if (position := axis.signals.get("position")) is not None:
        axis = replace(axis, comes_round=file.column(position.name).wraps is not None)
    if "position" not in axis.signals:
        return axis.asking({"force": f"axis {name}: {_NO_MOTION}"})
    moved = exchanged(file, with_force(file, with_setpoints(file, with_rates(file, axis))))
    return with_channels(file, moved)


RATE = ("", "", "sample_rate")  # the key of an answer
_MOST = 400  # columns; of a robot of thirty joints ten each are some more than any has
_NO_MOTION = "without a position no column is known to be the force that moves it"


def _in_words(columns: Mapping[str, np.ndarray]) -> Iterator[str]:
    """Of each column whose cells have digits and are no numbers, what it holds."""
    for name, column in columns.items():
        cell = str(column[0]) if len(column) == 1 and column.dtype.kind in "UO" else ""
        if any(c.isdigit() for c in cell):
            yield f"column '{name}' holds text, such as {cell!r}, and no numbers; correct its cells"


def _about(name: str, raw: np.ndarray) -> str:
    """A column, or a single value, of no axis: its name and what it holds."""
    try:
        column = numbers(name, raw)
    except InputError:
        return f"{name} (no numbers)"
    if not len(column) or not np.isfinite(column).all():
        return f"{name} (not finite)"
    if np.ptp(column) == 0.0:
        return f"{name} = {column[0]:g}" + (" throughout" if len(column) > 1 else "")
    return f"{name} ({len(column)} rows, {column.min():.4g} to {column.max():.4g})"


def _distinct(table: SignalTable) -> tuple[dict[str, Array], dict[str, str]]:
    """The columns of numbers, each once, and where a straight line is across a hole in one.

    An entry of an array that has a name goes by that.
    """
    raw, out, holes = table.columns, dict[str, Array](), dict[str, str]()
    named = {(n.rpartition(".")[0], np.asarray(c).tobytes()) for n, c in raw.items()}
    for name, values in raw.items():
        try:
            column = numbers(name, values)
        except InputError:
            continue
        again = name.endswith("]") and (name.rpartition("[")[0], values.tobytes()) in named
        finite = np.flatnonzero(np.isfinite(column))
        if (
            len(column) > 2 and 2 * len(finite) > len(column) and not again
        ):  # else of another stated
            if hole := table.hole(name, column):
                holes[name] = hole
                column = np.interp(np.arange(len(column)), finite, column[finite])
            out[name] = column
    lengths = [len(c) for c in out.values()]  # that of the most columns is the recording's
    usual = max(lengths, key=lambda n: (lengths.count(n), n), default=0)
    return {name: column for name, column in out.items() if len(column) == usual}, holes


def doubts_of(mapping: ImportMap) -> Iterator[str]:
    """What a map lacks, and units that the names of its columns state otherwise, in brackets."""
    for name, axis in mapping.axes.items():
        for field, column in axis.columns.items():
            stated = unit_of(column.name, bracketed=True)
            if column.scale != 1.0 or not stated or not is_unit(stated, *_KINDS):
                continue
            unit = find_unit(stated, *_KINDS)
            if unit.si != column.si.si or not np.isclose(unit.size, column.si.size):
                yield (
                    f"axes.{name}.{field}: its column '{column.name}' is in {stated} by its name, "
                    f"in {column.unit} by the map; correct one of them"
                )
        if "force" not in axis.columns and axis.force_constant is None:
            yield (
                f"axes.{name}: has a current and no force_constant, so no force; add it to the map "
                "(N/A, see the motor's data sheet)"
            )
