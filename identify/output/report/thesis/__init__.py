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
    maps,
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
    maps.MapOfLogs: maps.section_of_map,
    maps.TrackOfLogs: maps.section_of_track,
    track.TrackResult: track.section,
    dynamic.DynamicResult: dynamic.section,
    residuals.ResidualResult: residuals.section,
    future.FutureResult: future.section,
    twin.TwinResult: twin.section,
    twin.TwinOfLogs: twin.section_of_logs,
}
TITLE = "Friction identification on the gantry stage, reproduced on its twin"
TITLE_OF_LOGS = "Friction identification as on the gantry stage, on logs of a machine"


def write_reproduction(path: Path, result: Reproduction) -> None:
    """Write the chapters as one HTML file without outside references."""
    facts = [
        ("Source", "L. Jia, Friction Identification on the Gantry Stage, TU Delft 2023"),
        ("Time", f"{sum(result.seconds.values()):.0f} s"),
    ]
    if result.small:
        facts.append(("Size", "small: fewer speeds, trials and passes"))
    if result.logs:
        facts.append(("Logs", ", ".join(result.logs)))
    facts += [(f"Chapter {name}", f"left out: {why}") for name, why in result.left_out.items()]
    with drawing_style():
        shown = [SECTIONS[type(found)](found) for found in result.chapters.values()]
        text = page(TITLE_OF_LOGS if result.logs else TITLE, facts, shown)
    write_atomically(path, text.encode("utf-8"))
