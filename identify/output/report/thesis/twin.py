"""Chapter "twin": whether machine and twin agree, and what changed on a changed machine."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from identify.output.report.blocks import (
    Answer,
    Block,
    Column,
    Listing,
    Picture,
    Row,
    Section,
    Table,
    Tile,
    Tone,
)
from identify.output.report.drawing import BLUE, FLOOR, INK, ORANGE, new_figure
from identify.output.report.units import number, pretty, with_minus
from identify.output.words.numbers import capitalised
from identify.output.words.thesis_twin import twin_in_words, twin_of_logs_in_words
from identify.thesis.printed import EMPS_CLOSED_LOOP
from identify.thesis.twin import TwinOfLogs, TwinResult
from identify.validation.agreement import Agreement, Difference

REACH = 8.0  # joint standard errors that the picture shows


def section(result: TwinResult) -> Section:
    """The chapter."""
    blocks: list[Block] = [
        _answer(result),
        Picture(
            _figure(result),
            "Difference of the parameters of two fits, in joint standard errors. Grey: what the "
            "uncertainties of all comparisons together allow; a parameter beyond the picture is "
            "drawn at its edge.",
        ),
        _table(result.alike),
        _closed_loop({"Twin less machine": result.errors}),
        Listing([capitalised(said) for said in twin_in_words(result)]),
    ]
    return Section("twin", "Twin against machine", blocks)


def section_of_logs(result: TwinOfLogs) -> Section:
    """The chapter on logs of a machine."""
    agrees = all(alike.agrees for alike in result.alike.values())
    headline = "Machine and twin agree" if agrees else "Machine and twin differ"
    first, *others = [capitalised(said) for said in twin_of_logs_in_words(result)]
    blocks: list[Block] = [
        Answer(headline, first, [], others, Tone.STRONG),
        *(_table(alike, f"Fits of {log} and of its twin.") for log, alike in result.alike.items()),
        _closed_loop(result.errors),
    ]
    return Section("twin", "Twin against machine", blocks)


def _closed_loop(errors: Mapping[str, Mapping[str, float]]) -> Table:
    columns = (
        Column("Closed loop"),
        *(Column(name, numeric=True) for name in errors),
        Column("Published for EMPS", numeric=True),
        Column("with pulses", numeric=True),
    )
    rows = [
        Row((
            signal, *(f"{number(100.0 * own[signal])} %" for own in errors.values()),
            *(f"{number(100.0 * e)} %" for e in published),
        ))
        for signal, published in EMPS_CLOSED_LOOP.items()
    ]  # fmt: skip
    return Table(columns, rows, "RMS of twin less machine over that of the machine. Published: "
                 "another machine, a ball-screw drive, by its authors' own model.")  # fmt: skip


def _answer(result: TwinResult) -> Answer:
    headline = "Machine and twin agree" if result.alike.agrees else "Machine and twin differ"
    named = [d.label for axis in result.changed.axes.values() for d in axis.differing]
    tiles = [
        Tile(f"closed loop, {signal}", f"{number(100.0 * error)} %", "twin less machine, RMS")
        for signal, error in result.errors.items()
    ]
    remark = f"Of a machine with {result.added:.3g} kg more these differ: {', '.join(named)}."
    sentence = (
        "The machine is identified, its twin follows the same reference in MuJoCo and is "
        "identified in turn."
    )
    return Answer(headline, sentence, tiles, [remark], Tone.STRONG)


def _differences(found: Agreement) -> list[Difference]:
    return [d for axis in found.axes.values() for d in axis.differences]


def _figure(result: TwinResult) -> Figure:
    figure = new_figure(4.2)
    left, right = figure.subplots(1, 2)
    _draw(left, _differences(result.alike), "machine and twin", BLUE)
    _draw(right, _differences(result.changed), "machine before and after the change", ORANGE)
    return figure


def _draw(axes: Axes, found: list[Difference], title: str, color: str) -> None:
    ratios = np.clip([d.ratio for d in found], -REACH, REACH)
    limit = max((d.limit for d in found), default=0.0)
    place = np.arange(len(found))[::-1]
    axes.axvspan(-limit, limit, color=FLOOR, alpha=0.6, linewidth=0)
    axes.axvline(0.0, color=INK, linewidth=0.7)
    axes.plot(ratios, place, "o", color=color, markersize=4)
    axes.set_yticks(place, [d.label for d in found])
    axes.set_xlim(-1.1 * REACH, 1.1 * REACH)
    axes.set_title(title)
    axes.set_xlabel("Difference (joint standard errors)")


def _table(alike: Agreement, caption: str = "") -> Table:
    columns = (
        Column("Parameter"),
        Column("Machine", numeric=True),
        Column("Twin", numeric=True),
        Column("Joint standard error", numeric=True),
        Column("Unit"),
    )
    rows = [
        Row((
            d.label, *(with_minus(f"{value:.6g}") for value in (d.a, d.b)),
            number(d.standard_error), pretty(d.unit),
        ))
        for d in _differences(alike)
    ]  # fmt: skip
    return Table(columns, rows, caption)
