"""A law of another shape than the machine's force: the curve assumed beside the curve found."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from identify.output.report.blocks import Block, Heading, Picture, Section
from identify.output.report.drawing import BLUE, INK, ORANGE, new_figure
from identify.output.report.subject import Subject
from identify.output.report.units import SCALED, Scale, spaced
from identify.output.words.findings import advice, shape_in_words
from identify.output.words.numbers import capitalised
from identify.selection.findings import Finding
from identify.selection.found_shape import BEHIND, FoundShape
from twin.model.units import units_of


def section(subject: Subject) -> Section | None:
    """A picture for each law that is found to have another shape; None where there is none."""
    blocks: list[Block] = []
    for axis in subject.axes:
        diagnosed = subject.diagnosed(axis.axis)
        for finding in diagnosed.findings if diagnosed else ():
            if finding.shape is not None:
                blocks.append(Heading(f"{spaced(finding.effect)} on {axis.axis}".capitalize()))
                blocks.append(_picture(finding, finding.shape))
    return Section("law-shape", "The shape of a law", blocks) if blocks else None


def _picture(finding: Finding, shape: FoundShape) -> Picture:
    words = units_of(finding.unit).words
    caption = (
        f"{shape_in_words(finding.effect, shape, SCALED)} Where the band holds the dashed line, "
        f"these logs do not tell the two apart. {capitalised(advice([finding]))}"
    )
    return Picture(_figure(shape), words(caption))


def _figure(shape: FoundShape) -> Figure:
    figure = new_figure(3.0)
    every = figure.subplots(1, len(shape.curves), sharey=True, squeeze=False)[0]
    scale = Scale.of(shape.force_unit, [np.nanmax(np.abs(c.found)) for c in shape.curves.values()])
    along = Scale.of(shape.unit, shape.coordinate)
    x = along(shape.coordinate)
    words = units_of(shape.force_unit).words
    for axes, (direction, curve) in zip(every, shape.curves.items(), strict=True):
        color = ORANGE if direction == BEHIND else BLUE
        low, high = scale(curve.found - curve.band), scale(curve.found + curve.band)
        axes.fill_between(x, low, high, color=color, alpha=0.2, linewidth=0, label="90 % band")
        axes.plot(x, scale(curve.found), color=color, label="found in the logs")
        axes.plot(x, scale(curve.assumed), color=INK, linestyle="--", label="assumed by the law")
        axes.set_title(direction)
        name = "within one period" if shape.period is not None else ""
        axes.set_xlabel(along.label(words(f"{shape.over.value} {name}".strip()).capitalize()))
    every[0].set_ylabel(scale.label(words("Force of the law")))
    figure.legend(*every[0].get_legend_handles_labels(), loc="outside upper right", ncols=3)
    return figure
