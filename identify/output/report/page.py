"""What a page is made of: blocks in sections, and their way into one HTML text."""

from __future__ import annotations

import importlib.metadata
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, ClassVar

from jinja2 import Environment, PackageLoader, StrictUndefined
from matplotlib.figure import Figure

from identify.output.numbers import typeset
from identify.output.report.drawing import data_uri

if TYPE_CHECKING:
    from identify.output.report.subject import AxisView, Subject


class Tone(Enum):
    """Weight of a table row or an answer; the value is its CSS class."""

    PLAIN = "plain"
    STRONG = "strong"
    MUTED = "muted"


# Each block is drawn by the macro of its name in blocks.html.j2.


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
    """A section of a page; ``anchor`` is its name in links."""

    anchor: str
    title: str
    blocks: Sequence[Block]


@dataclass(frozen=True)
class Part:
    """A section of every report: its blocks for one axis, and those for all axes together."""

    anchor: str
    title: str
    of_axis: Callable[[AxisView], list[Block]] | None = None
    of_all: Callable[[Subject], list[Block]] | None = None


def page(title: str, facts: Sequence[tuple[str, str]], shown: Sequence[Section]) -> str:
    """The page as HTML text; every text is escaped by the template. facts: under the title."""
    environment = Environment(
        loader=PackageLoader("identify.output.report", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters.update(data_uri=data_uri, typeset=typeset)
    return environment.get_template("report.html.j2").render(
        title=title,
        facts=facts,
        sections=shown,
        version=importlib.metadata.version("proton-twin"),
    )
