"""The page around the sections: one HTML text without outside references."""

from __future__ import annotations

import importlib.metadata
from collections.abc import Sequence

from jinja2 import Environment, PackageLoader, StrictUndefined

from identify.output.report.blocks import Section
from identify.output.report.drawing import data_uri


def page(title: str, facts: Sequence[tuple[str, str]], shown: Sequence[Section]) -> str:
    """The page as HTML text; every text is escaped by the template. facts: under the title."""
    environment = Environment(
        loader=PackageLoader("identify.output.report", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["data_uri"] = data_uri
    return environment.get_template("report.html.j2").render(
        title=title,
        facts=facts,
        sections=shown,
        version=importlib.metadata.version("proton-twin"),
    )
