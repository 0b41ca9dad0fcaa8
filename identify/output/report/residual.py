"""What the model leaves: forces against time, the residual and its tests, errors by log."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import accumulate
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from identify.estimation.residual_dependence import Dependence
from identify.output.numbers import (
    Scale,
    capitalised,
    inverse,
    number,
    quantity,
    spaced,
    title_case,
)
from identify.output.report.drawing import (
    BLUE,
    FLOOR,
    GREY,
    INK,
    MEASURED,
    ORANGE,
    binned_mean,
    draw_bars,
    new_figure,
    noise_band,
    plain_decades,
    symmetric_limit,
)
from identify.output.report.page import Block, Column, Listing, Picture, Row, Table
from identify.output.report.subject import AxisView, Subject
from identify.output.words.residual import correlation_in_words, loop_in_words, region_in_words
from identify.rules import RULE
from identify.validation.free_run import HORIZON
from identify.validation.misfit_maps import MisfitMap
from identify.validation.whiteness import Correlation, ResidualTests
from twin.model.units import LINEAR, AxisUnits, units_of

Array = NDArray[np.float64]

# --- measured and modelled force against time ------------------------------------------------

STRETCH = 4.0  # s, shown at full size
MOST_POINTS = 3000  # of a line that is drawn as a vector
MEASURED_FORCE = "measured force minus mass x acceleration"


@dataclass(frozen=True, eq=False)
class LogForces:
    """Forces of one axis over one log, each (n,) in ``unit``; time (n,) s.

    explain: command minus mass x acceleration, the force that the effects must explain. model,
    found: that force by the model, and by the model with what was found; nan where static friction
    is undetermined.
    """

    name: str
    time: Array
    explain: Array
    model: Array
    found: Array | None
    unit: str = LINEAR.force

    def error(self, part: slice = slice(None)) -> float:
        """RMS residual of the model in a part of the log; no number at rest."""
        left = (self.explain - self.model)[part]
        seen = left[np.isfinite(left)]
        return float(np.sqrt(np.mean(seen**2))) if len(seen) else np.nan

    def representative(self, length: float) -> slice:
        """The part of that length (s) whose error is nearest to that of the whole log."""
        step = self.time[1] - self.time[0] if len(self.time) > 1 else length
        n = min(max(round(length / step), 2), len(self.time))
        parts = [slice(a, a + n) for a in range(0, len(self.time) - n + 1, max(n // 4, 1))]
        # A part at rest has no error to compare, so it is the last choice.
        distances = [abs(self.error(p) - self.error()) for p in parts]
        return parts[int(np.argmin(np.where(np.isfinite(distances), distances, np.inf)))]


def forces_by_log(view: AxisView) -> list[LogForces]:
    """Forces of the model of the comparison, and of the final one, over each log."""
    axis, final = view.axis, view.final
    left = view.by_log(axis.residual, axis.kept)
    less = view.by_log(final.residual, final.kept) if final else [None] * len(left)
    explain = [log.command - view.model.mass * log.acceleration for log in axis.logs]
    return [
        LogForces(
            log.motion.name, log.time, e, e - a, None if b is None else e - b, view.units.force
        )
        for log, e, a, b in zip(axis.logs, explain, left, less, strict=True)
    ]


def forces(view: AxisView) -> list[Block]:
    """The log whose error is nearest to that of all, whole and in part."""
    error = view.axis.total_error
    shown = min(forces_by_log(view), key=lambda f: abs(f.error() - error))
    caption = (
        f"Log {shown.name}: the force that the model must explain (measured force minus mass x "
        "acceleration) and the force of the model. Top: the whole log. Middle: the shaded part of "
        "it. Bottom: the residual of that part."
    )
    figure = draw_forces(shown, shown.representative(STRETCH), view.axis.floor, view.label)
    return [Picture(figure, view.words(caption))]


def draw_forces(forces: LogForces, span: slice, floor: float, named: str) -> Figure:
    """The whole log, the part, and its residual. named: what was found."""
    figure = new_figure(6.4)
    whole, stretch, left = figure.subplots(3, 1, height_ratios=(1.0, 1.5, 1.0))
    words, scale = units_of(forces.unit).words, Scale.of(forces.unit, forces.explain)
    # The measured force is a wide line, so that it shows behind a model that fits.
    lines = [(words(MEASURED_FORCE), forces.explain, MEASURED, 3.0)]
    lines.append(("model", forces.model, BLUE, 1.2))
    if forces.found is not None:
        lines.append((f"model with {named}", forces.found, ORANGE, 1.2))
    for axes, part in ((whole, slice(None)), (stretch, span)):
        for label, values, color, width in lines:
            axes.plot(
                forces.time[part], scale(values[part]), color=color, label=label,
                linewidth=width, rasterized=len(forces.time[part]) > MOST_POINTS,
            )  # fmt: skip
        axes.set_ylabel(scale.label(words("Force")))
        axes.margins(x=0.01)
    whole.axvspan(forces.time[span][0], forces.time[span][-1], color=GREY, alpha=0.18, linewidth=0)
    residuals = [(forces.explain - values)[span] for _, values, _, _ in lines[1:]]
    limit = symmetric_limit(floor, *residuals)
    scale = Scale.of(forces.unit, [limit])
    noise_band(left, float(scale(floor)))
    for values, (_, _, color, _) in zip(residuals, lines[1:], strict=True):
        left.plot(forces.time[span], scale(values), color=color, linewidth=1.0)
    left.set_ylim(-float(scale(limit)), float(scale(limit)))
    left.set_ylabel(scale.label("Unexplained"))
    stretch.sharex(left)
    stretch.tick_params(labelbottom=False)
    whole.set_xlabel("Time (s)")
    left.set_xlabel("Time (s)")
    both = zip(*(a.get_legend_handles_labels() for a in (stretch, left)), strict=True)
    figure.legend(*(first + second for first, second in both), loc="outside upper left", ncols=4)
    return figure


# --- the residual against time, speed, position and phase ------------------------------------

PANELS = 4
MOST_DOTS = 10_000  # more would fill the panel and the file; means are of all
# Markers make a mean visible whose neighbours on both sides are missing.
MEAN: dict[str, Any] = {"linewidth": 1.5, "markersize": 2.0}


@dataclass(frozen=True, eq=False)
class Panel:
    """One coordinate of the residual: values (n,) SI, quantity and unit."""

    values: Array
    quantity: str
    unit: str


def residuals(view: AxisView) -> list[Block]:
    """Dots and means of the residual of the model, and means of that with what was found."""
    axis, final = view.axis, view.final
    means = {"mean": axis.residual}
    if final is not None:
        left = np.concatenate(view.by_log(final.residual, final.kept))
        means[f"mean with {view.label}"] = left[axis.kept]
    caption = (
        "Dots are single test functions, lines the means. A mean outside the noise band shows what "
        "the missing force depends on: a wave along the track, a step with direction, a drift."
    )
    figure = draw_residuals(panels(view), means, axis.floor, view.units)
    return [Picture(figure, view.words(caption))]


def panels(view: AxisView) -> list[Panel]:
    """Time, speed, position, and the phases of the model's periods."""
    axis, units = view.axis, view.units
    where, position = axis.coordinates, units.words("position")
    # Time as if every log began where the one before it ended.
    ends = accumulate((float(log.motion.time[-1]) for log in axis.logs), initial=0.0)
    rows = [log.time + start for log, start in zip(axis.logs, ends, strict=False)]
    shown = [
        Panel(np.concatenate(rows)[axis.kept], "Time, logs in a row", "s"),
        Panel(where["velocity"], "Speed", units.velocity),
        Panel(where["position"], position.capitalize(), units.position),
    ]
    for phase, period in axis.periods.items():
        if len(shown) < PANELS and np.ptp(where["position"]) > period:
            name = f"{title_case(phase)}, {position} modulo {quantity(period, units.position)}"
            shown.append(Panel(where[phase], name, units.position))
    return shown


def draw_residuals(
    shown: Sequence[Panel], means: Mapping[str, Array], floor: float, units: AxisUnits = LINEAR
) -> Figure:
    """Dots of the first residual (n,), and the means of all, by label."""
    figure, (first, *_) = new_figure(5.4), means.values()
    limit = symmetric_limit(floor, first)
    scale = Scale.of(units.force, [limit])
    grid = figure.subplots(2, 2, sharey=True).ravel()
    for axes, panel in zip(grid, shown, strict=False):
        along = Scale.of(panel.unit, panel.values)
        x, dots = along(panel.values), slice(None, None, -(-len(panel.values) // MOST_DOTS))
        axes.plot(
            x[dots], scale(first[dots]), ".", color=GREY, markersize=2.4, alpha=0.5,
            markeredgewidth=0, rasterized=True, label="single test functions",
        )  # fmt: skip
        noise_band(axes, float(scale(floor)))
        for (label, values), color in zip(means.items(), (BLUE, ORANGE), strict=False):
            axes.plot(*binned_mean(x, scale(values)), ".-", color=color, label=label, **MEAN)
        axes.set_xlabel(along.label(panel.quantity))
        axes.margins(x=0.01)
        axes.set_ylim(-float(scale(limit)), float(scale(limit)))
    for axes in grid[len(shown) :]:
        axes.remove()
    for axes in grid[: len(shown) : 2]:
        axes.set_ylabel(scale.label(units.words("Unexplained force")))
    entries = grid[0].get_legend_handles_labels()
    figure.legend(*entries, loc="outside upper left", ncols=4, markerscale=3.0)
    return figure


# --- where the error is ----------------------------------------------------------------------

COLUMNS = 4
NAMES = {
    "velocity": "Speed",
    "distance_since_reversal": "Since reversal",
    "other_axis_velocity": "Other axis speed",
    "other_axis_acceleration": "Other axis acc.",
}


def regions(view: AxisView) -> list[Block]:
    """The worst regions and maps of an axis above its noise floor, and the dependence found."""
    axis = view.axis
    if axis.ratio < RULE.at_floor:
        return []
    blocks: list[Block] = []
    if axis.worst:
        blocks.append(Listing([capitalised(region_in_words(r)) for r in axis.worst]))
    caption = (
        "RMS force error by region; the grey band is the noise floor there. By frequency it is the "
        "error in bands of half an octave, independent of the test function."
    )
    blocks.append(Picture(draw_maps(axis.maps, view.units), view.words(caption)))
    if view.found is not None and view.found.unexplained is not None:
        caption = (
            "Part of the squared error that a curve over each coordinate alone accounts for; the "
            "missing physics depends most on the coordinate with the longest bar."
        )
        units = {m.coordinate: m.unit for m in axis.maps}
        blocks.append(Picture(draw_dependence(view.found.unexplained, units), caption))
    return blocks


def draw_maps(maps: Sequence[MisfitMap], units: AxisUnits) -> Figure:
    """RMS force error against every coordinate of an axis."""
    shown = [m for m in maps if np.ptp(m.low) > 0.0 and m.coordinate != "direction"]
    rows = -(-len(shown) // COLUMNS)
    figure = new_figure(0.4 + 1.9 * rows)
    grid = figure.subplots(rows, COLUMNS, squeeze=False, sharey=True)
    scale = Scale.of(units.force, np.concatenate([m.rms for m in shown]))
    seen = np.concatenate([np.append(m.rms[m.visited > 0.0], m.floor) for m in shown])
    low = 0.5 * float(scale(np.min(seen[seen > 0.0], initial=np.inf)))
    for axes, one in zip(grid.ravel(), shown, strict=False):
        _draw_map(axes, one, scale, low, units.words("force error"))
    grid[0, 0].set_ylim(bottom=low)  # of all, once all are drawn: before, it would cut the others
    for axes in grid.ravel()[len(shown) :]:
        axes.remove()
    for axes in grid[:, 0]:
        axes.set_ylabel(scale.label("RMS error"))
    figure.legend(*grid[0, 0].get_legend_handles_labels(), loc="outside upper left", ncols=2)
    return figure


def _draw_map(axes: Axes, one: MisfitMap, scale: Scale, low: float, label: str) -> None:
    along = Scale.of(one.unit, np.concatenate([one.low, one.high]))
    edges = along(np.append(one.low, one.high[-1]))
    error = scale(np.where(one.visited > 0.0, one.rms, np.nan))
    noise: dict[str, Any] = {"fill": True, "color": FLOOR, "alpha": 0.7, "label": "noise floor"}
    axes.stairs(scale(one.floor), edges, baseline=low, **noise)
    axes.stairs(error, edges, baseline=None, color=BLUE, linewidth=1.4, label=label)
    axes.set_yscale("log")
    plain_decades(axes.yaxis)
    name = NAMES.get(one.coordinate, title_case(one.coordinate))
    axes.set_xlabel(along.label(units_of(one.unit).words(name)))
    if one.coordinate == "standstill":
        axes.set_xticks([0.0, 1.0], ["moving", "at rest"])
    if one.coordinate == "frequency":
        axes.set_xscale("log")
        plain_decades(axes.xaxis)


def draw_dependence(dependence: Dependence, units: Mapping[str, str]) -> Figure:
    """The share of each coordinate, the largest first. units: of the coordinates, by name."""
    ordered = dict(sorted(dependence.shares.items(), key=lambda pair: -pair[1]))
    names = [units_of(units.get(name)).words(spaced(name)) for name in ordered]
    percent = [100.0 * share for share in ordered.values()]
    colors = [BLUE if name == dependence.depends_on else GREY for name in ordered]
    figure = new_figure(0.7 + 0.27 * len(ordered))
    axes = figure.subplots()
    bars = draw_bars(axes, names, percent, colors)
    axes.bar_label(bars, fmt="%.0f", padding=4, fontsize=8.5)
    axes.set_xlim(0.0, 1.1 * max(*percent, 1.0))
    axes.set_xlabel("Share of the squared error (%)")
    axes.set_ylabel("Coordinate")
    return figure


# --- whether the residual is noise -----------------------------------------------------------


def whiteness(view: AxisView) -> list[Block]:
    """The picture of the tests of an axis, and their numbers in sentences."""
    return residual_test_blocks(view.axis.tests, view.units)


def reasons(subject: Subject) -> list[Block]:
    """How the axes were tested and why, each way once."""
    said = (view.words(loop_in_words(view.axis.tests.loop)) for view in subject.views)
    return [Listing(tuple(dict.fromkeys(said)))]


def residual_test_blocks(tests: ResidualTests, units: AxisUnits) -> list[Block]:
    """The picture of some residual tests, and their numbers in sentences."""
    caption = (
        f"The force residual on {tests.samples} test functions that do not overlap. Bars: its "
        "histogram beside the normal distribution of the noise floor. Grey bands: 90 % bounds, "
        "±1.645/√n for n test functions; a tenth of a white residual's values lie outside. Faint "
        "values are not tested."
    )
    items = [units.words(capitalised(correlation_in_words(c))) for c in tests.correlations]
    return [Picture(draw_tests(tests, units), units.words(caption)), Listing(items)]


def draw_tests(tests: ResidualTests, units: AxisUnits) -> Figure:
    """The histogram, and the correlations by lag."""
    figure = new_figure(5.2)
    first, *others = figure.subplots(2, 2).ravel()
    scale = Scale.of(units.force, tests.edges)
    edges, floor = scale(tests.edges), float(scale(tests.floor))
    density = scale.size * tests.density  # by the printed unit
    first.stairs(density, edges, fill=True, color=BLUE, alpha=0.55, label="residual")
    at = np.linspace(edges[0], edges[-1], 400)
    normal = np.exp(-0.5 * (at / floor) ** 2) / (np.sqrt(2.0 * np.pi) * floor)
    first.plot(at, normal, color=ORANGE, label="normal, of the noise floor")
    first.set_xlabel(scale.label(units.words("Force residual")))
    first.set_ylabel(f"Density ({inverse(scale.unit)})")
    for axes, test in zip(others, tests.correlations, strict=True):
        _draw_correlation(axes, test)
    figure.legend(*first.get_legend_handles_labels(), loc="outside upper left", ncols=2)
    return figure


def _draw_correlation(axes: Axes, test: Correlation) -> None:
    axes.axhspan(-test.bound, test.bound, color=FLOOR, alpha=0.7, linewidth=0)
    scale = Scale.of("s", test.lag)
    lag = scale(test.lag)
    for mask, color, alpha in ((test.tested, BLUE, 1.0), (~test.tested, GREY, 0.5)):
        axes.vlines(lag[mask], 0.0, test.value[mask], color=color, alpha=alpha, linewidth=1.4)
    axes.axhline(0.0, color=INK, linewidth=0.8)
    reach = 1.15 * max(2.0 * test.bound, float(np.abs(test.value).max()))
    axes.set_ylim(-reach, reach)
    own = test.signal == "residual"
    axes.set_xlabel(scale.label("Lag" if own else f"Lag, {test.signal} first where positive"))
    axes.set_ylabel("Autocorrelation (1)" if own else f"Correlation with {test.signal} (1)")


# --- errors log by log -----------------------------------------------------------------------


def logs(view: AxisView) -> list[Block]:
    """A row for each log: force on the measured motion, position when the model runs freely."""
    axis, words = view.axis, view.words
    force = Scale.of(view.units.force, list(axis.force_error.values()))
    position = Scale.of(view.units.position, list(axis.position_error.values()))
    durations = {log.motion.name: len(log.motion.time) * log.motion.period for log in axis.logs}
    rows = [
        Row((
            name,
            quantity(durations[name], "s"),
            force.text(error),
            number(error / axis.floor),
            position.text(axis.position_error.get(name)),
            position.text(axis.position_floor.get(name)),
        ))
        for name, error in axis.force_error.items()
    ]  # fmt: skip
    titles = (
        "Duration", words("Force error, RMS"), "Over noise floor",
        words("Position error, free run, RMS"), "Expected from noise",
    )  # fmt: skip
    columns = (Column("Log"), *(Column(title, numeric=True) for title in titles))
    caption = (
        f"Noise floor of the force: {quantity(axis.floor, view.units.force)} RMS with test "
        f"functions of {quantity(axis.logs[0].test_function.length, 's')}. The free run restarts "
        f"from the measured motion every {HORIZON:g} s; between restarts the position drifts with "
        "every wrong force, measurement noise included."
    )
    return [Table(columns, rows, words(caption))]
