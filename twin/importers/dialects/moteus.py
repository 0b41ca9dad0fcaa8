"""moteus of mjbots: the registers of a controller by their names, in revolutions, N m and A.

Source: mjbots/moteus, lib/python/examples/csv_output.py: "time", then a register a column; time is
that of the host, in s. Units are those of the registers (docs/reference.md).
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from twin.importers.dialects import Dialect, csv
from twin.importers.mapping import ImportMap
from twin.importers.table import SignalTable, parsing
from twin.importers.text import ENDINGS, Head, read_table

_UNITS = {"time": "s", "POSITION": "rev", "VELOCITY": "rev/s", "TORQUE": "Nm", "CURRENT": "A"}


def is_its(path: Path) -> bool:
    """Whether its names are those of registers."""
    names = Head.of(path).lines[0].strip().split(",")
    return names[0] == "time" and {"POSITION", "VELOCITY"} <= set(names)


def read(path: Path, mapping: ImportMap) -> SignalTable:
    """Columns of a recording; raises InputError."""
    with parsing("a recording of moteus"):
        layout = csv.find_layout(Head.of(path), mapping)
        units = tuple(_UNITS.get(name.rpartition("_")[2], "") for name in layout.names)
        return read_table(path, mapping, replace(layout, units=units))


DIALECT = Dialect("moteus of mjbots", ENDINGS, read, is_its)
