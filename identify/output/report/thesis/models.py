"""Chapter "models": frictions fitted to each other's data, their cost, and their loops."""

from __future__ import annotations

from collections.abc import Mapping

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
from identify.output.report.drawing import BLUE, new_figure
from identify.output.report.units import number, quantity, spaced, with_minus
from identify.output.words.numbers import capitalised
from identify.output.words.thesis_models import models_in_words, next_nearest
from identify.thesis.models import Drawn, ModelsResult

ACROSS = 4  # pictures side by side


def section(result: ModelsResult) -> Section:
    """The chapter."""
    blocks: list[Block] = [
        _answer(result),
        _pairs(result),
        _by_behaviour(result),
        *([_traits(result)] if result.traits else []),
        _cost(result),
        Picture(
            _loops(result.loops),
            "Friction along a pre-sliding loop with one loop inside it, from the laws (the "
            "thesis's Figure 2.6). A loop that stays open is memory lost at the reversal.",
        ),
        Picture(
            _loops(result.nested),
            "Two loops inside each other (its Figure 2.7): a law with nonlocal memory comes back "
            "to each branch that it left.",
        ),
    ]
    return Section("models", "The friction models compared", blocks)


def _answer(result: ModelsResult) -> Answer:
    i, j, ratio = next_nearest(result)
    tiles = [
        Tile("on its own data", number(float(result.own.max())), "largest error over noise floor"),
        Tile("nearest two laws", number(ratio), f"{spaced(result.laws[j])} fitted to "
             f"{spaced(result.laws[i])}"),
        Tile("of random starts", f"{100 * result.right.mean():.0f} %", "end right, all laws"),
    ]  # fmt: skip
    first, *others = [capitalised(said) for said in models_in_words(result)]
    headline = "Frictions are told apart, unless one contains the other"
    return Answer(headline, first, tiles, others, Tone.STRONG)


def _pairs(result: ModelsResult) -> Table:
    columns = (
        Column("Machine with"),
        *(Column(spaced(law), numeric=True) for law in result.laws),
    )
    rows = [
        Row((spaced(law), *(number(float(ratio)) for ratio in row)))
        for law, row in zip(result.laws, result.overall, strict=True)
    ]
    return Table(columns, rows, "Error over noise floor of each friction (across) fitted to the "
                 "logs of each machine, RMS over the behaviours.")  # fmt: skip


def _by_behaviour(result: ModelsResult) -> Table:
    columns = (Column("Fitted"), *(Column(name, numeric=True) for name in result.behaviours))
    rows = [
        Row((spaced(law), *(number(float(ratio)) for ratio in row)))
        for law, row in zip(result.laws, result.usual, strict=True)
    ]
    return Table(columns, rows, "Error over noise floor by behaviour, median over the machines "
                 "with another friction.")  # fmt: skip


def _cost(result: ModelsResult) -> Table:
    columns = (
        Column("Friction"),
        Column("Starts that end right", numeric=True),
        Column("Time of a fit", numeric=True),
        Column("Time of a step", numeric=True),
        Column("Loop open by", numeric=True),
    )
    rows = [
        Row((
            spaced(law), f"{100.0 * result.right[i]:.0f} %",
            quantity(float(result.seconds[i]), "s"), quantity(float(result.step[i]), "s"),
            quantity(result.loops[law].gap, "N"),
        ))
        for i, law in enumerate(result.laws)
    ]  # fmt: skip
    return Table(columns, rows, f"{result.starts} random starts of each law on its own data, each "
                 "value up to three times too small or too large.")  # fmt: skip


def _traits(result: ModelsResult) -> Table:
    columns = (
        Column("Friction"),
        Column("Falls with speed by", numeric=True),
        Column("Lag", numeric=True),
        Column("Slow push", numeric=True),
        Column("Fast push", numeric=True),
        Column("Drift", numeric=True),
    )
    rows = [
        Row((
            spaced(law), *(quantity(x, "N") for x in (t.fall, t.lag, t.slow, t.fast)),
            with_minus(f"{1e6 * t.drift:.1f} \u00b5m/s"),
        ))
        for law, t in zip(result.laws, result.traits, strict=True)
    ]  # fmt: skip
    return Table(columns, rows, "The plus and minus of the thesis's Table 2.1, measured. Lag: "
                 "friction where the speed rises less where it falls, at the same speed. Push: "
                 "largest friction under a triangle of force of 4 s and of 0.5 s. Drift: creep "
                 "under a steady force with a small oscillation, below break-away.")  # fmt: skip


def _loops(drawn: Mapping[str, Drawn]) -> Figure:
    down = -(-len(drawn) // ACROSS)
    figure = new_figure(2.4 * down)
    grid = figure.subplots(down, min(ACROSS, len(drawn)), sharex=True, sharey=True, squeeze=False)
    for axes in grid.ravel()[len(drawn) :]:
        axes.set_visible(False)
    for axes, (law, loop) in zip(grid.ravel(), drawn.items(), strict=False):
        axes.plot(1e3 * loop.position, 1e3 * loop.friction, color=BLUE, linewidth=0.9)
        axes.set_title(spaced(law))
        axes.tick_params(labelbottom=True)
        axes.set_xlabel("Position (mm)")
    for row in grid:
        row[0].set_ylabel("Friction (mN)")
    return figure
