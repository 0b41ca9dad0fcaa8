"""Parquet; an empty cell is read as NaN, which the importer refuses."""

from __future__ import annotations

from pathlib import Path

from twin.log.importers.mapping import ImportMap
from twin.log.importers.table import Table, chosen, extra, parsing, require_fits


def read(path: Path, mapping: ImportMap) -> Table:
    """Columns of a Parquet file; raises InputError."""
    parquet = extra("pyarrow.parquet")
    with parsing("Parquet"), parquet.ParquetFile(path) as file:
        wanted = list(chosen(mapping.column_names(), file.schema_arrow.names))
        require_fits(8.0 * file.metadata.num_rows * len(wanted), path)
        table = file.read(columns=wanted)
        return Table({name: table.column(name).to_numpy() for name in wanted})
