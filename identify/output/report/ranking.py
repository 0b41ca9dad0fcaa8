"""Every absent effect, ranked by how well it explains the force residual."""

from __future__ import annotations

from matplotlib.figure import Figure

from identify.output.report.blocks import Block, Column, Heading, Picture, Row, Section, Table, Tone
from identify.output.report.drawing import BLUE, GREY, INK, ORANGE, new_figure
from identify.output.report.subject import Subject
from identify.output.report.units import Scale, number, quantity, spaced, title_case
from identify.output.words.selection import tested_on
from identify.output.words.steps import why_not
from identify.results.told import Told
from identify.selection.candidates import Candidate
from identify.selection.diagnosis import AxisDiagnosis
from twin.effect import Effect
from twin.model.machine import AxisModel

WITH_VALUES = 3  # candidates whose parameter values are printed
UNBROKEN = "\u00a0"  # space at which no line ends
CLIP = 1.6  # of the error before; a bar that is longer is cut


def section(subject: Subject) -> Section | None:
    """A picture and a table for each axis that has candidates."""
    blocks: list[Block] = []
    for axis in subject.axes:
        found, told = subject.diagnosed(axis.axis), subject.told(axis.axis)
        if found is None or told is None or not found.ranking:
            continue
        if heading := subject.heading(axis.axis):
            blocks.append(Heading(heading))
        blocks.extend((_picture(found, told), _table(found)))
    return Section("ranking", "Candidates, ranked", blocks) if blocks else None


def _picture(found: AxisDiagnosis, told: Told) -> Picture:
    caption = (
        f"Force error on {tested_on(found)} data after each effect was added and everything "
        "refitted: a missing effect brings it from the dashed line towards the noise floor."
    )
    return Picture(_figure(found, told), found.dataset.units.words(caption))


def _figure(found: AxisDiagnosis, told: Told) -> Figure:
    figure = new_figure(0.9 + 0.27 * len(found.ranking))
    axes = figure.subplots()
    before, after = found.ranking[0].gain.before, [c.gain.after for c in found.ranking]
    scale = Scale.of(found.dataset.units.force, [before])
    end = float(scale(min(max(before, *after), CLIP * before)))
    lengths = [min(float(scale(a)), end) for a in after]
    colors = [ORANGE if c is found.best else BLUE if c.supported else GREY for c in found.ranking]
    axes.barh([_label(c) for c in found.ranking], lengths, color=colors, height=0.62)
    axes.axvline(float(scale(before)), color=INK, linestyle="--", label="before")
    floor = told.floors[found.dataset.chosen_on]
    axes.axvline(float(scale(floor)), color=INK, linestyle=":", label="noise floor")
    for row, error in enumerate(after):
        cut = "bar cut, " if scale(error) > end else ""
        axes.text(
            1.0, row, f"{cut}{number(float(scale(error)))}", ha="right", va="center", fontsize=8.5,
            transform=axes.get_yaxis_transform(),
        )  # fmt: skip
    axes.set_xlim(0.0, 1.15 * end)
    axes.invert_yaxis()
    axes.grid(False, axis="y")
    axes.tick_params(axis="y", length=0)
    tested = f"{tested_on(found).capitalize()} force error, RMS"
    axes.set_xlabel(scale.label(found.dataset.units.words(tested)))
    axes.set_ylabel("Effect added")
    figure.legend(loc="outside upper right", ncols=2)
    return figure


def _label(candidate: Candidate) -> str:
    return spaced(candidate.effect.name)


def _table(found: AxisDiagnosis) -> Table:
    errors = [e for c in found.ranking for e in (c.gain.before, c.gain.after)]
    scale = Scale.of(found.dataset.units.force, errors)
    rows = [
        Row(
            (
                title_case(c.effect.name),
                number(c.delta_bic) if c.score else "",
                scale.text(c.gain.before),
                scale.text(c.gain.after),
                f"{100.0 * max(c.part, 0.0):.0f} %" if c.score else "",
                spaced(why_not(found, c)),
                values_of(c.effect, c.fit.axis) if rank < WITH_VALUES else "",
            ),
            _tone(found, c),
        )
        for rank, c in enumerate(found.ranking)
    ]
    columns = (
        Column("Effect"),
        Column("ΔBIC", numeric=True),
        Column("Error before", numeric=True),
        Column("Error after", numeric=True),
        Column("Part removed", numeric=True),
        Column("Why not"),
        Column("Values"),
    )
    caption = (
        f"Error: RMS force, {tested_on(found)}. Part removed: of the squared error above the noise "
        "floor, on the training logs or on data left out of the fit, whichever is less."
    )
    return Table(columns, rows, found.dataset.units.words(caption))


def _tone(found: AxisDiagnosis, candidate: Candidate) -> Tone:
    if candidate is found.best:
        return Tone.STRONG
    return Tone.PLAIN if candidate.supported else Tone.MUTED


def values_of(effect: Effect, model: AxisModel) -> str:
    """The values of an effect's parameters in a model, with units."""
    values, units = model[effect.name].values, model.units
    texts = (f"{p.name} = {quantity(values[p.name], units(p.unit))}" for p in effect.parameters)
    return ", ".join(t.replace(" ", UNBROKEN) for t in texts)
