"""MATLAB's files of version 7.3: HDF5, in which structs, cells and their arrays refer to others.

Read as SciPy reads those of version 7.2, so that what is in either is called alike.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from twin.importers.table import extra, parsing, require_fits

OBJECT = 3  # MATLAB_object_decode of an object, which only MATLAB reads


def content_of(path: Path) -> dict[str, Any]:
    """The variables of a file by name, None for an object; raises InputError."""
    h5py = extra("h5py")
    with parsing("MAT"), h5py.File(path, "r") as file:
        sizes: list[float] = []
        file.visititems(lambda _, item: sizes.append(_bytes(item)))
        require_fits(sum(sizes), path)
        return {name: _value(file, item) for name, item in file.items() if not name.startswith("#")}


def _bytes(item: Any) -> float:
    dtype = getattr(item, "dtype", None)
    return 0.0 if dtype is None else float(item.size or 0) * dtype.itemsize


def _value(file: Any, item: Any) -> Any:
    """A variable, or a field, that an item of the file holds."""
    if not hasattr(item, "dtype"):
        return _struct({name: _value(file, inner) for name, inner in item.items()})
    attributes = item.attrs
    if attributes.get("MATLAB_object_decode") == OBJECT:
        return None
    if "MATLAB_empty" in attributes or item.shape is None:
        return np.empty(0)
    values = np.asarray(item[()]).T
    if item.dtype.kind == "O":
        cells = [_value(file, file[reference]) for reference in np.ravel(values)]
        return cells if len(cells) > 1 else cells[0]
    if attributes.get("MATLAB_class") == b"char":
        return "".join(map(chr, np.ravel(values)))
    return np.squeeze(values)


def _struct(fields: dict[str, Any]) -> Any:
    """A struct, or the list of an array of them, of which each field is a list as long."""
    lengths = {len(v) if isinstance(v, list) else 0 for v in fields.values()}
    if len(lengths) == 1 and (count := lengths.pop()) > 1:
        return [{name: values[k] for name, values in fields.items()} for k in range(count)]
    return fields
