"""What the model leaves: where, by frequency, whether it is noise, and the errors log by log."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from identify.estimation.residual_dependence import Dependence
from identify.output.blocks import (
    Block,
    Chart,
    Drawn,
    Ink,
    LineStyle,
    Listing,
    Row,
    TableBlock,
)
from identify.output.numbers import (
    DisplayUnit,
    capitalised,
    inverse,
    number,
    percent,
    quantity,
    spaced,
)
from identify.output.shown.subject import AxisView, Subject
from identify.output.words.fit import (
    LEAST_SHARE,
    LOOPS,
    correlation_in_words,
    place_in_words,
)
from identify.results.results import LogErrors
from identify.rules import RULE
from identify.validation.comparison import AxisComparison
from identify.validation.free_run import HORIZON
from identify.validation.misfit_maps import MisfitMap, Region
from identify.validation.whiteness import Correlation, ResidualTests
from twin.model.units import AxisUnits, units_of

# --- where the error is ----------------------------------------------------------------------


def regions(view: AxisView) -> list[Block]:
    """The worst regions of an axis above its noise floor, the dependence found, the spectrum."""
    axis = view.axis
    if axis.ratio < RULE.at_floor:
        return []
    blocks: list[Block] = [regions_table(axis, of_model(view))] if axis.worst else []
    left = view.found and view.found.unexplained
    if left and left.share_of_error >= LEAST_SHARE:
        blocks.append(dependence_table(left, axis.maps, view.label))
    spectra = [m for m in axis.maps if m.coordinate == "frequency"]
    return blocks + [spectrum_chart(one, view.units) for one in spectra]


def of_model(view: AxisView) -> str:
    """That errors are those of the model which was compared, where a better one was found."""
    return f"Of the model without {view.label}. " if view.label else ""


def regions_table(axis: AxisComparison, model: str) -> TableBlock:
    """The regions whose share of the error most exceeds their share of time, in that order."""
    columns: dict[str, Callable[[Region], str]] = {
        "Where": lambda r: capitalised(place_in_words(r)).removesuffix("."),
        "RMS error": lambda r: quantity(r.error, r.unit),
        "Times noise floor": lambda r: number(r.over_noise_floor),
        "Share of squared error": lambda r: percent(r.share_of_error),
        "Share of time": lambda r: percent(r.visited),
        "Difference": lambda r: percent(r.share_of_error - r.visited),
    }
    caption = (
        f"{model}The worst region of each coordinate, in the order of the difference of the two "
        "shares. Of a frequency band the share of time is that of the squared force."
    )
    return TableBlock.of(
        axis.worst, columns, axis.units.words(caption), bar=lambda r: r.share_of_error
    )


def dependence_table(dependence: Dependence, maps: Sequence[MisfitMap], found: str) -> TableBlock:
    """The share of the squared error of each coordinate, the largest first."""
    units = {m.coordinate: m.unit for m in maps}
    rows = [
        Row((units_of(units.get(name)).words(spaced(name)), percent(share)), bar=share)
        for name, share in sorted(dependence.shares.items(), key=lambda pair: -pair[1])
        if share >= LEAST_SHARE
    ]
    beside = f" with {found}" if found else ""
    caption = f"Part of what is left{beside} that a curve over each coordinate alone accounts for."
    return TableBlock(("Coordinate", "Share"), rows, caption)


def spectrum_chart(one: MisfitMap, units: AxisUnits) -> Chart:
    """The error by frequency beside its noise."""
    scale = DisplayUnit.of(units.force, one.force_error)
    edges = np.append(one.low, one.high[-1])
    shown = (np.where(one.visited > 0.0, one.force_error, np.nan), one.noise_floor)
    error, noise = (  # a band reaches from its lower edge to its upper: the last value stands twice
        scale(np.where(values > 0.0, values, np.nan)[[*range(len(values)), -1]]) for values in shown
    )
    lines = [
        Drawn(units.words("force error"), error, LineStyle.STEPS),
        Drawn("noise", noise, LineStyle.STEPS, Ink.SOFT),
    ]
    caption = "RMS error in bands of half an octave, independent of the test function."
    label = scale.label(units.words("RMS force error"))
    return Chart(("Frequency (Hz)", edges), label, lines, caption, log_x=True, log_y=True)


# --- whether the residual is noise -----------------------------------------------------------


def whiteness(view: AxisView) -> list[Block]:
    """The charts of the tests of an axis, and their numbers in sentences."""
    said: list[Block] = [Listing([model])] if (model := of_model(view).strip()) else []
    return said + residual_test_blocks(view.axis.tests, view.units)


def reasons(subject: Subject) -> list[Block]:
    """How the axes were tested and why, each way once."""
    said = (view.words(LOOPS[view.axis.tests.loop]) for view in subject.views)
    return [Listing(tuple(dict.fromkeys(said)))]


def residual_test_blocks(tests: ResidualTests, units: AxisUnits) -> list[Block]:
    """The charts of some residual tests, and their numbers in sentences."""
    items = [units.words(capitalised(correlation_in_words(c))) for c in tests.correlations]
    charts = [_histogram(tests, units), *map(_correlation, tests.correlations)]
    return [Listing(items), *charts]


def _histogram(tests: ResidualTests, units: AxisUnits) -> Chart:
    """Of the residual, beside the normal distribution of the noise floor."""
    scale = DisplayUnit.of(units.force, tests.edges)
    edges, floor = scale(tests.edges), float(scale(tests.floor))
    density = np.append(scale.size * tests.density, np.nan)  # by the printed unit
    at = np.unique(np.concatenate([edges, np.linspace(edges[0], edges[-1], 200)]))
    bins = density[np.searchsorted(edges, at, side="right") - 1]
    normal = np.exp(-0.5 * (at / floor) ** 2) / (np.sqrt(2.0 * np.pi) * floor)
    lines = [
        Drawn("residual", bins, LineStyle.STEPS),
        Drawn("normal, of the noise floor", normal, LineStyle.LINE, Ink.AFTER),
    ]
    caption = f"The force residual on {tests.samples} test functions that do not overlap."
    along = (scale.label(units.words("Force residual")), at)
    return Chart(along, f"Density ({inverse(scale.unit)})", lines, units.words(caption))


def _correlation(test: Correlation) -> Chart:
    scale, own = DisplayUnit.of("s", test.lag), test.signal == "residual"
    bound = np.full(len(test.lag), test.bound_90)
    lines = [
        Drawn("tested", np.where(test.tested, test.value, np.nan), LineStyle.STEMS),
        Drawn("not tested", np.where(test.tested, np.nan, test.value), LineStyle.STEMS, Ink.SOFT),
        Drawn("90 % bound", bound, LineStyle.DASH, Ink.INK),
        Drawn("90 % bound", -bound, LineStyle.DASH, Ink.INK),
    ]
    lag = "Lag" if own else f"Lag, {test.signal} first where positive"
    name = "Autocorrelation (1)" if own else f"Correlation with {test.signal} (1)"
    caption = "A tenth of a white residual's values lie beyond the bounds." if own else ""
    return Chart((scale.label(lag), scale(test.lag)), name, lines, caption)


# --- errors log by log -----------------------------------------------------------------------


def logs(view: AxisView) -> list[Block]:
    """A row for each log: force on the measured motion, position when the model runs freely."""
    axis, words = view.axis, view.words
    if view.summary is not None and view.summary.by_log:
        return [_of_all_logs(view, view.summary.by_log)]
    force = DisplayUnit.of(view.units.force, list(axis.force_error.values()))
    position = DisplayUnit.of(view.units.position, list(axis.position_error.values()))
    durations = {log.motion.name: len(log.motion.time) * log.motion.period for log in axis.logs}
    columns: dict[str, Callable[[str], str]] = {
        "Log": lambda name: name,
        "Duration": lambda name: quantity(durations[name], "s"),
        words("Force error, RMS"): lambda name: force.text(axis.force_error[name]),
        "Times noise floor": lambda name: number(axis.force_error[name] / axis.floor),
        words("Position error, free run, RMS"): (
            lambda name: position.text(axis.position_error.get(name))
        ),
        "Expected from noise": lambda name: position.text(axis.position_drift_of_noise.get(name)),
    }
    caption = (
        f"{of_model(view)}Noise floor of the force: {quantity(axis.floor, view.units.force)} RMS "
        f"with test functions of {quantity(axis.logs[0].test_function.length, 's')}. The free run "
        f"restarts from the measured motion every {HORIZON:g} s; between restarts the position "
        "drifts with every wrong force, measurement noise included."
    )
    return [TableBlock.of(axis.force_error, columns, words(caption))]


def _of_all_logs(view: AxisView, errors: Sequence[LogErrors]) -> TableBlock:
    """The logs of a diagnosis in each role, without what was found and with it."""
    axis, words = view.axis, view.words
    sizes = [size for e in errors for size in (e.before, e.after)]
    force = DisplayUnit.of(view.units.force, sizes)
    runs, better = axis.position_error, view.free_runs
    position = DisplayUnit.of(view.units.position, [*runs.values(), *better.values()])
    without = f", without {view.label}" if view.label else ""
    columns: dict[str, Callable[[LogErrors], str]] = {
        "Log": lambda e: e.name,
        "Role": lambda e: e.role.value,
        "Duration": lambda e: quantity(e.seconds, "s"),
        words(f"Force error{without}"): lambda e: force.text(e.before),
    }
    if view.label:
        columns[words(f"With {view.label}")] = lambda e: force.text(e.after)
    columns["Times noise floor"] = lambda e: number(e.after / e.floor)
    columns[words(f"Position, free run{without}")] = lambda e: position.text(runs.get(e.name))
    if better:
        columns[f"Free run with {view.label}"] = lambda e: position.text(better.get(e.name))
    columns["Expected from noise"] = lambda e: position.text(
        axis.position_drift_of_noise.get(e.name)
    )
    caption = (
        "RMS. The free run, of training logs alone, restarts from the measured motion every "
        f"{HORIZON:g} s; between restarts the position drifts with every wrong force, measurement "
        "noise included."
    )
    return TableBlock.of(errors, columns, words(caption))
