"""JSON: arrays by name, a matrix, or one object a row.

The columns of a matrix are ``name[1]``, ``name[2]``, ...; a list of as many names beside it names
them.
"""

from __future__ import annotations

import json
from pathlib import Path

from twin.importers.dialects import Dialect
from twin.importers.mapping import ImportMap
from twin.importers.nested import ROWS, flat
from twin.importers.table import SignalTable, chosen, parsing


def read(path: Path, mapping: ImportMap) -> SignalTable:
    """Columns of a JSON file; raises InputError."""
    with parsing("JSON"):
        content = json.loads(path.read_text(encoding="utf-8-sig"))
        columns = flat("", content if isinstance(content, dict) else {ROWS: content})
    return SignalTable({name: columns[name] for name in chosen(mapping.column_names(), columns)})


DIALECT = Dialect("JSON", (".json",), read)
