"""A machine that runs, on the terminal: force error and slow parameters of each axis."""

from __future__ import annotations

from collections.abc import Iterable

from rich.table import Table

from identify.output.numbers import NOTHING, quantity
from identify.output.words.fleet import parameter_in_words
from identify.results.fleet import LiveAxis


def table_of(source: str, time: float, axes: Iterable[LiveAxis]) -> Table:
    """What is known of each axis now; time: of the log, s."""
    table = Table(title=f"{source}, {time:.0f} s", title_justify="left")
    for column in ("axis", "force error (RMS)", "usual", "parameter", "now"):
        table.add_column(column)
    for axis in axes:
        usual = NOTHING if axis.usual is None else quantity(axis.usual, axis.unit)
        head = [axis.axis, quantity(axis.error, axis.unit), usual]
        for one in axis.parameters:
            table.add_row(*head, one.name, parameter_in_words(one))
            head = ["", "", ""]
        if not axis.parameters:
            table.add_row(*head, NOTHING, NOTHING)
    return table
