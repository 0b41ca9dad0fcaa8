"""The force residual against time, speed, position and phase of the model's periods."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from identify.output.report.blocks import Block, Heading, Picture, Section
from identify.output.report.drawing import (
    BLUE,
    GREY,
    ORANGE,
    binned_mean,
    new_figure,
    noise_band,
    symmetric_limit,
)
from identify.output.report.subject import Subject, by_log
from identify.output.report.units import Scale, quantity, title_case
from identify.validation.misfit_maps import AxisComparison
from twin.model.units import LINEAR, AxisUnits

Array = NDArray[np.float64]


PANELS = 4
MOST_DOTS = 10_000  # more would fill the panel and the file; means are of all
# Markers make a mean visible whose neighbours on both sides are missing.
MEAN: dict[str, Any] = {"linewidth": 1.5, "markersize": 2.0}


@dataclass(frozen=True, eq=False)
class View:
    """One coordinate of the residual: values (n,) SI, quantity and unit."""

    values: Array
    quantity: str
    unit: str


@dataclass(frozen=True, eq=False)
class _Left:
    """Residual (n,) of the model, and of the model with what was found, and their floor.

    In the unit of force of ``units``.
    """

    model: Array
    named: Array | None
    label: str
    floor: float
    units: AxisUnits = LINEAR


def section(subject: Subject) -> Section:
    """One picture for each axis."""
    blocks: list[Block] = []
    for axis in subject.axes:
        if heading := subject.heading(axis.axis):
            blocks.append(Heading(heading))
        blocks.append(_picture(subject, axis))
    return Section("residual", "What the model leaves unexplained", blocks)


def _picture(subject: Subject, axis: AxisComparison) -> Picture:
    final, label = subject.final(axis.axis), f"mean with {subject.found_on(axis.axis)}"
    named = None
    if final is not None:
        named = np.concatenate(by_log(axis, final.residual, final.kept))[axis.kept]
    left = _Left(axis.residual, named, label, axis.floor, axis.units)
    caption = (
        "Dots are single test functions, lines the means. A mean outside the noise band shows what "
        "the missing force depends on: a wave along the track, a step with direction, a drift."
    )
    return Picture(_figure(_views(axis), left), axis.units.words(caption))


def _views(axis: AxisComparison) -> Sequence[View]:
    where, units = axis.coordinates, axis.units
    views = [
        View(_running_time(axis), "Time, logs in a row", "s"),
        View(where["velocity"], "Speed", units.velocity),
        View(where["position"], units.words("Position"), units.position),
    ]
    position, travelled = units.words("position"), np.ptp(where["position"])
    for phase, period in axis.periods.items():
        if len(views) < PANELS and travelled > period:
            cycle = quantity(period, units.position)
            name = f"{title_case(phase)}, {position} modulo {cycle}"
            views.append(View(where[phase], name, units.position))
    return views


def _running_time(axis: AxisComparison) -> Array:
    """Time (n,) s of each residual, as if every log began where the one before it ended."""
    ends = accumulate((float(log.motion.time[-1]) for log in axis.logs), initial=0.0)
    rows = [log.time + start for log, start in zip(axis.logs, ends, strict=False)]
    return np.concatenate(rows)[axis.kept]


def _figure(views: Sequence[View], left: _Left) -> Figure:
    figure = new_figure(5.4)
    limit = symmetric_limit(left.floor, left.model)
    scale = Scale.of(left.units.force, [limit])
    grid = figure.subplots(2, 2, sharey=True).ravel()
    for axes, view in zip(grid, views, strict=False):
        _draw(axes, view, left, scale)
        axes.set_ylim(-float(scale(limit)), float(scale(limit)))
    for axes in grid[len(views) :]:
        axes.remove()
    for axes in grid[: len(views) : 2]:
        axes.set_ylabel(scale.label(left.units.words("Unexplained force")))
    entries = grid[0].get_legend_handles_labels()
    figure.legend(*entries, loc="outside upper left", ncols=4, markerscale=3.0)
    return figure


def _draw(axes: Axes, view: View, left: _Left, scale: Scale) -> None:
    along = Scale.of(view.unit, view.values)
    x = along(view.values)
    shown = slice(None, None, -(-len(x) // MOST_DOTS))
    axes.plot(
        x[shown], scale(left.model[shown]), ".", color=GREY, markersize=2.4, alpha=0.5,
        markeredgewidth=0, rasterized=True, label="single test functions",
    )  # fmt: skip
    noise_band(axes, float(scale(left.floor)))
    axes.plot(*binned_mean(x, scale(left.model)), ".-", color=BLUE, label="mean", **MEAN)
    if left.named is not None:
        axes.plot(*binned_mean(x, scale(left.named)), ".-", color=ORANGE, label=left.label, **MEAN)
    axes.set_xlabel(along.label(view.quantity))
    axes.margins(x=0.01)
