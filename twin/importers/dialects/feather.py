"""Feather, or Arrow: as Parquet has its columns."""

from __future__ import annotations

from pathlib import Path

from twin.importers.dialects import Dialect
from twin.importers.dialects.parquet import columns_of, entries_of
from twin.importers.mapping import ImportMap
from twin.importers.table import SignalTable, chosen, extra, parsing


def read(path: Path, mapping: ImportMap) -> SignalTable:
    """Columns of a Feather file; raises InputError."""
    feather = extra("pyarrow.feather")
    with parsing("Feather"):
        table = feather.read_table(path)
        columns = columns_of(table)
    names = chosen(mapping.column_names(), columns)
    return SignalTable({name: columns[name] for name in names}, notes=entries_of(table.schema))


DIALECT = Dialect("Feather of Arrow", (".feather", ".arrow"), read)
