"""Parquet: an empty cell is NaN, which the importer refuses."""

from __future__ import annotations

from pathlib import Path

from twin.importers.dialects import Dialect
from twin.importers.mapping import ImportMap
from twin.importers.table import SignalTable, chosen, extra, parsing, require_fits


def read(path: Path, mapping: ImportMap) -> SignalTable:
    """Columns of a Parquet file; raises InputError."""
    parquet = extra("pyarrow.parquet")
    with parsing("Parquet"), parquet.ParquetFile(path) as file:
        wanted = list(chosen(mapping.column_names(), file.schema_arrow.names))
        require_fits(8.0 * file.metadata.num_rows * len(wanted), path)
        table = file.read(columns=wanted)
        return SignalTable({name: table.column(name).to_numpy() for name in wanted})


DIALECT = Dialect("Parquet", (".parquet", ".pq"), read)
