"""What a section is made of. Each block is drawn by the macro of its name in blocks.html.j2."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import ClassVar

from matplotlib.figure import Figure


class Tone(Enum):
    """Weight of a table row or an answer; the value is its CSS class."""

    PLAIN = "plain"
    STRONG = "strong"
    MUTED = "muted"


@dataclass(frozen=True)
class Heading:
    """A heading inside a section."""

    macro: ClassVar[str] = "heading"
    text: str


@dataclass(frozen=True, eq=False)
class Picture:
    """A figure, with a sentence that says what to look for."""

    macro: ClassVar[str] = "picture"
    figure: Figure
    caption: str


@dataclass(frozen=True)
class Column:
    """Heading of a table column; numbers are aligned to the right."""

    title: str
    numeric: bool = False


@dataclass(frozen=True)
class Row:
    """Cells of a table row."""

    cells: Sequence[str]
    tone: Tone = Tone.PLAIN


@dataclass(frozen=True)
class Table:
    """A table, with a sentence below it (may be empty)."""

    macro: ClassVar[str] = "table"
    columns: Sequence[Column]
    rows: Sequence[Row]
    caption: str = ""


@dataclass(frozen=True)
class Listing:
    """Sentences, one an item."""

    macro: ClassVar[str] = "listing"
    items: Sequence[str]


@dataclass(frozen=True)
class Facts:
    """Named facts; the first is set as a formula."""

    macro: ClassVar[str] = "facts"
    formula: str
    pairs: Sequence[tuple[str, str]]


@dataclass(frozen=True)
class Tile:
    """One number in large type: what it is, its text, and what to hold it against."""

    name: str
    value: str
    remark: str = ""


@dataclass(frozen=True)
class Answer:
    """The answer for one axis, in big words."""

    macro: ClassVar[str] = "answer"
    headline: str
    sentence: str
    tiles: Sequence[Tile]
    remarks: Sequence[str]
    tone: Tone


Block = Heading | Picture | Table | Listing | Facts | Answer


@dataclass(frozen=True, eq=False)
class Section:
    """A section of the report; ``anchor`` is its name in links."""

    anchor: str
    title: str
    blocks: Sequence[Block]
