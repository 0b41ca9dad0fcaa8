"""Chapters "simulation" and "track" on logs of a real machine: maps without planted values."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from identify.estimation.map_curve import NAMES
from identify.output.report.blocks import (
    Answer,
    Block,
    Column,
    Picture,
    Row,
    Section,
    Table,
    Tone,
)
from identify.output.report.drawing import BLUE, INK, ORANGE, new_figure, plain_tick
from identify.output.report.units import NOTHING, Scale, number, pretty
from identify.output.words.numbers import capitalised
from identify.output.words.thesis_maps import (
    SIDES,
    UNITS,
    map_headline,
    map_in_words,
    track_of_logs_in_words,
)
from identify.thesis.maps_of_logs import MapOfLogs, TrackOfLogs

COLORS = {1.0: BLUE, -1.0: ORANGE}
WIDE = 5.0  # highest speed over the lowest, from which the scale is logarithmic


def section_of_map(result: MapOfLogs) -> Section:
    """The velocity-friction map of logs."""
    first, *others = [capitalised(said) for said in map_in_words(result)]
    blocks: list[Block] = [
        Answer(map_headline(result), first, [], others, Tone.STRONG),
        _table(result),
        Picture(
            _figure(result),
            "Friction averaged on the last half of each plateau, and the curve through each "
            "direction. The forces of the model's other effects are taken off.",
        ),
    ]
    return Section("simulation", "Velocity-friction map", blocks)


def _table(result: MapOfLogs) -> Table:
    columns = (
        Column("Parameter"), *(Column(side, numeric=True) for side in SIDES.values()),
        Column("mean", numeric=True),
    )  # fmt: skip
    names = [n for n in NAMES if any(n in curve.half for curve in result.curves.values())]
    rows = [
        Row((
            f"{n} ({pretty(result.units(UNITS[n]))})",
            *(_with_half(result, way, n) for way in SIDES),
            number(result.both[n]) if n in result.both else NOTHING,
        ))
        for n in names
    ]  # fmt: skip
    return Table(columns, rows, "With 90 % intervals, by the scatter of the plateaus.")


def _with_half(result: MapOfLogs, way: float, name: str) -> str:
    curve = result.curves[way]
    if name not in curve.half:
        return NOTHING
    return f"{number(curve.values[name])} \u00b1 {curve.half[name]:.2g}"


def _figure(result: MapOfLogs) -> Figure:
    figure = new_figure(3.4)
    axes = figure.subplots()
    for way, side in SIDES.items():
        part = result.map.towards(way)
        speed = np.abs(part.velocity)
        axes.plot(speed, part.friction, "o", color=COLORS[way], label=side, markersize=4, alpha=0.6)
        along = np.geomspace(speed.min(), speed.max(), 200)
        axes.plot(along, result.curves[way](along), color=COLORS[way])
        if speed.max() > WIDE * speed.min():
            axes.set_xscale("log")
            axes.xaxis.set_major_formatter(FuncFormatter(plain_tick))
    axes.set_xlabel(f"Speed ({pretty(result.units.velocity)})")
    axes.set_ylabel(f"Friction ({pretty(result.units('N'))})")
    figure.legend(loc="outside upper right", ncols=2)
    return figure


def section_of_track(result: TrackOfLogs) -> Section:
    """The parameters of the friction against position."""
    first, *others = [capitalised(said) for said in track_of_logs_in_words(result)]
    blocks: list[Block] = [
        Answer("Friction along the track", first, [], others, Tone.STRONG),
        Picture(
            _along(result),
            "Parameters of the curve through the map of each place, with 90 % intervals.",
        ),
    ]
    return Section("track", "Velocity maps along the track", blocks)


def _along(result: TrackOfLogs) -> Figure:
    figure = new_figure(4.4)
    units = result.maps[0].units
    scale = Scale.of(units.position, result.places)
    for axes, name in zip(figure.subplots(2, 2, sharex=True).ravel(), NAMES, strict=True):
        for way, side in SIDES.items():
            rows = [
                (place, m.curves[way].values[name], m.curves[way].half[name])
                for place, m in zip(result.places, result.maps, strict=True)
                if name in m.curves[way].half
            ]
            place, value, half = np.array(rows).reshape(-1, 3).T
            axes.errorbar(
                scale(place), value, half, fmt="o", color=COLORS[way], ecolor=INK, elinewidth=0.7,
                markersize=4, label=side if name == NAMES[0] else None,
            )  # fmt: skip
        axes.set_ylabel(f"{name} ({pretty(units(UNITS[name]))})")
    for axes in figure.axes[2:]:
        axes.set_xlabel(scale.label("Position"))
    figure.legend(loc="outside upper right", ncols=2)
    return figure
