"""Chapter "future": number of elements, mixtures, data-driven residuals, slow moves, a long run."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from identify.output.report.blocks import (
    Answer,
    Block,
    Column,
    Heading,
    Picture,
    Row,
    Section,
    Table,
    Tile,
    Tone,
)
from identify.output.report.drawing import BLUE, GREY, INK, ORANGE, new_figure
from identify.output.report.units import NOTHING, number, percent, pretty, quantity, spaced
from identify.output.words.numbers import capitalised
from identify.output.words.thesis_future import future_headline, future_in_words
from identify.thesis.future import FutureResult


def section(result: FutureResult) -> Section:
    """The chapter."""
    blocks: list[Block] = [
        _answer(result),
        Heading("How many elements"),
        _elements(result),
        *_both_at_once(result),
        Heading("A data-driven residual against physics"),
        _beside(result),
        Heading("Near zero speed"),
        _slow(result),
        Heading("A long run"),
        Picture(
            _run(result),
            "Dry friction found in each part of a long run, with its 90 % interval, against the "
            "distance travelled; some are longer than the picture. Line: the mean of the machine's "
            "own value over that part. First it warms, then it wears; orange: the same machine "
            "without both.",
        ),
        _aging(result),
    ]
    return Section("future", "Future work", blocks)


def _answer(result: FutureResult) -> Answer:
    slope, error = result.aging.level.slope
    tiles = [
        Tile("elements", str(result.chosen.count), f"chosen, of {result.planted} planted"),
        Tile("with physics", quantity(result.beside[-1].test, "N"), "RMS on the test log"),
        Tile("drift", quantity(slope, "N") + "/m", f"± {quantity(error, 'N')}/m, warm"),
    ]
    first, *others = [capitalised(said) for said in future_in_words(result)]
    return Answer(future_headline(result), first, tiles, others, Tone.STRONG)


def _elements(result: FutureResult) -> Table:
    columns = (
        Column("Elements", numeric=True),
        Column("Evidence over the first (ΔBIC)", numeric=True),
        Column("Test error over noise floor", numeric=True),
    )
    rows = [
        Row((str(e.count), number(e.delta_bic), number(e.over_floor)),
            Tone.STRONG if e is result.chosen else Tone.PLAIN)
        for e in result.elements
    ]  # fmt: skip
    return Table(columns, rows, "The number with the largest evidence is chosen; the test log took "
                 "no part in it.")  # fmt: skip


def _both_at_once(result: FutureResult) -> list[Block]:
    if not result.mixtures:
        return []
    return [Heading("Two frictions at once"), _mixtures(result)]


def _mixtures(result: FutureResult) -> Table:
    columns = (
        Column("Fitted"),
        Column("Free parameters", numeric=True),
        *(Column(f"Machine with {spaced(m.machine)}", numeric=True) for m in result.mixtures),
    )
    by_machine = [(*m.alone, m.both, *m.elements) for m in result.mixtures]
    names = [spaced(t.name) for t in by_machine[0]]
    for i, e in enumerate(result.elements, len(names) - len(result.elements)):
        names[i] += f", {e.count} element" + ("s" if e.count > 1 else "")
    rows = [
        Row((name, str(fits[0].parameters), *(number(t.over_floor) for t in fits)),
            Tone.STRONG if fits[0] is by_machine[0][2] else Tone.PLAIN)
        for name, fits in zip(names, zip(*by_machine, strict=True), strict=True)
    ]  # fmt: skip
    weights = ", ".join(f"{m.weight:.3f} on {spaced(m.machine)}" for m in result.mixtures)
    return Table(columns, rows, "Test error over noise floor. The mixture is a weight times the "
                 "first friction and the rest of the second, with one Stribeck curve and a "
                 f"stiffness and damping each; weight found: {weights}.")  # fmt: skip


def _beside(result: FutureResult) -> Table:
    columns = (
        Column("Model"),
        Column("Parameters added", numeric=True),
        Column("Held-out error", numeric=True),
        Column("Test error", numeric=True),
        Column("over noise floor", numeric=True),
    )
    first, *added, physics = result.beside
    names = (spaced(first.name), *(f"with {spaced(b.name)}" for b in added),
             f"{spaced(physics.name)} in its place")  # fmt: skip
    rows = [
        Row((
            name, str(b.parameters), quantity(b.held_out, "N"), quantity(b.test, "N"),
            number(b.test / result.floor),
        ))
        for name, b in zip(names, result.beside, strict=True)
    ]  # fmt: skip
    return Table(columns, rows, "RMS. The test log took no part in any choice.")


def _slow(result: FutureResult) -> Table:
    s = result.slow
    columns = (
        Column("Speed"),
        Column("Planted", numeric=True),
        Column("By the map", numeric=True),
        Column("off", numeric=True),
        Column("By the whole law", numeric=True),
        Column("off", numeric=True),
    )
    rows = [
        Row((
            quantity(v, "m/s"), quantity(true, "N"), quantity(mapped, "N"),
            percent(mapped / true - 1.0, 2), quantity(fitted, "N"), percent(fitted / true - 1.0, 2),
        ))
        for v, true, mapped, fitted in zip(s.speed, s.planted, s.mapped, s.fitted, strict=True)
    ]  # fmt: skip
    return Table(columns, rows, "At these speeds a move ends before the bristles have settled: the "
                 "map reads how far they are bent.")  # fmt: skip


def _run(result: FutureResult) -> Figure:
    figure = new_figure(3.6)
    axes = figure.subplots()
    for drift, color, name in (
        (result.aging.level, BLUE, "warms and wears"), (result.aging.steady, ORANGE, "does not"),
    ):  # fmt: skip
        axes.plot(drift.distance, 1e3 * drift.truth, color=GREY, linewidth=3.0, alpha=0.6)
        axes.errorbar(
            drift.distance, 1e3 * drift.found, 1e3 * drift.half, fmt="o", color=color, ecolor=INK,
            elinewidth=0.6, markersize=3, label=name,
        )  # fmt: skip
    both = result.aging.level, result.aging.steady
    shown = np.concatenate([each for d in both for each in (d.truth, d.found)])
    low, high = shown.min(), shown.max()
    margin = 0.1 * (high - low)
    axes.set_ylim(1e3 * (low - margin), 1e3 * (high + margin))
    axes.set_xlabel("Distance travelled (m)")
    axes.set_ylabel("Dry friction (mN)")
    figure.legend(loc="outside upper right", ncols=2)
    return figure


def _aging(result: FutureResult) -> Table:
    columns = (
        Column("Parameter"), Column("Planted", numeric=True), Column("Found", numeric=True),
        Column("90 % interval", numeric=True),
    )  # fmt: skip
    half = result.aging.half
    rows = [
        Row((
            f"{name} ({pretty(r.unit) or '1'})", f"{r.true:g}", f"{r.mean:.4g}",
            f"\u00b1 {number(half[name])}" if name in half else NOTHING,
        ))
        for name, r in result.aging.planted.items()
    ]  # fmt: skip
    return Table(columns, rows, "The effects that made the drift, fitted to the whole run as one "
                 f"log: error {number(result.aging.ratio)} times the noise floor.")  # fmt: skip
