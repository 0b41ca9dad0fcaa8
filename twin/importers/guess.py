"""A map proposed from a file alone, each entry with its reason; the user corrects and keeps it.

Which columns are which signals of an axis is told by their names and by the physics
(``twin.importers.proposal``).
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from twin.errors import InputError
from twin.importers.importer import table_of
from twin.importers.mapping import EVERY_COLUMN, ImportMap, find_unit, is_unit
from twin.importers.proposal.axes import axes_of
from twin.importers.proposal.courses import columns_of
from twin.importers.proposal.forces import exchanged, with_force
from twin.importers.proposal.names import names_of, unit_of, units_of, words_of
from twin.importers.proposal.positions import with_position, with_rates, with_setpoints
from twin.importers.proposal.signals import Axis, File
from twin.importers.proposal.text import (
    SCALE,
    Answers,
    Entry,
    Need,
    entries_of,
    lines_of,
    needs_of,
    why_not,
)
from twin.importers.table import SignalTable, numbers
from twin.logs.container import reading
from twin.logs.log import LINEAR_UNITS, ROTARY_UNITS, Array

Columns = Mapping[str, Array]

_TIME_WORDS = ("time", "timestamp", "stamp", "t", "zeit", "clock")
_TIME_SIZES = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}
_KINDS = tuple(dict.fromkeys((*LINEAR_UNITS.values(), *ROTARY_UNITS.values())))


@dataclass(frozen=True)
class Guess:
    """text: of the map; missing: what the user must add, one sentence each."""

    text: str
    missing: tuple[str, ...]


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
    column, where it has no number.
    """

    name: str
    file: File
    axes: tuple[Axis, ...]
    head: tuple[str, ...]
    tail: tuple[str, ...]
    holes: Mapping[str, str]

    def map_text(self, answers: Answers) -> str:
        """The map, with what the user knows."""
        lines = [*self.head]
        for axis in self.axes:
            lines += lines_of(self.file, axis, answers)
        return "\n".join([*lines, *self.tail]) + "\n"

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
            if n.entry == SCALE and n.key not in answers
        ]
        return (*self.holes.values(), *asked, *scales)

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

    def _row(self, axis: Axis | None, column: str, entry: Entry | None) -> ColumnRow:
        values, unit = self.file.columns[column], self.file.names[column].unit
        low, high = float(values.values.min()), float(values.values.max())
        if axis is None or entry is None:
            why = "of no axis by its name" if axis is None else why_not(self.file, axis, column)
            return ColumnRow(column, unit, False, low, high, values.short, why)
        signal, assumed = entry.signal, any(need.assumed for need in entry.needs)
        return ColumnRow(
            column, entry.unit, assumed, low, high, values.short, ", ".join(signal.reasons),
            axis.name, signal.field, signal.certainty.value,
        )  # fmt: skip


def guess_map(path: Path) -> Guess:
    """A map for a file of any of the formats; raises InputError where it has no columns."""
    found = propose(path)
    return Guess(found.map_text({}), found.lacks({}))


def propose(path: Path) -> Proposal:
    """What is proposed for a file of any of the formats; raises InputError without a column."""
    with reading(path):
        table = table_of(path, EVERY_COLUMN)
        columns, holes = _distinct(table)
        if not columns:
            raise InputError("has no column of numbers; give another file")
    counters = [n for n, c in columns.items() if _counts(n, c)]
    time = _time({n: c for n, c in columns.items() if n not in counters})
    time_base, step = _time_base(columns, time, counters, table.sample_rate)
    known = time is not None or table.sample_rate is not None
    moving = {n: c for n, c in columns.items() if n not in (time, *counters) and np.ptp(c) > 0.0}
    file = File(names_of([*moving]), columns_of(moving), step if known else None)
    axes = tuple(_axis(file, a, names) for a, names in axes_of(file.names, file.columns).items())
    used = {time, *(c for axis in axes for c in axis.columns)}
    taken = {time, *(s.column for axis in axes for s in axis.signals.values())}
    left = {n: c for n, c in table.columns.items() if n not in used}
    others = [_about(n, c) + ", of no axis by its name" * (n in moving) for n, c in left.items()]
    head = f"# Proposed from {path.name}; correct what is wrong, above all what is ASSUMED"
    tail = ("", *(f"# not used: {other}" for other in others)) if others else ()
    missing = {n: hole for n, hole in holes.items() if n in taken}
    return Proposal(path.name, file, axes, (head, *time_base), tail, missing)


def _axis(file: File, name: str, columns: Sequence[str]) -> Axis:
    """What is proposed for an axis of these columns."""
    axis = with_position(file, Axis(name, tuple(columns)))
    if "position" not in axis.signals:
        return axis.asking({"force": f"axis {name}: {_NO_MOTION}"})
    return exchanged(file, with_force(file, with_setpoints(file, with_rates(file, axis))))


_NO_MOTION = "without a position no column is known to be the force that moves it"


def unit_in(name: str, *kinds: str) -> str | None:
    """The unit that a name states, of the quantities with these SI units; of all if none."""
    written = unit_of(name)
    for _, unit in units_of(written) if written else ():
        if is_unit(unit, *(kinds or _KINDS)):
            return unit
    return None


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
        if len(column) > 2 and 2 * len(finite) > len(column) and not again:  # else of another clock
            if hole := table.hole(name, column):
                holes[name] = hole
                column = np.interp(np.arange(len(column)), finite, column[finite])
            out[name] = column
    longest = max((len(c) for c in out.values()), default=0)
    return {name: column for name, column in out.items() if len(column) == longest}, holes


def _counts(name: str, column: Array) -> bool:
    """Whether a column is the number of its row: that tells no time, unless in a unit of it."""
    return unit_in(name, "s") is None and bool(np.all(np.diff(column) == 1.0))


def _time(columns: Columns) -> str | None:
    """The column of time stamps: it rises, and is called so or rises evenly."""
    rising = {n: c for n, c in columns.items() if np.mean(np.diff(c) > 0.0) > 0.9}
    called = [n for n in rising if set(words_of(n)) & set(_TIME_WORDS)]
    even = [n for n, c in rising.items() if np.ptp(np.diff(c)) < 0.5 * np.median(np.diff(c))]
    return next(iter([*called, *even]), None)


def _time_base(
    columns: Columns, time: str | None, counters: Sequence[str], stated: float | None
) -> tuple[list[str], float]:
    """The lines of the time base, and the step in s."""
    if stated is not None:
        return [f"# the file states its sample rate: {stated:g} Hz"], 1.0 / stated
    if time is None:
        why = f"{counters[0]} counts the rows" if counters else "no column rises as times do"
        return [f"sample_rate = 1000.0 # Hz, ASSUMED: {why}"], 1e-3
    steps = np.diff(columns[time])
    step = float(np.median(steps[steps > 0.0]))
    unit, reason = unit_in(time, "s"), "its name states the unit"
    if unit is None or not is_unit(unit, "s"):
        slowest, fastest = 20.0, 100_000.0  # Hz, of a log that a drive is identified from
        fits = [u for u, size in _TIME_SIZES.items() if slowest <= size / step <= fastest]
        unit = fits[0] if fits else "s"
        reason = f"that is {_TIME_SIZES[unit] / step:.6g} Hz"
    seconds = step * find_unit(unit, "s").size
    lines = [f"time = {_table(time, unit)} # rises by {step:.6g} {unit}: {reason}"]
    if np.abs(steps - step).max() > 0.01 * step:  # of a step; what is less even needs resample
        rate = float(f"{1.0 / seconds:.2g}")
        spread = f"{steps.min():.4g} to {steps.max():.4g} {unit}"
        lines.append(f"resample = {rate:g} # Hz, because the steps are uneven: {spread}")
    return lines, seconds


def _table(name: str, unit: str | None) -> str:
    column, text = (json.dumps(value, ensure_ascii=False) for value in (name, unit))
    return f"{{column = {column}, unit = {text}}}"


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
