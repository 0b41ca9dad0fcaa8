"""The force error after each added effect."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator
from numpy.typing import NDArray

from identify.dataset.given_logs import Role
from identify.output.report.blocks import Block, Column, Heading, Picture, Row, Section, Table
from identify.output.report.drawing import BLUE, GREY, ORANGE, new_figure
from identify.output.report.subject import Subject
from identify.output.report.units import Scale, number, spaced, title_case
from identify.results.addition import Addition
from twin.model.history import HistoryStep
from twin.model.units import units_of

Array = NDArray[np.float64]


def section(subject: Subject) -> Section | None:
    """A picture and a table for each axis with added effects; their position errors if known."""
    blocks: list[Block] = []
    for axis, steps in _by_axis(subject.steps).items():
        if len(_by_axis(subject.steps)) > 1 or subject.heading(axis):
            blocks.append(Heading(f"Axis {axis}"))
        blocks.append(_picture(steps, subject.floors(axis)))
        blocks.append(_table(steps))
    if subject.additions:
        blocks.append(_positions(subject.additions))
    return Section("growth", "The error, effect by effect", blocks) if blocks else None


def _by_axis(steps: Sequence[HistoryStep]) -> dict[str, list[HistoryStep]]:
    out: dict[str, list[HistoryStep]] = {}
    for step in steps:
        out.setdefault(step.axis, []).append(step)
    return out


def _picture(steps: Sequence[HistoryStep], floors: Mapping[Role, float]) -> Picture:
    caption = (
        "Force error after each effect was added and the model refitted. A real effect lowers the "
        "held-out error as much as the error on the fit logs."
    )
    return Picture(_figure(steps, floors), units_of(steps[0].unit).words(caption))


def _figure(steps: Sequence[HistoryStep], floors: Mapping[Role, float]) -> Figure:
    fit = [steps[0].fit_error_before, *(s.fit_error_after for s in steps)]
    held = _numbers([steps[0].holdout_error_before, *(s.holdout_error_after for s in steps)])
    figure = new_figure(3.2)
    axes = figure.subplots()
    scale = Scale.of(steps[0].unit, fit)
    axes.plot(scale(fit), "o-", color=BLUE, label="fit logs", linewidth=1.6)
    if np.isfinite(held).any():
        axes.plot(scale(held), "s--", color=ORANGE, label="held out", linewidth=1.6)
    tested = _numbers([steps[0].test_error_before, *(s.test_error_after for s in steps)])
    if np.isfinite(tested).any():
        axes.plot(scale(tested), "^-.", color=GREY, label="test", linewidth=1.6)
    _number_points(axes, scale(fit), scale(held))
    _draw_floors(axes, scale, floors, {Role.TRAINING: fit[-1], Role.SELECTION: float(held[-1])})
    names = ["at the start", *(_label(s) for s in steps)]
    axes.set_xticks(range(len(names)), names)
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.yaxis.set_minor_locator(NullLocator())
    axes.set_xlim(-0.4, len(names) - 0.6)
    axes.set_xlabel("Effect added")
    axes.set_ylabel(scale.label(units_of(steps[0].unit).words("Force error, RMS")))
    figure.legend(loc="outside upper right", ncols=3)
    return figure


def _draw_floors(
    axes: Axes, scale: Scale, floors: Mapping[Role, float], last: Mapping[Role, float]
) -> None:
    """The noise floor of the logs of each role whose error is drawn.

    A history from a file may be of other logs; where it ends below the floor of these, it is.
    """
    for role, color in ((Role.TRAINING, BLUE), (Role.SELECTION, ORANGE)):
        if role in floors and last[role] >= floors[role]:
            label = f"noise floor, {role.value} logs"
            axes.axhline(float(scale(floors[role])), color=color, linestyle=":", label=label)


def _numbers(values: Sequence[float | None]) -> Array:
    return np.array([np.nan if v is None else v for v in values])


def _number_points(axes: Axes, fit: Array, held: Array) -> None:
    """Values beside the points, the larger above and the smaller below: clear of a falling line."""
    for i, (a, b) in enumerate(zip(fit, held, strict=True)):
        for value, color, above in ((a, BLUE, not a < b), (b, ORANGE, not b <= a)):
            if np.isfinite(value):
                side, align = (7.0, "left") if above else (-7.0, "right")
                axes.annotate(
                    number(value), (i, value), (side, side), textcoords="offset points",
                    color=color, fontsize=8.5, ha=align, va="center",
                )  # fmt: skip


def _label(step: HistoryStep) -> str:
    name = spaced(step.effect)
    return f"+ {name}" if step.action == "add" else f"{step.action} {name}"


def _table(steps: Sequence[HistoryStep]) -> Table:
    errors = [e for s in steps for e in (s.fit_error_before, s.fit_error_after)]
    scale = Scale.of(steps[0].unit, errors)
    tested = any(s.test_error_after is not None for s in steps)
    rows = [
        Row(
            (
                title_case(s.effect) if s.action == "add" else _label(s),
                scale.text(s.fit_error_before),
                scale.text(s.fit_error_after),
                scale.text(s.holdout_error_before),
                scale.text(s.holdout_error_after),
                *((scale.text(s.test_error_before), scale.text(s.test_error_after)) * tested),
            )
        )
        for s in steps
    ]
    names = ["Fit, before", "Fit, after", "Held out, before", "Held out, after"]
    names += ["Test, before", "Test, after"] * tested
    columns = (Column("Effect added"), *(Column(n, numeric=True) for n in names))
    caption = "RMS force error; everything is refitted at each step."
    return Table(columns, rows, units_of(steps[0].unit).words(caption))


def _positions(additions: Sequence[Addition]) -> Table:
    scales = {
        unit: Scale.of(
            unit, [e for a in additions if a.units.position == unit for e in a.position_error or ()]
        )
        for unit in {a.units.position for a in additions}
    }
    rows = [
        Row(
            (
                f"{title_case(a.step.effect)} on {a.step.axis}",
                *(scales[a.units.position].text(e) for e in a.position_error or (None, None)),
                scales[a.units.position].text(a.replayed),
                "kept" if a.kept else "not supported",
            )
        )
        for a in additions
    ]
    names = ("Free run, before", "Free run, after", "Replayed by MuJoCo")
    columns = (
        Column("Effect added"), *(Column(n, numeric=True) for n in names), Column("Outcome")
    )  # fmt: skip
    told = dict.fromkeys(a.units.words("position") for a in additions)
    caption = f"RMS {' and '.join(told)} error of the model driven by the logged command."
    return Table(columns, rows, caption)
