"""Chapter "simulation": velocity map, parameters, their distributions, noise, sensitivity."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

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
from identify.output.report.drawing import BLUE, GREY, INK, ORANGE, new_figure, plain_tick
from identify.output.report.units import NOTHING, number, percent, pretty
from identify.output.words.numbers import capitalised
from identify.output.words.reproduction import simulation_headline, simulation_in_words, worst
from identify.thesis.chapter import Recovered
from identify.thesis.simulation import DYNAMIC, STATIC, SimulationResult

COLORS = (BLUE, ORANGE, "#3a8f5c", "#8a5fb0", "#b08a2e", "#c2476b")  # one a parameter
BINS = 14


def section(result: SimulationResult) -> Section:
    """The chapter."""
    blocks: list[Block] = [_answer(result), _table(result)]
    blocks += [
        Picture(
            _map_figure(result),
            "Friction at constant speed, simulated in closed loop and averaged on the last half of "
            "each plateau, and the planted curve.",
        ),
        Picture(
            _distributions(result),
            f"Parameters found in {result.trials} trials at {result.snr:g} dB. Line: planted; "
            "dashed: the mean that the thesis prints, where it is on the picture.",
        ),
        Picture(
            _growth(result),
            "RMS error of one trial, in per cent of the planted value, as the noise grows. Slopes "
            "of one decade in 20 dB are noise alone; a flat part is bias: the noisier the "
            "position, the longer the blocks over which the motion is averaged.",
        ),
        Picture(
            _sensitivities(result),
            "RMS force error when one parameter is off by a factor: static parameters on the map, "
            "dynamic ones on the reversals.",
        ),
        Listing([capitalised(said) for said in simulation_in_words(result)]),
    ]
    return Section("simulation", "Simulation study", blocks)


def _answer(result: SimulationResult) -> Answer:
    name, r = worst(result)
    printed = result.parameters["sigma2"]
    tiles = [
        Tile("largest error of a mean", f"{100 * abs(r.error):.2g} %", f"{name}, here"),
        Tile("trials", str(result.trials), f"at {result.snr:g} dB"),
    ]
    if printed.printed is not None:
        off = 100 * (printed.printed / printed.true - 1.0)
        tiles.insert(1, Tile("of sigma2 in the thesis", f"{abs(off):.2g} %", "printed mean"))
    sentence = (
        "A velocity map of both directions gives the static parameters, reversals between −50 and "
        "+50 µm the dynamic ones."
    )
    return Answer(simulation_headline(result), sentence, tiles, [], Tone.STRONG)


def _table(result: SimulationResult) -> Table:
    columns = (
        Column("Parameter"),
        Column("Planted", numeric=True),
        Column("Thesis", numeric=True),
        Column("Found, mean", numeric=True),
        Column("Standard deviation", numeric=True),
        Column("Error of the mean", numeric=True),
        Column("Error of the thesis's mean", numeric=True),
    )
    rows = [Row(_cells(name, r)) for name, r in result.parameters.items()]
    caption = (
        "The thesis prints four decimals; the error of its mean is that of the printed number."
    )
    return Table(columns, rows, caption)


def _cells(name: str, r: Recovered) -> tuple[str, ...]:
    off = NOTHING if r.printed is None else percent(r.printed / r.true - 1.0, 4)
    printed = NOTHING if r.printed is None else f"{r.printed:.4f}"
    unit = pretty(r.unit).replace("/", "\u2060/\u2060")  # no line break within it
    return (
        f"{name} ({unit})", f"{r.true:g}", printed, f"{r.mean:.6g}", number(r.sd),
        percent(r.error, 4), off,
    )  # fmt: skip


def _map_figure(result: SimulationResult) -> Figure:
    figure = new_figure(3.4)
    axes = figure.subplots()
    for way, color, mark in ((1.0, BLUE, "o"), (-1.0, ORANGE, "x")):
        part = result.map.towards(way)
        name = "forwards" if way > 0 else "backwards"
        axes.plot(np.abs(part.velocity), part.friction, mark, color=color, label=name, markersize=4)
    speed = np.geomspace(np.abs(result.map.velocity).min(), np.abs(result.map.velocity).max(), 300)
    axes.plot(speed, result.true(speed), color=INK, linewidth=0.9, label="planted")
    axes.set_xscale("log")
    axes.xaxis.set_major_formatter(FuncFormatter(plain_tick))
    axes.set_xlabel("Speed (m/s)")
    axes.set_ylabel("Friction (N)")
    figure.legend(loc="outside upper right", ncols=3)
    return figure


def _distributions(result: SimulationResult) -> Figure:
    figure = new_figure(4.4)
    for axes, (name, r) in zip(
        figure.subplots(2, 3).ravel(), result.parameters.items(), strict=True
    ):
        _histogram(axes, name, r)
    return figure


def _histogram(axes: Axes, name: str, r: Recovered) -> None:
    """Parts per million, or per cent, of the planted value: its digits would not fit on an axis."""
    share = r.values / r.true - 1.0
    size, unit = (1e-6, "ppm") if np.abs(share).max() < 1e-3 else (1e-2, "%")
    axes.hist(share / size, BINS, color=BLUE, alpha=0.6)
    axes.axvline(0.0, color=INK)
    low, high = axes.get_xlim()
    if r.printed is not None and low <= (at := (r.printed / r.true - 1.0) / size) <= high:
        axes.axvline(at, color=ORANGE, linestyle="--")
    axes.set_title(name)
    axes.set_xlabel(f"Off the planted value ({unit})")
    axes.set_ylabel("Trials")


def _growth(result: SimulationResult) -> Figure:
    figure = new_figure(3.4)
    axes = figure.subplots()
    ratios = list(result.by_snr)
    for name, color in zip((*STATIC, *DYNAMIC), COLORS, strict=True):
        errors = [100.0 * result.by_snr[snr][name].rms_error for snr in ratios]
        axes.plot(ratios, errors, "o-", color=color, label=name, markersize=4)
    axes.axhline(0.1, color=GREY, linestyle=":")
    axes.set_yscale("log")
    axes.yaxis.set_major_formatter(FuncFormatter(plain_tick))
    axes.invert_xaxis()
    axes.set_xlabel("Signal-to-noise ratio (dB)")
    axes.set_ylabel("Error of one trial (%)")
    figure.legend(loc="outside upper right", ncols=6)
    return figure


def _sensitivities(result: SimulationResult) -> Figure:
    figure = new_figure(3.2)
    factors = result.sensitivity.factors
    parts = (STATIC, "static, on the map"), (DYNAMIC, "dynamic, on the reversals")
    colors = dict(zip((*STATIC, *DYNAMIC), COLORS, strict=True))
    for axes, (names, title) in zip(figure.subplots(1, 2), parts, strict=True):
        for name in names:
            force = 1e3 * result.sensitivity.force[name]
            axes.plot(factors, force, color=colors[name], label=name)
        axes.set_title(title)
        axes.set_xlabel("Value over the planted one (1)")
        axes.set_ylabel("Force error, RMS (mN)")
        axes.legend()
    return figure
