"""The table of candidates: a row's values, as JSON has them, and its columns for page and terminal.

A column more is a field of `CandidateRow`, its value in `row_of`, and a `Column` of `COLUMNS`; then
`python -m identify.output.as_json`, and the stored texts of `tests/identify/output`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from identify.output.numbers import (
    DisplayUnit,
    change,
    number,
    percent,
    quantity,
    spaced,
    title_case,
)
from identify.output.words.diagnosis import why_not
from identify.selection.candidates import Candidate
from identify.selection.diagnosis import AxisDiagnosis
from twin.record import Number, record

UNBROKEN = "\u00a0"  # space at which no line ends


@record
class CandidateRow:
    """An effect that was tried beside the model."""

    effect: str
    parameters: Mapping[str, Number]
    parameter_units: Mapping[str, str]
    delta_bic: Number | None
    """Evidence, a difference of BIC; null where one linear step alone was taken."""
    holdout_error_before: Number
    """RMS force error on the logs that choose."""
    holdout_error_after: Number
    unit: str
    supported: bool
    part: Number
    """Of the squared error above the noise floor, that it removes."""
    why_not: str | None


def row_of(c: Candidate, found: AxisDiagnosis) -> CandidateRow:
    """What is told of a candidate of a diagnosis."""
    axis, name = c.fit.axis, c.effect.name
    return CandidateRow(
        effect=name,
        parameters=axis[name].values,
        parameter_units=axis.parameter_units(name),
        delta_bic=c.delta_bic if c.score else None,
        holdout_error_before=c.gain.before,
        holdout_error_after=c.gain.after,
        unit=axis.units.force,
        supported=c.supported,
        part=c.part,
        why_not=why_not(found, c) or None,
    )


@dataclass(frozen=True)
class Column:
    """A column: its title and cell on a page, and its part of a terminal's line, if it has one.

    cell, line: of a row, with the unit of all errors.
    """

    title: str
    cell: Callable[[CandidateRow, DisplayUnit], str]
    line: Callable[[CandidateRow, DisplayUnit], str] | None = None


def _errors(row: CandidateRow, unit: DisplayUnit) -> str:
    return "   " + " -> ".join(change(row.holdout_error_before, row.holdout_error_after, unit))


COLUMNS = (
    Column("Effect", lambda r, _: title_case(r.effect), lambda r, _: f"{r.effect:28s}"),
    Column(
        "Evidence (ΔBIC)", lambda r, _: number(r.delta_bic or 0.0),
        lambda r, _: f" {r.delta_bic or 0.0:10.1f}",
    ),
    Column("Error before", lambda r, unit: unit.text(r.holdout_error_before)),
    Column("Error after", lambda r, unit: unit.text(r.holdout_error_after), _errors),
    Column("Part removed", lambda r, _: percent(max(r.part, 0.0))),
    Column("Why not", lambda r, _: spaced(r.why_not or ""), lambda r, _: f"   {r.why_not or ''}"),
    Column("Values", lambda r, _: values_in_words(r.parameters, r.parameter_units)),
)  # fmt: skip


def line_of(row: CandidateRow) -> str:
    """A candidate as a line of a terminal."""
    if row.delta_bic is None:
        return f"{row.effect:28s} not refitted: {row.why_not or ''}"
    unit = DisplayUnit.of(row.unit, row.holdout_error_before)
    return "".join(c.line(row, unit) for c in COLUMNS if c.line is not None).rstrip()


def columns_of(rows: Sequence[CandidateRow]) -> dict[str, Callable[[CandidateRow], str]]:
    """The columns of a page by title, with the unit that suits all errors."""
    unit = DisplayUnit.of(rows[0].unit, [row.holdout_error_before for row in rows])

    def shown(column: Column) -> Callable[[CandidateRow], str]:
        return lambda row: column.cell(row, unit)

    return {column.title: shown(column) for column in COLUMNS}


def values_in_words(values: Mapping[str, float], units: Mapping[str, str]) -> str:
    """The values of an effect's parameters, with units."""
    texts = (f"{name} = {quantity(value, units[name])}" for name, value in values.items())
    return ", ".join(text.replace(" ", UNBROKEN) for text in texts)
