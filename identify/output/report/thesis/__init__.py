"""The report of the reproduced study, one module for each chapter."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from identify.output.report.blocks import Section
from identify.output.report.drawing import drawing_style
from identify.output.report.html import page
from identify.output.report.thesis import cable, dynamic, models, residuals, simulation, track, twin
from identify.thesis.chapters import Reproduction
from twin.files import write_atomically

SECTIONS: Mapping[str, Callable[[Any], Section]] = {
    "models": models.section,
    "simulation": simulation.section,
    "cable": cable.section,
    "track": track.section,
    "dynamic": dynamic.section,
    "residuals": residuals.section,
    "twin": twin.section,
}
TITLE = "Friction identification on the gantry stage, reproduced on its twin"


def write_reproduction(path: Path, result: Reproduction) -> None:
    """Write the chapters as one HTML file without outside references."""
    facts = [
        ("Source", "L. Jia, Friction Identification on the Gantry Stage, TU Delft 2023"),
        ("Time", f"{sum(result.seconds.values()):.0f} s"),
    ]
    if result.small:
        facts.append(("Size", "small: fewer speeds, trials and passes"))
    with drawing_style():
        shown = [SECTIONS[name](found) for name, found in result.chapters.items()]
        text = page(TITLE, facts, shown)
    write_atomically(path, text.encode("utf-8"))
