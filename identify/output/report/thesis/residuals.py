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
from identify.output.report.units import number, pretty, quantity, spaced
from identify.output.report.whiteness import residual_test_blocks
from identify.output.words.numbers import capitalised
from identify.output.words.reproduction import residuals_in_words
from identify.thesis.residuals import ResidualStudy
from twin.model.units import LINEAR

SHOWN = 8  # candidates in the table


def section(study: ResidualStudy) -> Section:
    """The chapter."""
    blocks: list[Block] = [
        _answer(study),
        _ranking(study),
        Heading(f"With {spaced(study.first)}"),
        *residual_test_blocks(study.before, LINEAR),
    ]
    if study.named:
        blocks += [
            Heading(f"With {', '.join(map(spaced, study.named))}"),
            *residual_test_blocks(study.after, LINEAR),
        ]
    if study.values:
        blocks.append(_values(study))
    return Section("residuals", "Residual analysis", blocks)


def _answer(study: ResidualStudy) -> Answer:
    right = study.named == (study.planted,)
    headline = "The missing memory is named" if right else "The missing memory is not named alone"
    tiles = [
        Tile(f"with {study.first}", quantity(study.error_before, "N"), "RMS on the test log"),
        Tile("with what is named", quantity(study.error_after, "N"), "RMS on the test log"),
        Tile("noise floor", quantity(study.floor, "N"), "RMS"),
    ]
    first, *others = [capitalised(said) for said in residuals_in_words(study)]
    return Answer(headline, first, tiles, others, Tone.STRONG)


def _ranking(study: ResidualStudy) -> Table:
    columns = (
        Column("Effect added, or friction exchanged"),
        Column("Error over noise floor", numeric=True),
        Column("Evidence (ΔBIC)", numeric=True),
    )
    rows = [
        Row(
            (spaced(c.name), number(c.over_floor), number(c.delta_bic)),
            Tone.STRONG if c.name in study.named else Tone.PLAIN,
        )
        for c in study.ranking[:SHOWN]
    ]
    return Table(columns, rows, f"The first {len(rows)} of {len(study.ranking)} that were tried.")


def _values(study: ResidualStudy) -> Table:
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
             f"{100.0 * r.error:+.2f} %".replace("-", "−"))
        )
        for name, r in study.values.items()
    ]  # fmt: skip
    return Table(columns, rows, "The thesis prints no such values: it fitted LuGre alone.")
