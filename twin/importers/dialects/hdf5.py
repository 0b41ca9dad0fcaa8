"""HDF5: a dataset is named by its path; fields of a compound dataset as ``path/field``."""

from __future__ import annotations

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
    with_unit,
)

_UNIT = ("units", "unit", "Units", "Unit")  # attributes by which writers state it


def read(path: Path, mapping: ImportMap, separator: str = "/") -> SignalTable:
    """Columns of an HDF5 file, ``separator`` between the parts of a name; raises InputError."""
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
                if dataset.ndim in (0, 1, 2):
                    values, parts = np.asarray(dataset[()]), dataset.dtype.names
                    own = {f"{name}{separator}{part}": values[part] for part in parts or ()}
                    for key, column in (own or {name: values}).items():
                        split = split_columns(key, column)
                        unit = _unit_of(dataset)
                        columns |= {with_unit(k, unit, wanted): v for k, v in split.items()}
        require_columns(wanted, {**datasets, **columns})  # lists all there are
        notes = tuple(f"{k}: {v}" for k, v in file.attrs.items() if np.size(v) == 1)
        return SignalTable({name: columns[name] for name in chosen(wanted, columns)}, notes=notes)


def _unit_of(dataset: Any) -> str:
    """The unit that a dataset states, "" where it states none."""
    for name in _UNIT:
        stated = np.ravel(dataset.attrs.get(name, ""))
        if stated.size == 1 and (text := stated[0]):
            return text.decode(errors="replace") if isinstance(text, bytes) else str(text)
    return ""


DIALECT = Dialect("HDF5", (".h5", ".hdf5", ".hdf", ".he5"), read)
