"""JSON: arrays by name, a matrix, one object a row or a line, or tables within tables.

The columns of a matrix are ``name[1]``, ``name[2]``, ...; a list of as many names beside it names
them.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from twin.errors import InputError
from twin.importers.dialects import Dialect
from twin.importers.mapping import ImportMap
from twin.importers.nested import ROWS, flat
from twin.importers.table import SignalTable, chosen, parsing


def read(path: Path, mapping: ImportMap) -> SignalTable:
    """Columns of a JSON file; raises InputError."""
    with parsing("JSON"):
        content = _content(path.read_text(encoding="utf-8-sig"))
        columns = flat(content if isinstance(content, dict) else {ROWS: content})
    return SignalTable({name: columns[name] for name in chosen(mapping.column_names(), columns)})


def _content(text: str) -> Any:
    """What a text holds: one value, or one a line (https://jsonlines.org)."""
    try:
        return json.loads(text)
    except json.JSONDecodeError as error:
        lines = [line for line in text.splitlines() if line.strip()]
        if len(lines) < 2 or (error.lineno == 1 and not text.startswith("{")):
            raise
        return _rows(lines)


def _rows(lines: list[str]) -> list[Any]:
    """What each line holds, but of the last one where it was cut off."""
    rows = []
    for number, line in enumerate(lines, 1):
        try:
            rows.append(json.loads(line))
        except json.JSONDecodeError as error:
            if number < len(lines):
                raise InputError(f"line {number} is no JSON: {error}") from error
    return rows


DIALECT = Dialect("JSON", (".json", ".jsonl", ".ndjson"), read)
