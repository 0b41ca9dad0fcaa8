"""Misfit maps: RMS force error along each coordinate and by frequency, with the noise band."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

from identify.output.report.blocks import Picture
from identify.output.report.drawing import BLUE, FLOOR, new_figure
from identify.output.report.units import Scale, title_case
from identify.validation.misfit_maps import AxisComparison, MisfitMap
from twin.model.units import AxisUnits, units_of

COLUMNS = 4
NAMES = {
    "velocity": "Speed",
    "distance_since_reversal": "Since reversal",
    "other_axis_velocity": "Other axis speed",
    "other_axis_acceleration": "Other axis acc.",
}


def picture(axis: AxisComparison) -> Picture:
    """RMS force error against every coordinate of an axis."""
    caption = (
        "RMS force error by region; the grey band is the noise floor there. By frequency it is the "
        "error in bands of half an octave, independent of the test function."
    )
    return Picture(_figure(axis), axis.units.words(caption))


def _figure(axis: AxisComparison) -> Figure:
    shown = [m for m in axis.maps if np.ptp(m.low) > 0.0 and m.coordinate != "direction"]
    rows = -(-len(shown) // COLUMNS)
    figure = new_figure(0.4 + 1.9 * rows)
    grid = figure.subplots(rows, COLUMNS, squeeze=False, sharey=True)
    scale = Scale.of(axis.units.force, np.concatenate([m.rms for m in shown]))
    seen = np.concatenate([np.append(m.rms[m.visited > 0.0], m.floor) for m in shown])
    lowest = float(np.min(seen[seen > 0.0], initial=np.inf))
    for axes, found in zip(grid.ravel(), shown, strict=False):
        _draw(axes, found, scale, lowest, axis.units)
    for axes in grid.ravel()[len(shown) :]:
        axes.remove()
    for axes in grid[:, 0]:
        axes.set_ylabel(scale.label("RMS error"))
    figure.legend(*grid[0, 0].get_legend_handles_labels(), loc="outside upper left", ncols=2)
    return figure


def _draw(axes: Axes, found: MisfitMap, scale: Scale, lowest: float, units: AxisUnits) -> None:
    along = Scale.of(found.unit, np.concatenate([found.low, found.high]))
    edges = along(np.append(found.low, found.high[-1]))
    visited = np.where(found.visited > 0.0, found.rms, np.nan)
    low = 0.5 * float(scale(lowest))
    noise: dict[str, Any] = {"fill": True, "color": FLOOR, "alpha": 0.7, "label": "noise floor"}
    axes.stairs(scale(found.floor), edges, baseline=low, **noise)
    axes.stairs(
        scale(visited),
        edges,
        baseline=None,
        color=BLUE,
        linewidth=1.4,
        label=units.words("force error"),
    )
    axes.set_yscale("log")
    _plain_decades(axes.yaxis)
    axes.set_ylim(bottom=low)
    name = NAMES.get(found.coordinate, title_case(found.coordinate))
    axes.set_xlabel(along.label(units_of(found.unit).words(name)))
    if found.coordinate == "standstill":
        axes.set_xticks([0.0, 1.0], ["moving", "at rest"])
    if found.coordinate == "frequency":
        axes.set_xscale("log")
        _plain_decades(axes.xaxis)


def _plain_decades(axis: Axis) -> None:
    """A logarithmic axis with a plain number at each decade."""
    axis.set_major_locator(LogLocator(subs=(1.0,)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_locator(NullLocator())
