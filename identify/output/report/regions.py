"""Where the error is: the worst regions, the misfit maps, and what the error depends on."""

from __future__ import annotations

from collections.abc import Mapping

from matplotlib.figure import Figure

from identify.estimation.decision import RULE
from identify.estimation.residual_dependence import Dependence
from identify.output.report import maps
from identify.output.report.blocks import Block, Heading, Listing, Picture, Section
from identify.output.report.drawing import BLUE, GREY, new_figure
from identify.output.report.subject import Subject
from identify.output.report.units import SCALED, spaced
from identify.output.words.numbers import capitalised
from identify.output.words.validation import region_in_words
from identify.selection.diagnosis import AxisDiagnosis
from identify.validation.misfit_maps import AxisComparison
from twin.model.units import units_of


def section(subject: Subject) -> Section | None:
    """The worst regions and maps of each axis above its noise floor, and the dependence found."""
    blocks: list[Block] = []
    for axis in subject.axes:
        own = _blocks(axis, subject.diagnosed(axis.axis)) if axis.ratio >= RULE.at_floor else []
        heading = subject.heading(axis.axis)
        if own and heading:
            blocks.append(Heading(heading))
        blocks.extend(own)
    return Section("regions", "Where the error is", blocks) if blocks else None


def _blocks(axis: AxisComparison, found: AxisDiagnosis | None) -> list[Block]:
    blocks: list[Block] = []
    if axis.worst:
        blocks.append(Listing([capitalised(region_in_words(r, SCALED)) for r in axis.worst]))
    blocks.append(maps.picture(axis))
    if found is not None and found.unexplained is not None:
        blocks.append(_picture(found.unexplained, {m.coordinate: m.unit for m in axis.maps}))
    return blocks


def _picture(dependence: Dependence, units: Mapping[str, str]) -> Picture:
    caption = (
        "Part of the squared error that a curve over each coordinate alone accounts for; the "
        "missing physics depends most on the coordinate with the longest bar."
    )
    return Picture(_figure(dependence, units), caption)


def _figure(dependence: Dependence, units: Mapping[str, str]) -> Figure:
    ordered = sorted(dependence.shares.items(), key=lambda pair: -pair[1])
    figure = new_figure(0.7 + 0.27 * len(ordered))
    axes = figure.subplots()
    names = [units_of(units.get(name)).words(spaced(name)) for name, _ in ordered]
    percent = [100.0 * share for _, share in ordered]
    colors = [BLUE if name == dependence.depends_on else GREY for name, _ in ordered]
    bars = axes.barh(names, percent, color=colors, height=0.62)
    axes.bar_label(bars, fmt="%.0f", padding=4, fontsize=8.5)
    axes.set_xlim(0.0, 1.1 * max(*percent, 1.0))
    axes.invert_yaxis()
    axes.grid(False, axis="y")
    axes.tick_params(axis="y", length=0)
    axes.set_xlabel("Share of the squared error (%)")
    axes.set_ylabel("Coordinate")
    return figure
