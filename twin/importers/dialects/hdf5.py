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
    notes_of,
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
        said = [file.attrs]

        def visit(name: str, item: Any) -> None:
            said.append(item.attrs)
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
                    values, parts = _scaled(dataset), dataset.dtype.names
                    own = {f"{name}{separator}{part}": values[part] for part in parts or ()}
                    for key, column in (own or {name: values}).items():
                        split = _named(
                            f"{key}{separator}", split_columns(key, column), dataset.attrs
                        )
                        unit = _unit_of(dataset)
                        columns |= {with_unit(k, unit, wanted): v for k, v in split.items()}
        require_columns(wanted, {**datasets, **columns})  # lists all there are
        notes = tuple(dict.fromkeys(note for one in said for note in notes_of(dict(one))))
        return SignalTable({name: columns[name] for name in chosen(wanted, columns)}, notes=notes)


def _scaled(dataset: Any) -> NDArray:
    """The values of a dataset, of packed ones as its attributes say (CF Conventions, 8.1)."""
    values, attributes = np.asarray(dataset[()]), dataset.attrs
    fill = [attributes[k] for k in ("_FillValue", "missing_value") if k in attributes]
    packed = [k for k in ("scale_factor", "add_offset") if k in attributes]
    if values.dtype.kind not in "fiu" or not (fill or packed):
        return values
    scale = float(np.ravel(attributes.get("scale_factor", 1.0))[0])
    offset = float(np.ravel(attributes.get("add_offset", 0.0))[0])
    return np.where(np.isin(values, fill), np.nan, values * scale + offset)


def _named(above: str, columns: dict[str, NDArray], attributes: Any) -> dict[str, NDArray]:
    """The columns of a matrix as an attribute with as many names calls them, if one does.

    above: what stands before these names.
    """
    for stated in map(np.ravel, attributes.values() if len(columns) > 1 else ()):
        texts = [t.decode(errors="replace") if isinstance(t, bytes) else t for t in stated.tolist()]
        if len(texts) == 1 and isinstance(texts[0], str):
            texts = [text.strip() for text in texts[0].split(",")]
        names = [f"{above}{text}" for text in texts if isinstance(text, str)]
        if len({*names}) == len(columns):
            return dict(zip(names, columns.values(), strict=True))
    return columns


def _unit_of(dataset: Any) -> str:
    """The unit that a dataset states, "" where it states none."""
    for name in _UNIT:
        stated = np.ravel(dataset.attrs.get(name, ""))
        if stated.size == 1 and (text := stated[0]):
            return text.decode(errors="replace") if isinstance(text, bytes) else str(text)
    return ""


DIALECT = Dialect("HDF5", (".h5", ".hdf5", ".hdf", ".he5"), read)
