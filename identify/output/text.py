"""Blocks as text for a terminal: a line each, what belongs to one below it."""

from __future__ import annotations

from collections.abc import Iterable
from functools import singledispatch

from identify.output.blocks import Block, Sentence, TableBlock


def to_text(blocks: Iterable[Block]) -> str:
    """The lines of blocks; of what is drawn there are none."""
    return "\n".join(line for block in blocks for line in lines_of(block))


@singledispatch
def lines_of(_: Block) -> list[str]:
    """The lines of a block."""
    return []


@lines_of.register
def _(block: Sentence) -> list[str]:
    return [block.text, *(f"  {line}" for one in block.below for line in lines_of(one))]


@lines_of.register
def _(block: TableBlock) -> list[str]:
    rows = [row[: block.brief] for row in (block.titles, *(r.cells for r in block.rows))]
    columns = zip(*rows, strict=True)
    padded = (
        [cell.rjust(width) if right else cell.ljust(width) for cell in column]
        for column, right in zip(columns, block.numeric, strict=False)
        for width in [max(map(len, column))]
    )
    return ["  ".join(cells).rstrip() for cells in zip(*padded, strict=True)]
