"""Errors log by log: force on the measured motion, position when the model runs freely."""

from __future__ import annotations

from identify.compare import AxisComparison
from identify.freerun import WINDOW
from identify.report.blocks import Block, Column, Heading, Row, Section, Table
from identify.report.subject import Subject
from identify.report.units import Scale, number, quantity


def section(subject: Subject) -> Section:
    """A table for each axis, a row for each log."""
    blocks: list[Block] = []
    for axis in subject.axes:
        if heading := subject.heading(axis.axis):
            blocks.append(Heading(heading))
        blocks.append(_table(axis))
    return Section("logs", "Errors log by log", blocks)


def _table(axis: AxisComparison) -> Table:
    force = Scale.of("N", list(axis.force_error.values()))
    position = Scale.of("m", list(axis.position_error.values()))
    durations = {log.motion.name: len(log.motion.time) * log.motion.period for log in axis.logs}
    rows = [
        Row(
            (
                name,
                quantity(durations[name], "s"),
                force.text(error),
                number(error / axis.floor),
                position.text(axis.position_error.get(name)),
            )
        )
        for name, error in axis.force_error.items()
    ]
    columns = (
        Column("Log"),
        Column("Duration", numeric=True),
        Column("Force error, RMS", numeric=True),
        Column("Over noise floor", numeric=True),
        Column("Position error, free run, RMS", numeric=True),
    )
    caption = (
        f"Noise floor of the force {quantity(axis.floor, 'N')} RMS in windows of "
        f"{quantity(axis.logs[0].window.length, 's')}; encoder noise "
        f"{quantity(axis.position_floor, 'm')} RMS. The free run starts again from the "
        f"measured motion every {WINDOW:g} s."
    )
    return Table(columns, rows, caption)
