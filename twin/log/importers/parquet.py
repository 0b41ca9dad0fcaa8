"""Parquet; an empty cell is read as NaN, which the importer refuses."""

from __future__ import annotations

from pathlib import Path

from twin.log.importers.mapping import ImportMap
from twin.log.importers.table import Table, extra, parsing, require_columns


def read(path: Path, mapping: ImportMap) -> Table:
    """Columns of a Parquet file; raises InputError."""
    parquet = extra("pyarrow.parquet")
    wanted = list(mapping.column_names())
    with parsing("Parquet"), parquet.ParquetFile(path) as file:
        require_columns(wanted, file.schema_arrow.names)
        table = file.read(columns=wanted)
        return Table({name: table.column(name).to_numpy() for name in wanted})
