"""Errors log by log: force on the measured motion, position when the model runs freely."""

from __future__ import annotations

from identify.output.report.blocks import Block, Column, Heading, Row, Section, Table
from identify.output.report.subject import Subject
from identify.output.report.units import Scale, number, quantity
from identify.validation.free_run import HORIZON
from identify.validation.misfit_maps import AxisComparison


def section(subject: Subject) -> Section:
    """A table for each axis, a row for each log."""
    blocks: list[Block] = []
    for axis in subject.axes:
        if heading := subject.heading(axis.axis):
            blocks.append(Heading(heading))
        blocks.append(_table(axis))
    return Section("logs", "Errors log by log", blocks)


def _table(axis: AxisComparison) -> Table:
    force = Scale.of(axis.units.force, list(axis.force_error.values()))
    position = Scale.of(axis.units.position, list(axis.position_error.values()))
    durations = {log.motion.name: len(log.motion.time) * log.motion.period for log in axis.logs}
    rows = [
        Row(
            (
                name,
                quantity(durations[name], "s"),
                force.text(error),
                number(error / axis.floor),
                position.text(axis.position_error.get(name)),
                position.text(axis.position_floor.get(name)),
            )
        )
        for name, error in axis.force_error.items()
    ]
    words = axis.units.words
    columns = (
        Column("Log"),
        Column("Duration", numeric=True),
        Column(words("Force error, RMS"), numeric=True),
        Column("Over noise floor", numeric=True),
        Column(words("Position error, free run, RMS"), numeric=True),
        Column("Of noise alone", numeric=True),
    )
    caption = (
        f"Noise floor of the force: {quantity(axis.floor, axis.units.force)} RMS with test "
        f"functions of {quantity(axis.logs[0].test_function.length, 's')}. The free run restarts "
        f"from the measured motion every {HORIZON:g} s; between restarts the position drifts with "
        "every wrong force, measurement noise included."
    )
    return Table(columns, rows, words(caption))
