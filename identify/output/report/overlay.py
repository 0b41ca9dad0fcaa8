"""Measured and modelled force against time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from identify.output.report.blocks import Block, Heading, Picture, Section
from identify.output.report.drawing import (
    BLUE,
    GREY,
    MEASURED,
    ORANGE,
    new_figure,
    noise_band,
    symmetric_limit,
)
from identify.output.report.subject import LogForces, Subject, forces_by_log
from identify.output.report.units import Scale
from identify.validation.misfit_maps import AxisComparison
from twin.model.units import units_of

Array = NDArray[np.float64]

STRETCH = 4.0  # s, shown at full size


def section(subject: Subject) -> Section:
    """One picture for each axis."""
    blocks: list[Block] = []
    for axis in subject.axes:
        if heading := subject.heading(axis.axis):
            blocks.append(Heading(heading))
        blocks.append(_picture(subject, axis))
    return Section("force", f"Measured and modelled {_words(subject)}", blocks)


def _words(subject: Subject) -> str:
    """What the axes are moved by: force, torque, or both."""
    return " and ".join(dict.fromkeys(axis.units.words("force") for axis in subject.axes))


def _picture(subject: Subject, axis: AxisComparison) -> Picture:
    forces = forces_by_log(axis, subject.model(axis.axis).mass, subject.final(axis.axis))
    shown = min(forces, key=lambda f: abs(_error(f, slice(None)) - axis.total_error))
    span = representative(shown, STRETCH)
    named = subject.found_on(axis.axis)
    force = axis.units.words("force")
    caption = (
        f"Log {shown.name}: the {force} that the model must explain (command less inertia) and the "
        f"{force} of the model. Top: the whole log. Middle: the shaded part of it. Bottom: the "
        "residual of that part."
    )
    return Picture(_figure(shown, span, axis.floor, named), caption)


def _error(forces: LogForces, part: slice) -> float:
    left = (forces.explain - forces.model)[part]
    seen = left[np.isfinite(left)]
    return float(np.sqrt(np.mean(seen**2))) if len(seen) else np.nan


def representative(forces: LogForces, length: float) -> slice:
    """The part of that length (s) whose error is nearest to that of the whole log."""
    step = forces.time[1] - forces.time[0] if len(forces.time) > 1 else length
    n = min(max(round(length / step), 2), len(forces.time))
    parts = [slice(a, a + n) for a in range(0, len(forces.time) - n + 1, max(n // 4, 1))]
    whole = _error(forces, slice(None))
    # A part at rest has no error to compare, so it is the last choice.
    distances = [abs(_error(forces, p) - whole) for p in parts]
    return parts[int(np.argmin(np.where(np.isfinite(distances), distances, np.inf)))]


def _figure(forces: LogForces, span: slice, floor: float, named: str) -> Figure:
    figure = new_figure(6.4)
    whole, stretch, left = figure.subplots(3, 1, height_ratios=(1.0, 1.5, 1.0))
    lines = _lines(forces, named)
    scale = Scale.of(forces.unit, forces.explain)
    for axes, part in ((whole, slice(None)), (stretch, span)):
        for line in lines:
            axes.plot(
                forces.time[part], scale(line.values[part]), color=line.color, label=line.label,
                linewidth=line.width, rasterized=len(forces.time[part]) > MOST_POINTS,
            )  # fmt: skip
        axes.set_ylabel(scale.label(units_of(forces.unit).words("Force")))
        axes.margins(x=0.01)
    whole.axvspan(forces.time[span][0], forces.time[span][-1], color=GREY, alpha=0.18, linewidth=0)
    _draw_residual(left, forces, span, floor, lines[1:])
    stretch.sharex(left)
    stretch.tick_params(labelbottom=False)
    for axes in (whole, left):
        axes.set_xlabel("Time (s)")
    stretch.set_xlabel("")
    both = zip(*(a.get_legend_handles_labels() for a in (stretch, left)), strict=True)
    figure.legend(*(first + second for first, second in both), loc="outside upper left", ncols=4)
    return figure


MOST_POINTS = 3000  # of a line that is drawn as a vector


@dataclass(frozen=True, eq=False)
class _Line:
    label: str
    values: Array
    color: str
    width: float


def _lines(forces: LogForces, named: str) -> list[_Line]:
    """The measured force as a wide line, so that it shows behind a model that fits."""
    lines = [
        _Line("measured (command less inertia)", forces.explain, MEASURED, 3.0),
        _Line("model", forces.model, BLUE, 1.2),
    ]
    if forces.found is not None:
        lines.append(_Line(f"model with {named}", forces.found, ORANGE, 1.2))
    return lines


def _draw_residual(
    axes: Axes, forces: LogForces, span: slice, floor: float, lines: Sequence[_Line]
) -> None:
    left = [(forces.explain - line.values)[span] for line in lines]
    limit = symmetric_limit(floor, *left)
    scale = Scale.of(forces.unit, [limit])
    noise_band(axes, float(scale(floor)))
    for values, line in zip(left, lines, strict=True):
        axes.plot(forces.time[span], scale(values), color=line.color, linewidth=1.0)
    axes.set_ylim(-float(scale(limit)), float(scale(limit)))
    axes.set_ylabel(scale.label("Unexplained"))
