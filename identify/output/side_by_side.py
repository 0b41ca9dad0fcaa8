"""A comparison as MCAP, for Foxglove, PlotJuggler or rerun."""

from __future__ import annotations

from pathlib import Path

from identify.validation.side_by_side import SideBySide
from twin.logs import write_topics


def write_side_by_side(found: SideBySide, path: Path) -> None:
    """/measured/x, /model/x and /residual/x for each axis; raises InputError."""
    units = {
        f"{topic}/{column}": getattr(found.units[topic.rpartition("/")[2]], column)
        for topic, columns in found.topics.items()
        for column in columns
    }
    write_topics(found.topics, units, found.sample_rate, path)
