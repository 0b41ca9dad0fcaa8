"""Whiteness of the force residual: its histogram, and its correlations with 90 % bounds."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from identify.output.report.blocks import Block, Heading, Listing, Picture, Section
from identify.output.report.drawing import BLUE, FLOOR, GREY, INK, ORANGE, new_figure
from identify.output.report.subject import Subject
from identify.output.report.units import Scale, inverse
from identify.output.words.numbers import capitalised
from identify.output.words.validation import correlation_in_words, loop_in_words
from identify.validation.whiteness import Correlation, ResidualTests
from twin.model.units import AxisUnits


def section(subject: Subject) -> Section:
    """A picture for each axis, its numbers, and which lags are tested and why."""
    blocks: list[Block] = []
    for axis in subject.axes:
        if heading := subject.heading(axis.axis):
            blocks.append(Heading(heading))
        blocks += residual_test_blocks(axis.tests, axis.units)
    blocks.append(Listing(_reasons(subject)))
    return Section("tests", "Is the residual noise?", blocks)


def _reasons(subject: Subject) -> tuple[str, ...]:
    """How each axis was tested, each way once."""
    return tuple(
        dict.fromkeys(axis.units.words(loop_in_words(axis.tests.loop)) for axis in subject.axes)
    )


def residual_test_blocks(tests: ResidualTests, units: AxisUnits) -> list[Block]:
    """The picture of some residual tests, and their numbers in sentences."""
    caption = (
        f"The force residual on {tests.samples} test functions that do not overlap. Bars: its "
        "histogram beside the normal distribution of the noise floor. Grey bands: 90 % bounds, "
        "±1.645/√n for n test functions; a tenth of a white residual's values lie outside. Faint "
        "values are not tested."
    )
    items = [units.words(capitalised(correlation_in_words(c))) for c in tests.correlations]
    return [Picture(_figure(tests, units), units.words(caption)), Listing(items)]


def _figure(tests: ResidualTests, units: AxisUnits) -> Figure:
    figure = new_figure(5.2)
    grid = figure.subplots(2, 2).ravel()
    _draw_histogram(grid[0], tests, units)
    for axes, test in zip(grid[1:], tests.correlations, strict=True):
        _draw_correlation(axes, test)
    figure.legend(*grid[0].get_legend_handles_labels(), loc="outside upper left", ncols=2)
    return figure


def _draw_histogram(axes: Axes, tests: ResidualTests, units: AxisUnits) -> None:
    scale = Scale.of(units.force, tests.edges)
    edges = scale(tests.edges)
    # Density by the printed unit.
    axes.stairs(
        scale.size * tests.density, edges, fill=True, color=BLUE, alpha=0.55, label="residual"
    )
    at = np.linspace(edges[0], edges[-1], 400)
    floor = float(scale(tests.floor))
    normal = np.exp(-0.5 * (at / floor) ** 2) / (np.sqrt(2.0 * np.pi) * floor)
    axes.plot(at, normal, color=ORANGE, label="normal, of the noise floor")
    axes.set_xlabel(scale.label(units.words("Force residual")))
    axes.set_ylabel(f"Density ({inverse(scale.unit)})")


def _draw_correlation(axes: Axes, test: Correlation) -> None:
    axes.axhspan(-test.bound, test.bound, color=FLOOR, alpha=0.7, linewidth=0)
    scale = Scale.of("s", test.lag)
    lag = scale(test.lag)
    for mask, color in ((test.tested, BLUE), (~test.tested, GREY)):
        alpha = 1.0 if color == BLUE else 0.5
        axes.vlines(lag[mask], 0.0, test.value[mask], color=color, alpha=alpha, linewidth=1.4)
    axes.axhline(0.0, color=INK, linewidth=0.8)
    reach = 1.15 * max(2.0 * test.bound, float(np.abs(test.value).max()))
    axes.set_ylim(-reach, reach)
    own = test.signal == "residual"
    axes.set_xlabel(scale.label("Lag" if own else f"Lag, {test.signal} first where positive"))
    axes.set_ylabel("Autocorrelation (1)" if own else f"Correlation with {test.signal} (1)")
