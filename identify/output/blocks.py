"""Blocks, of which all is made that is shown of a result: written as text, or drawn on a page."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import singledispatch
from typing import Any, TypeVar

import numpy as np

from identify.output.numbers import NOTHING, typeset
from twin.signals import Array

NUMBER = re.compile(rf"(-?([\d.]+(e[+-]\d+)?|∞)( \S+)?|{NOTHING})?")  # a cell, with its unit
T = TypeVar("T")


class Tone(Enum):
    """Weight of a table row or an answer; the value is its CSS class."""

    PLAIN = "plain"
    STRONG = "strong"
    MUTED = "muted"


class Block:
    """A piece of a section, drawn by the macro of blocks.html.j2 that has the name of its class."""

    @property
    def macro(self) -> str:
        return type(self).__name__.removesuffix("Block").lower()


@dataclass(frozen=True)
class Heading(Block):
    """A heading inside a section."""

    text: str


@dataclass(frozen=True)
class Sentence(Block):
    """A sentence, or a line, with what belongs to it."""

    text: str
    below: Sequence[Block] = ()

    @classmethod
    def over(cls, text: str, below: Iterable[str | Block]) -> Sentence:
        """A sentence with what is said and shown below it."""
        return cls(text, sentences(below))


def sentences(said: Iterable[str | Block]) -> list[Block]:
    """What is said, each as a block."""
    return [one if isinstance(one, Block) else Sentence(one) for one in said]


class LineStyle(Enum):
    """How a line of a chart is drawn, by report.js."""

    LINE = "line"
    DASH = "dash"
    STEPS = "steps"
    STEMS = "stems"
    BAND = "band"  # the edge of a band, which the next line is the other edge of


class Ink(Enum):
    """Whose line it is: the model's, the final model's, the measurement's, or a bound."""

    BEFORE = "before"
    AFTER = "after"
    INK = "ink"
    SOFT = "soft"


@dataclass(frozen=True, eq=False)
class Drawn:
    """A line of a chart over its horizontal values; not a number where there is nothing."""

    label: str
    values: Array
    line: LineStyle = LineStyle.LINE
    ink: Ink = Ink.BEFORE


@dataclass(frozen=True, eq=False)
class Chart(Block):
    """Lines over common horizontal values in printed units, drawn in the reader's browser.

    dates: whether these are seconds since 1970, which are printed as days.
    """

    x: tuple[str, Array]
    y: str
    lines: Sequence[Drawn]
    caption: str = ""
    log_x: bool = False
    log_y: bool = False
    dates: bool = False

    @property
    def spec(self) -> dict[str, Any]:
        """What report.js draws."""
        edges = [i + 1 for i, drawn in enumerate(self.lines) if drawn.line is LineStyle.BAND]
        dates = {"dates": True} if self.dates else {}
        x = self.x[1].tolist() if self.dates else printed(self.x[1])
        return {
            "x": {"label": self.x[0], "values": x, "log": self.log_x, **dates},
            "y": {"label": self.y, "log": self.log_y},
            "series": [
                {"label": typeset(d.label), "values": printed(d.values), "kind": d.line.value,
                 "color": d.ink.value}
                for d in self.lines
            ],
            "bands": list(zip(edges[::2], edges[1::2], strict=True)),
        }  # fmt: skip


def printed(values: Array) -> list[float | None]:
    """Numbers as short as a picture needs them; None for what is none."""
    chart_digits = 5  # significant, of a number that is drawn
    return [float(f"{v:.{chart_digits}g}") if np.isfinite(v) else None for v in values]


@dataclass(frozen=True)
class Row:
    """Cells of a table row. bar: 0..1, drawn behind the first."""

    cells: Sequence[str]
    tone: Tone = Tone.PLAIN
    bar: float = 0.0


@dataclass(frozen=True)
class TableBlock(Block):
    """A table, with a sentence below it (may be empty); titles: of the columns.

    brief: how many of the columns are shown where room is short, as in a terminal; all where None.
    """

    titles: Sequence[str]
    rows: Sequence[Row]
    caption: str = ""
    brief: int | None = None

    @classmethod
    def of(
        cls, items: Iterable[T], columns: Mapping[str, Callable[[T], str]], caption: str = "",
        tone: Callable[[T], Tone] = lambda _: Tone.PLAIN, bar: Callable[[T], float] = lambda _: 0.0,
    ) -> TableBlock:  # fmt: skip
        """A row an item; columns: by title, what they show of it."""
        rows = [Row([show(i) for show in columns.values()], tone(i), bar(i)) for i in items]
        return cls(tuple(columns), rows, caption)

    @property
    def numeric(self) -> list[bool]:
        """Which columns hold numbers alone, and so are aligned to the right; not the first."""
        return [
            i > 0 and all(NUMBER.fullmatch(row.cells[i]) for row in self.rows)
            for i in range(len(self.titles))
        ]


@dataclass(frozen=True)
class Listing(Block):
    """Sentences, one an item."""

    items: Sequence[str]


@dataclass(frozen=True)
class Facts(Block):
    """Named facts; the first is set as a formula."""

    formula: str
    pairs: Sequence[tuple[str, str]]


@dataclass(frozen=True)
class Tile:
    """One number in large type: what it is, its text, and what to hold it against."""

    name: str
    value: str
    remark: str = ""


@dataclass(frozen=True)
class AnswerBlock(Block):
    """The answer for one axis, in big words. commands: what to run next."""

    headline: str
    sentence: str
    tiles: Sequence[Tile]
    remarks: Sequence[str]
    tone: Tone
    commands: Sequence[str] = ()


@singledispatch
def blocks_of(result: object) -> list[Block]:
    """What is shown of a result; ``identify.output.shown`` has it for each kind of result."""
    raise TypeError(f"a {type(result).__name__} has nothing to show")
