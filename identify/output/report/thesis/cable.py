"""Chapter "cable": the passes, the spikes, and the cable's force beside the planted one."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from identify.estimation.cable_force import CableForce
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
from identify.output.report.drawing import BLUE, FLOOR, GREY, INK, ORANGE, new_figure
from identify.output.report.units import quantity, with_minus
from identify.output.words.numbers import capitalised
from identify.output.words.reproduction import cable_in_words, cable_of_logs_in_words
from identify.thesis.cable import CableOfLogs, CableResult


def section(result: CableResult) -> Section:
    """The chapter."""
    blocks: list[Block] = [
        _answer(result),
        Picture(
            _passes(result.found),
            "The mean force over the passes of each direction. Shaded: where a spike was found; it "
            "is kept out of the cable's force.",
        ),
        Picture(
            _recovered(result),
            "The cable's force found and planted, and below the error with its 90 % band; orange: "
            "the error if the spikes are left in, as in the thesis.",
        ),
        _spikes(result.found),
    ]
    return Section("cable", "Cable slab", blocks)


def section_of_logs(result: CableOfLogs) -> Section:
    """The chapter on logs of a real machine."""
    found = result.found
    first, *others = [capitalised(said) for said in cable_of_logs_in_words(result)]
    blocks: list[Block] = [
        Answer("The cable's force from passes", first, [], others, Tone.STRONG),
        Picture(
            _passes(found),
            "The mean force over the passes of each direction. Shaded: where a spike was found; it "
            "is kept out of the cable's force.",
        ),
        Picture(_with_band(found), "The cable's force with its 90 % band."),
        _spikes(found),
    ]
    return Section("cable", "Cable slab", blocks)


def _with_band(found: CableForce) -> Figure:
    figure = new_figure(3.0)
    axes = figure.subplots()
    place = 1e3 * found.position
    axes.fill_between(
        place, found.force - found.band, found.force + found.band, color=FLOOR, label="90 % band"
    )
    axes.plot(place, found.force, color=INK, label="found")
    axes.set_xlabel("Position (mm)")
    axes.set_ylabel("Cable force (N)")
    axes.legend()
    return figure


def _answer(result: CableResult) -> Answer:
    tiles = [
        Tile("RMS error", quantity(result.rms_error, "N"), "found less planted"),
        Tile("with the spikes in", quantity(result.rms_error_with_all, "N"), "as in the thesis"),
        Tile("inside the 90 % band", f"{100 * result.within_band:.0f} %", "of the track"),
    ]
    if result.pitch is not None:
        off = 1e3 * (result.pitch.mean - result.pitch.true)
        value = f"{1e3 * result.pitch.mean:.3f} mm"
        tiles.append(
            Tile("pitch of the spikes", value, with_minus(f"{off:+.4f} mm off the planted one"))
        )
    first, *others = [capitalised(said) for said in cable_in_words(result)]
    headline = f"The cable's force is recovered to {quantity(result.rms_error, 'N')} RMS"
    return Answer(headline, first, tiles, others, Tone.STRONG)


def _passes(cable: CableForce) -> Figure:
    figure = new_figure(3.6)
    upper, lower = figure.subplots(2, 1, sharex=True)
    found = cable.passes
    place = 1e3 * found.position
    upper.plot(place, found.forwards.mean(axis=0), color=BLUE, label="forwards")
    lower.plot(place, found.backwards.mean(axis=0), color=ORANGE, label="backwards")
    for axes in (upper, lower):
        low, high = axes.get_ylim()
        axes.fill_between(place, low, high, where=~cable.kept, color=FLOOR, alpha=0.6)
        axes.set_ylim(low, high)
        axes.set_ylabel("Force (N)")
    lower.set_xlabel("Position (mm)")
    figure.legend(loc="outside upper right", ncols=2)
    return figure


def _recovered(result: CableResult) -> Figure:
    figure = new_figure(4.2)
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    place = 1e3 * result.found.position
    upper.plot(place, result.planted, color=GREY, linewidth=4.0, alpha=0.6, label="planted")
    upper.plot(place, result.found.force, color=INK, label="found")
    upper.set_ylabel("Cable force (N)")
    upper.legend()
    error, band = 1e3 * result.error, 1e3 * result.found.band
    lower.fill_between(place, error - band, error + band, color=FLOOR, label="90 % band")
    lower.plot(place, error, color=BLUE, label="error")
    left_in = 1e3 * (result.found.with_all - result.planted)
    lower.plot(place, left_in, color=ORANGE, linewidth=0.9, label="spikes left in")
    lower.axhline(0.0, color=INK, linewidth=0.7)
    lower.set_xlabel("Position (mm)")
    lower.set_ylabel("Error (mN)")
    reach = 1.1 * float(np.abs([left_in, error + band, error - band]).max())
    lower.set_ylim(-reach, reach)
    lower.legend(ncols=3, loc="upper left")
    return figure


def _spikes(cable: CableForce) -> Table:
    columns = (
        Column("Spike"),
        Column("Centre (mm)", numeric=True),
        Column("Width seen (mm)", numeric=True),
        Column("Braking forwards (mN)", numeric=True),
        Column("Braking backwards (mN)", numeric=True),
    )
    rows = [
        Row(
            (
                str(i),
                *(with_minus(f"{1e3 * x:.2f}") for x in (s.centre, s.width, s.ahead, s.behind)),
            )
        )
        for i, s in enumerate(cable.spikes, 1)
    ]
    return Table(columns, rows, "Tops as seen through test functions of 20 ms, which lower them.")
