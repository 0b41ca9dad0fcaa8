"""Klipper's accelerometers: times in s, accelerations in mm/s^2; it records no force.

Source: Klipper, klippy/extras/adxl345.py, ``write_to_file``: the first line is
"#time,accel_x,accel_y,accel_z". Older ones have their statistics above it.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from twin.importers.dialects import Dialect, csv
from twin.importers.mapping import ImportMap
from twin.importers.table import SignalTable, parsing
from twin.importers.text import ENDINGS, Head, read_table

_NAMES = "#time,accel_x,accel_y,accel_z"


def is_its(path: Path) -> bool:
    """Whether it has Klipper's names."""
    return any(line.strip() == _NAMES for line in Head.of(path).lines[:3])


def read(path: Path, mapping: ImportMap) -> SignalTable:
    """Columns of a recording; raises InputError."""
    with parsing("a recording of Klipper"):
        layout = csv.find_layout(Head.of(path), mapping)
        return read_table(path, mapping, replace(layout, units=("s", *3 * ("mm/s^2",))))


DIALECT = Dialect("accelerometers of Klipper", ENDINGS, read, is_its)
