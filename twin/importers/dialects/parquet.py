"""Parquet: an empty cell is NaN, which the importer refuses; a list is a column an entry."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twin.importers.dialects import Dialect
from twin.importers.mapping import ImportMap
from twin.importers.table import (
    SignalTable,
    chosen,
    extra,
    parsing,
    require_columns,
    require_fits,
    split_columns,
)

_LONGEST = 200  # characters of an entry of the metadata that may state a rate


def read(path: Path, mapping: ImportMap) -> SignalTable:
    """Columns of a Parquet file; raises InputError."""
    parquet = extra("pyarrow.parquet")
    with parsing("Parquet"), parquet.ParquetFile(path) as file:
        wanted = mapping.column_names()
        bases = (re.sub(r"\[\d+\]$", "", name) for name in wanted)  # an entry of a list
        columns = read_columns(path, file, [*wanted, *bases])
        require_columns(wanted, {**dict.fromkeys(file.schema_arrow.names), **columns})
        names = chosen(wanted, columns)
        return SignalTable({name: columns[name] for name in names}, notes=notes_of(file))


def read_columns(path: Path, file: Any, wanted: Iterable[str]) -> dict[str, NDArray]:
    """The columns of an open file that begin with these names, all for none, lists taken apart."""
    asked = set(wanted)
    made = tuple(re.split(r"\.| \[", name)[0] for name in asked)  # of a table within it, of a time
    names = [n for n in file.schema_arrow.names if not asked or n in asked or n in made]
    require_fits(8.0 * file.metadata.num_rows * len(names), path)
    return columns_of(file.read(columns=names))


def columns_of(table: Any) -> dict[str, NDArray]:
    """The columns of a table of Arrow, lists and tables within it taken apart."""
    types = extra("pyarrow.types")
    while any(types.is_struct(field.type) for field in table.schema):
        table = table.flatten()
    columns: dict[str, NDArray] = {}
    for field in table.schema:
        name, cells = field.name, table.column(field.name)
        if types.is_time(field.type):  # of day, as counts of its unit
            cells = cells.cast("int64" if field.type.bit_width == 64 else "int32")
            name = f"{name} [{field.type.unit}]"
        values = cells.to_numpy()
        if values.dtype == object and len(values) and isinstance(values[0], np.ndarray):
            if len({np.shape(v) for v in values}) > 1 or values[0].ndim != 1:
                continue
            stacked = np.stack(list(values))
            split = {f"{name}[{k}]": c for k, c in enumerate(stacked.T, 1)}
            columns |= split_columns(name, stacked) if stacked.shape[1] == 1 else split
        else:
            columns[name] = values
    return columns


def notes_of(file: Any) -> tuple[str, ...]:
    """The short entries of its metadata, of which one may state the rate."""
    return entries_of(file.schema_arrow)


def entries_of(schema: Any) -> tuple[str, ...]:
    """The short entries of the metadata of a schema of Arrow."""
    metadata = schema.metadata or {}
    entries = (f"{k.decode()}: {v.decode(errors='replace')}" for k, v in metadata.items())
    return tuple(entry for entry in entries if len(entry) < _LONGEST)


DIALECT = Dialect("Parquet", (".parquet", ".pq"), read)
