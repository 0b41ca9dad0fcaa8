"""Parameter values with their intervals, or the reason why there is none."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from identify.estimation.fit import Fit
from identify.estimation.intervals import Estimate
from identify.output.report.blocks import Block, Column, Heading, Row, Section, Table, Tone
from identify.output.report.subject import Subject, what_was_found
from identify.output.report.units import NOTHING, Scale, number, quantity
from identify.output.words.estimation import common_reason, no_interval_in_words
from identify.results.told import Told
from identify.selection.diagnosis import AxisDiagnosis
from identify.selection.nonparametric import nonparametric_labels
from twin.model.machine import AxisModel


def section(subject: Subject) -> Section:
    """A table for each axis: with intervals where the model was fitted here."""
    blocks: list[Block] = []
    for axis in subject.axes:
        if heading := subject.heading(axis.axis):
            blocks.append(Heading(heading))
        found = subject.diagnosed(axis.axis)
        told = subject.told(axis.axis)
        blocks.append(_fitted(found, told) if found and told else _given(subject.model(axis.axis)))
    return Section("parameters", "Parameters", blocks)


def _given(axis: AxisModel) -> Table:
    """Values of a model that was not fitted here."""
    meanings = _meanings(axis)
    units, mass = axis.units, axis.mass_parameter
    rows = [Row((mass.name, quantity(axis.mass, units(mass.unit)), meanings[mass.name]))]
    hidden = nonparametric_labels(axis)
    for fitted in axis.effects:
        for p in fitted.effect.parameters:
            label = f"{fitted.effect.name}.{p.name}"
            if label in hidden:
                continue
            value = quantity(fitted.values[p.name], units(p.unit))
            rows.append(Row((label, value, meanings[label])))
    columns = (Column("Parameter"), Column("Value", numeric=True), Column("Meaning"))
    return Table(columns, rows, "Values of the given model; twin fit adds intervals.")


def _fitted(found: AxisDiagnosis, told: Told) -> Table:
    """Values of the fitted model, beside those of the model with what was found."""
    fits, richest, known = {"Value": found.base}, found.final, {"Value": told.before}
    if found.final is not found.base:
        what = what_was_found(found)
        without, with_it = f"Without {what}", f"With {what}"
        fits = {without: found.base, with_it: richest}
        known = {without: told.before, with_it: told.after}
    base, rich = told.before, told.after
    labels = list(dict.fromkeys(e.label for e in (*rich, *base)))
    meanings = _meanings(richest.axis)
    meanings |= {e.label: f"{meanings[e.label]}, held" for e in rich if not e.free}
    parts = [
        _part(heading, fit, told.floor, known[heading], labels) for heading, fit in fits.items()
    ]
    columns = [c for part in parts for c in part.columns]
    new = {c.label for c in richest.scaling.where} - {c.label for c in found.base.scaling.where}
    rows = [
        Row(
            (label, *(cell for part in parts for cell in part.cells[i]), meanings.get(label, "")),
            Tone.STRONG if label in new else Tone.PLAIN,
        )
        for i, label in enumerate(labels)
    ]
    caption = " ".join(part.remark for part in parts if part.remark)
    return Table([Column("Parameter"), *columns, Column("Meaning")], rows, caption)


@dataclass(frozen=True)
class _Part:
    """Columns of one fit, their cells label by label, and why there are no intervals."""

    columns: Sequence[Column]
    cells: Sequence[Sequence[str]]
    remark: str


def _part(
    heading: str, fit: Fit, floor: float, found: Sequence[Estimate], labels: Sequence[str]
) -> _Part:
    known = {e.label: e for e in found}
    cells = [_cells(known.get(label)) for label in labels]
    columns = (Column(heading, numeric=True), Column("90 % interval"))
    if common_reason(found) is None:
        return _Part(columns, cells, "")
    # All values have the same reason, so it is in the caption instead of a column.
    error, words = quantity(fit.error, fit.axis.units.force), fit.axis.units.words
    remark = (
        f"{heading}: no intervals, because the {words('force error')} of {error} is "
        f"{number(fit.error / floor)} times the noise floor; the model is wrong by more than noise."
    )
    return _Part(columns[:1], [c[:1] for c in cells], remark)


def _cells(estimate: Estimate | None) -> tuple[str, str]:
    if estimate is None:
        return NOTHING, ""
    scale = Scale.of(estimate.unit, [estimate.value])
    if not estimate.free:
        return scale.text(estimate.value), ""
    if estimate.low is None or estimate.high is None:
        reason = no_interval_in_words(estimate.reason) if estimate.reason else ""
        return scale.text(estimate.value), reason
    low, value, high = scale.within(
        estimate.low, estimate.high, estimate.low, estimate.value, estimate.high
    )
    return f"{value} {scale.unit}".rstrip(), f"{low} … {high}"


def _meanings(axis: AxisModel) -> dict[str, str]:
    own = {
        f"{f.effect.name}.{p.name}": p.meaning for f in axis.effects for p in f.effect.parameters
    }
    return {axis.mass_parameter.name: axis.mass_parameter.meaning, **own}
