"""The force of a nonparametric effect by position and by speed."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from identify.output.report.blocks import Block, Heading, Listing, Picture, Section
from identify.output.report.drawing import BLUE, ORANGE, binned_mean, new_figure
from identify.output.report.subject import Subject
from identify.output.report.units import Scale, spaced
from identify.output.words.numbers import capitalised
from identify.output.words.selection import nonparametric_in_words
from identify.validation.misfit_maps import AxisComparison
from twin.model.machine import Fitted


def section(subject: Subject) -> Section | None:
    """A picture for each nonparametric effect of the model; None where it has none."""
    blocks: list[Block] = []
    for axis in subject.axes:
        for fitted in subject.model(axis.axis).effects:
            if not fitted.effect.is_nonparametric:
                continue
            blocks.append(Heading(f"{spaced(fitted.effect.name)} on {axis.axis}".capitalize()))
            blocks.append(_picture(axis, fitted))
            blocks.append(Listing([capitalised(nonparametric_in_words(fitted))]))
    return Section("shape", "Fitted curves without physics", blocks) if blocks else None


def _picture(axis: AxisComparison, fitted: Fitted) -> Picture:
    caption = (
        "Mean force of the fitted curves along the logs, moving forwards and backwards. Its shape "
        "is a hint at the missing physics."
    )
    return Picture(_figure(axis, fitted), axis.units.words(caption))


def _figure(axis: AxisComparison, fitted: Fitted) -> Figure:
    force = axis.curves[fitted.effect.name]
    position = np.concatenate([log.motion.position for log in axis.logs])
    velocity = np.concatenate([log.motion.velocity for log in axis.logs])
    figure = new_figure(3.0)
    left, right = figure.subplots(1, 2, sharey=True)
    scale = Scale.of(axis.units.force, force)
    along, fast = (
        Scale.of(axis.units.position, position), Scale.of(axis.units.velocity, velocity)
    )  # fmt: skip
    for mask, color, label in (
        (velocity > 0.0, BLUE, "forwards"), (velocity < 0.0, ORANGE, "backwards")
    ):  # fmt: skip
        for axes, x in ((left, along(position)), (right, fast(velocity))):
            axes.plot(*binned_mean(x[mask], scale(force[mask])), color=color, label=label)
    left.set_xlabel(along.label(axis.units.words("Position")))
    right.set_xlabel(fast.label("Speed"))
    left.set_ylabel(scale.label(axis.units.words("Force of the curves")))
    figure.legend(*left.get_legend_handles_labels(), loc="outside upper left", ncols=2)
    return figure
