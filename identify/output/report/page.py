"""What a page is made of: blocks in sections, and their way into one HTML text."""

from __future__ import annotations

import importlib.metadata
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined

from identify.output.numbers import NOTHING, typeset
from twin.signals import Array

if TYPE_CHECKING:
    from identify.output.report.subject import AxisView, Subject

NUMBER = re.compile(rf"(-?([\d.]+(e[+-]\d+)?|∞)( \S+)?|{NOTHING})?")  # a cell, with its unit
T = TypeVar("T")

TEMPLATES = Environment(
    loader=PackageLoader("identify.output.report", "."), autoescape=True,
    undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True,
)  # fmt: skip
TEMPLATES.filters.update(typeset=typeset)


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


class Line(Enum):
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
    line: Line = Line.LINE
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
        edges = [i + 1 for i, drawn in enumerate(self.lines) if drawn.line is Line.BAND]
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
    """A table, with a sentence below it (may be empty); titles: of the columns."""

    titles: Sequence[str]
    rows: Sequence[Row]
    caption: str = ""

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


@dataclass(frozen=True, eq=False)
class Section:
    """A section of a page; ``anchor`` is its name in links."""

    anchor: str
    title: str
    blocks: Sequence[Block]


@dataclass(frozen=True)
class PagePart:
    """A section of every report: its blocks for one axis, and those for all axes together."""

    anchor: str
    title: str
    of_axis: Callable[[AxisView], list[Block]] | None = None
    of_all: Callable[[Subject], list[Block]] | None = None


def page(
    title: str,
    facts: Sequence[tuple[str, str]],
    shown: Sequence[Section],
    signals: Sequence[Mapping[str, Any]] = (),
    origin: Sequence[tuple[str, str]] = (),
    warnings: Sequence[tuple[str, str]] = (),
) -> str:
    """The page as HTML text; every text is escaped by the template.

    facts: under the title. signals: of each axis, to be explored beside the first section. origin:
    in the footer, what the page was made of. warnings: before the answer.
    """
    return TEMPLATES.get_template("report.html.j2").render(
        title=title, facts=facts, warnings=warnings, sections=shown, signals=signals,
        drawn=bool(signals) or any(isinstance(b, Chart) for s in shown for b in s.blocks),
        origin=[("proton-twin", importlib.metadata.version("proton-twin")), *origin],
    )  # fmt: skip


def fragment(blocks: Sequence[Block]) -> str:
    """Blocks as HTML within another page, which has no script of ours."""
    macros = TEMPLATES.get_template("blocks.html.j2").module
    return "".join(getattr(macros, "brief" if b.macro == "answer" else b.macro)(b) for b in blocks)
