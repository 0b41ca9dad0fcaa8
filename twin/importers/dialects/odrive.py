"""ODrive: columns by the paths of its properties, such as odrv0.axis0.encoder.pos_estimate.

Source: ODrive's documentation, API reference (firmware 0.5 and later): positions in turns, torques
in N m, currents in A.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

from twin.importers.dialects import Dialect, csv
from twin.importers.mapping import ImportMap
from twin.importers.table import SignalTable, parsing
from twin.importers.text import ENDINGS, Head, read_table

_OWN = re.compile(r"(?:^|[.,;\t \"])(?:pos|vel)_estimate(?:$|[,;\t \"])")
_UNITS = (
    (re.compile(r"(?:^|\.)(?:pos_(?:estimate|setpoint|rel|abs)|input_pos)$"), "rev"),
    (re.compile(r"(?:^|\.)(?:vel_(?:estimate|setpoint)|input_vel)$"), "rev/s"),
    (re.compile(r"(?:^|\.)(?:\w*torque_(?:estimate|setpoint)|input_torque)$"), "Nm"),
    (re.compile(r"(?:^|\.)(?:I[qd]_(?:measured|setpoint)|ibus)$"), "A"),
)


def is_its(path: Path) -> bool:
    """Whether a column is one of the estimates of an ODrive."""
    return any(_OWN.search(line.strip()) for line in Head.of(path).lines[:2])


def read(path: Path, mapping: ImportMap) -> SignalTable:
    """Columns of a recording; raises InputError."""
    with parsing("a recording of ODrive"):
        layout = csv.find_layout(Head.of(path), mapping)
        units = tuple(
            next((unit for own, unit in _UNITS if own.search(name)), "") for name in layout.names
        )
        return read_table(path, mapping, replace(layout, units=units if any(units) else ()))


DIALECT = Dialect("ODrive", ENDINGS, read, is_its)
