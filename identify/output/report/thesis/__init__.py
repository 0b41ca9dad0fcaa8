"""The report of the reproduced study, one module for each chapter."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from identify.output.report.blocks import Section
from identify.output.report.drawing import drawing_style
from identify.output.report.html import page
from identify.output.report.thesis import (
    cable,
    dynamic,
    future,
    models,
    residuals,
    simulation,
    track,
    twin,
)
from identify.thesis.chapters import Reproduction
from twin.files import write_atomically

SECTIONS: Mapping[type, Callable[[Any], Section]] = {
    models.ModelsResult: models.section,
    simulation.SimulationResult: simulation.section,
    cable.CableResult: cable.section,
    cable.CableOfLogs: cable.section_of_logs,
    track.TrackResult: track.section,
    dynamic.DynamicResult: dynamic.section,
    residuals.ResidualResult: residuals.section,
    future.FutureResult: future.section,
    twin.TwinResult: twin.section,
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
        shown = [SECTIONS[type(found)](found) for found in result.chapters.values()]
        text = page(TITLE, facts, shown)
    write_atomically(path, text.encode("utf-8"))
