"""Chapter "track": the parameters of the friction against position, in two ways."""

from __future__ import annotations

from collections.abc import Mapping

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from identify.output.report.blocks import Answer, Block, Picture, Section, Tile, Tone
from identify.output.report.drawing import BLUE, GREY, INK, ORANGE, new_figure
from identify.output.report.units import pretty
from identify.output.words.numbers import capitalised
from identify.output.words.reproduction import LEVELS, track_in_words
from identify.thesis.track import NAMES, Along, TrackResult

SIDES = {1.0: "forwards", -1.0: "backwards"}
APART = 1.5  # mm, between the marks of the two ways, which would hide each other


def section(result: TrackResult) -> Section:
    """The chapter."""
    blocks: list[Block] = [
        _answer(result),
        *(
            Picture(
                _figure(result, direction),
                f"Moving {side}. Line: planted; crosses: the curve through the map of the last "
                "half of each move, as in the thesis; dots: the whole law fitted to the same logs. "
                "Bars: 90 % intervals.",
            )
            for direction, side in SIDES.items()
        ),
    ]
    return Section("track", "Velocity maps along the track", blocks)


def _answer(result: TrackResult) -> Answer:
    tiles = [
        Tile(f"{name}, {way}", f"{100.0 * _worst(by, name):.2g} %", "largest error of a level")
        for way, by in (("thesis's map", result.maps), ("fit", result.fits))
        for name in LEVELS
    ]
    said = [capitalised(text) for text in track_in_words(result)]
    sentence = (
        "After 5 mm the bristles have not settled, so the map reads friction too low; a fit of the "
        "whole law allows for that."
    )
    found = max(_worst(result.fits, name) for name in LEVELS)
    headline = f"The profile along the track is recovered within {100.0 * found:.2g} %"
    return Answer(headline, sentence, tiles, said, Tone.STRONG)


def _worst(by_direction: Mapping[float, Mapping[str, Along]], name: str) -> float:
    return max(found[name].largest_error for found in by_direction.values())


def _figure(result: TrackResult, direction: float) -> Figure:
    figure = new_figure(4.4)
    place = 1e3 * result.places
    for axes, name in zip(figure.subplots(2, 2, sharex=True).ravel(), NAMES, strict=True):
        mapped, fitted = result.maps[direction][name], result.fits[direction][name]
        axes.plot(place, mapped.planted, color=GREY, linewidth=3.0, alpha=0.6)
        _marks(axes, place - APART / 2.0, mapped, "x", ORANGE)
        _marks(axes, place + APART / 2.0, fitted, "o", BLUE)
        axes.set_title(name)
        axes.set_ylabel(f"{name} ({pretty(mapped.unit)})")
    for axes in figure.axes[2:]:
        axes.set_xlabel("Position (mm)")
    return figure


def _marks(axes: Axes, place: NDArray, found: Along, mark: str, color: str) -> None:
    axes.errorbar(
        place, found.found, found.half, fmt=mark, color=color, ecolor=INK, elinewidth=0.7,
        markersize=4,
    )  # fmt: skip
