"""JSON: arrays by name, a matrix, or one object a row.

A matrix is ``name[1]``, ``name[2]``, ...; a list of as many names beside it names its columns.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twin.log.importers.mapping import ImportMap
from twin.log.importers.table import Table, chosen, parsing, split_columns

ROWS = "data"  # what the rows of a bare list are called


def read(path: Path, mapping: ImportMap) -> Table:
    """Columns of a JSON file; raises InputError."""
    with parsing("JSON"):
        content = json.loads(path.read_text(encoding="utf-8-sig"))
        columns = _columns("", content if isinstance(content, dict) else {ROWS: content})
    return Table({name: columns[name] for name in chosen(mapping.column_names(), columns)})


def _columns(prefix: str, content: Mapping[str, Any]) -> dict[str, NDArray]:
    columns: dict[str, NDArray] = {}
    names: list[str] = next((v for v in content.values() if _are_names(v)), [])
    for key, value in content.items():
        name = f"{prefix}{key}"
        if isinstance(value, dict):
            columns |= _columns(f"{name}.", value)
        elif isinstance(value, list) and value and all(isinstance(row, dict) for row in value):
            columns |= {k: np.array([row.get(k, np.nan) for row in value]) for k in value[0]}
        elif isinstance(value, list) and not _are_names(value):
            split = split_columns(name, _numeric(value))
            named = len(names) == len(split) > 1
            columns |= dict(zip(names, split.values(), strict=True)) if named else split
        elif isinstance(value, int | float | str):
            columns[name] = np.array([value])
    return columns


def _numeric(value: list[Any]) -> NDArray:
    """Rows as an array; what is no number, or is ragged, stays as it is and is refused later."""
    try:
        return np.array(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        return np.array([str(v) for v in value], dtype=object)


def _are_names(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(v, str) for v in value)
