"""What a page is made of: blocks in sections, and their way into one HTML text."""

from __future__ import annotations

import importlib.metadata
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from identify.output.blocks import Block, Chart
from identify.output.numbers import capitalised, typeset

TEMPLATES = Environment(
    loader=PackageLoader("identify.output.report", "."), autoescape=True,
    undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True,
)  # fmt: skip
TEMPLATES.filters.update(typeset=typeset, capitalised=capitalised)


@dataclass(frozen=True, eq=False)
class Section:
    """A section of a page; ``anchor`` is its name in links."""

    anchor: str
    title: str
    blocks: Sequence[Block]


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
