"""Chapter "residuals": residual tests of the first friction, the diagnosis, and what is left."""

from __future__ import annotations

from identify.output.report.blocks import (
    Answer,
    Block,
    Column,
    Heading,
    Row,
    Section,
    Table,
    Tile,
    Tone,
)
from identify.output.report.units import number, percent, pretty, quantity, spaced
from identify.output.report.whiteness import residual_test_blocks
from identify.output.words.numbers import capitalised
from identify.output.words.reproduction import residuals_in_words
from identify.thesis.residuals import ResidualResult
from twin.model.units import LINEAR

SHOWN = 8  # candidates in the table


def section(result: ResidualResult) -> Section:
    """The chapter."""
    blocks: list[Block] = [
        _answer(result),
        _ranking(result),
        Heading(f"With {spaced(result.first)}"),
        *residual_test_blocks(result.before, LINEAR),
    ]
    if result.named:
        blocks += [
            Heading(f"With {', '.join(map(spaced, result.named))}"),
            *residual_test_blocks(result.after, LINEAR),
        ]
    if result.values:
        blocks.append(_values(result))
    return Section("residuals", "Residual analysis", blocks)


def _answer(result: ResidualResult) -> Answer:
    right = result.named == (result.planted,)
    headline = "The missing memory is named" if right else "The missing memory is not named alone"
    tiles = [
        Tile(f"with {result.first}", quantity(result.error_before, "N"), "RMS on the test log"),
        Tile("with what is named", quantity(result.error_after, "N"), "RMS on the test log"),
        Tile("noise floor", quantity(result.floor, "N"), "RMS"),
    ]
    first, *others = [capitalised(said) for said in residuals_in_words(result)]
    return Answer(headline, first, tiles, others, Tone.STRONG)


def _ranking(result: ResidualResult) -> Table:
    columns = (
        Column("Effect added, or friction exchanged"),
        Column("Error over noise floor", numeric=True),
        Column("Evidence (ΔBIC)", numeric=True),
    )
    rows = [
        Row(
            (spaced(c.name), number(c.over_floor), number(c.delta_bic)),
            Tone.STRONG if c.name in result.named else Tone.PLAIN,
        )
        for c in result.ranking[:SHOWN]
    ]
    return Table(columns, rows, f"The first {len(rows)} of {len(result.ranking)} that were tried.")


def _values(result: ResidualResult) -> Table:
    columns = (
        Column("Parameter"),
        Column("Planted", numeric=True),
        Column("Found", numeric=True),
        Column("Unit"),
        Column("Error", numeric=True),
    )
    rows = [
        Row(
            (name, f"{r.true:g}", f"{r.mean:.5g}", pretty(r.unit),
             percent(r.error, 2))
        )
        for name, r in result.values.items()
    ]  # fmt: skip
    return Table(columns, rows, "The thesis prints no such values: it fitted LuGre alone.")
