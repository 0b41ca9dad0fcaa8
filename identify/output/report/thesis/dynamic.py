"""Chapter "dynamic": what each record says of the bristles, two ways to fit, the free motion."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from identify.output.report.blocks import (
    Answer,
    Block,
    Column,
    Picture,
    Row,
    Section,
    Table,
    Tile,
    Tone,
)
from identify.output.report.drawing import BLUE, GREY, INK, ORANGE, new_figure
from identify.output.report.units import number, percent, pretty, quantity, with_minus
from identify.output.words.numbers import capitalised
from identify.output.words.thesis_dynamic import dynamic_headline, dynamic_in_words
from identify.thesis.chapter import Recovered
from identify.thesis.dynamic import PERIOD, DynamicResult


def section(result: DynamicResult) -> Section:
    """The chapter."""
    blocks: list[Block] = [
        _answer(result),
        _information(result),
        _found(result),
        Picture(
            _motion(result),
            "The open-loop sine at the first place, measured and simulated from the command alone "
            "with the fitted values. Orange: from rest, as in the thesis; blue: from the estimated "
            "beginning, below with its error enlarged. Dashed: the end of the first period.",
        ),
    ]
    return Section("dynamic", "Dynamic parameters", blocks)


def _answer(result: DynamicResult) -> Answer:
    rest, own = result.first_period.max(axis=0)
    tiles = [
        Tile("first period, from rest", quantity(rest, "m"), "RMS position error, largest"),
        Tile("beginning estimated", quantity(own, "m"), "RMS position error, largest"),
        *(
            Tile(name, percent(r.error, 3), "mean of our fit off the planted value")
            for name, r in result.fitted.items()
        ),
    ]
    first, *others = [capitalised(said) for said in dynamic_in_words(result)]
    return Answer(dynamic_headline(result), first, tiles, others, Tone.STRONG)


def _information(result: DynamicResult) -> Table:
    columns = (
        Column("Record"),
        Column("Change of friction, RMS", numeric=True),
        Column("Noise of the measured force", numeric=True),
        *(Column(f"90 % interval of {name}", numeric=True) for name in result.fitted),
    )
    records = (
        ("closed loop, reversals of 4 µm", result.closed),
        ("open loop, sine", result.opened),
    )
    rows = [
        Row((
            name, quantity(i.friction, "N"), quantity(i.noise, "N"),
            *(f"± {number(100.0 * half)} %" for half in i.half_widths.values()),
        ))
        for name, i in records
    ]  # fmt: skip
    return Table(columns, rows, "Of the planted values, by the force residual of each record.")


def _found(result: DynamicResult) -> Table:
    columns = (
        Column("Parameter"),
        Column("Planted", numeric=True),
        Column("Simplex search from rest", numeric=True),
        Column("Fit of simulated motion", numeric=True),
    )
    rows = [
        Row((f"{name} ({pretty(r.unit)})", f"{r.true:g}", _range(result.simplex[name]), _range(r)))
        for name, r in result.fitted.items()
    ]
    return Table(columns, rows, f"Smallest and largest of {len(result.places)} places. The thesis "
                 "prints no values of its stage.")  # fmt: skip


def _range(r: Recovered) -> str:
    low, high = r.values.min(), r.values.max()
    return with_minus(f"{low:.6g} to {high:.6g}" if len(r.values) > 1 else f"{low:.6g}")


def _motion(result: DynamicResult) -> Figure:
    figure = new_figure(4.6)
    upper, middle, lower = figure.subplots(3, 1, sharex=True, height_ratios=(3, 2, 2))
    t = result.trace
    origin = t.measured.mean()
    upper.plot(t.time, 1e3 * (t.measured - origin), color=GREY, linewidth=4.0, alpha=0.6,
               label="measured")  # fmt: skip
    upper.plot(t.time, 1e3 * (t.from_rest - origin), color=ORANGE, label="from rest")
    upper.plot(t.time, 1e3 * (t.from_estimate - origin), color=BLUE, label="beginning estimated")
    upper.set_ylabel("Position (mm)")
    middle.plot(t.time, 1e3 * (t.from_rest - t.measured), color=ORANGE)
    middle.set_ylabel("Error (mm)")
    lower.plot(t.time, 1e9 * (t.from_estimate - t.measured), color=BLUE, linewidth=0.7)
    lower.set_ylabel("Error (nm)")
    lower.set_xlabel("Time (s)")
    for axes in (upper, middle, lower):
        axes.axvline(PERIOD, color=INK, linestyle="--", linewidth=0.7)
    reach = 1.1e3 * float(np.abs(t.from_rest - t.measured).max())
    middle.set_ylim(-reach, reach)
    figure.legend(loc="outside upper right", ncols=3)
    return figure
