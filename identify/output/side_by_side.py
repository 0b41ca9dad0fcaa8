"""A comparison as MCAP, for Foxglove, PlotJuggler or rerun."""

from __future__ import annotations

from pathlib import Path

from identify.output.results import Comparison
from identify.validation.side_by_side import side_by_side
from twin.log import write_topics


def write_side_by_side(comparison: Comparison, path: Path) -> None:
    """The first log: /measured/x, /model/x and /residual/x for each axis; raises InputError."""
    name = next(log.motion.name for a in comparison.axes.values() for log in a.logs)
    parts = {
        axis: log
        for axis, found in comparison.axes.items()
        for log in found.logs
        if log.motion.name == name
    }
    found = side_by_side(comparison.model, parts)
    kinds = {axis: log.motion.units for axis, log in parts.items()}
    units = {
        f"{topic}/{column}": getattr(kinds[topic.rpartition("/")[2]], column)
        for topic, columns in found.topics.items()
        for column in columns
    }
    write_topics(found.topics, units, found.sample_rate, path)
