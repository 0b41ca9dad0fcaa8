"""HDF5: a dataset is named by its path; fields of a compound dataset as ``path/field``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twin.log.importers.mapping import ImportMap
from twin.log.importers.table import (
    Table,
    chosen,
    extra,
    parsing,
    require_columns,
    require_fits,
    split_columns,
)

_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_MATLAB_HEADER = 512  # bytes before the signature in a MAT file of version 7.3


def is_hdf5(path: Path) -> bool:
    """Whether the file is HDF5, alone or behind the header of MATLAB."""
    with open(path, "rb") as stream:
        head = stream.read(_MATLAB_HEADER + len(_SIGNATURE))
    return head.startswith(_SIGNATURE) or head[_MATLAB_HEADER:] == _SIGNATURE


def read(path: Path, mapping: ImportMap) -> Table:
    """Columns of an HDF5 file; raises InputError."""
    return read_named(path, mapping, separator="/")


def read_named(path: Path, mapping: ImportMap, separator: str) -> Table:
    """``read`` with ``separator`` in the names in place of the slash."""
    h5py = extra("h5py")
    wanted = mapping.column_names()
    with parsing("HDF5"), h5py.File(path, "r") as file:
        datasets: dict[str, Any] = {}

        def visit(name: str, item: Any) -> None:
            if isinstance(item, h5py.Dataset) and not name.startswith("#"):
                datasets[name.replace("/", separator)] = item

        file.visititems(visit)
        # only what may hold a wanted column is read, the rest is known by its name
        columns: dict[str, NDArray] = {}
        size = 0.0
        for name, dataset in datasets.items():
            if not wanted or any(w.startswith(name) for w in wanted):
                size += float(dataset.size or 0) * dataset.dtype.itemsize
                require_fits(size, path)
                columns |= _columns(name, dataset, separator)
        require_columns(wanted, {**datasets, **columns})  # lists all there are
        return Table({name: columns[name] for name in chosen(wanted, columns)})


def _columns(name: str, dataset: Any, separator: str) -> dict[str, NDArray]:
    if dataset.ndim not in (0, 1, 2):
        return {}
    values = np.asarray(dataset[()])
    if values.dtype.names is None:
        return split_columns(name, values)
    parts = [split_columns(f"{name}{separator}{f}", values[f]) for f in values.dtype.names]
    return {key: column for part in parts for key, column in part.items()}
