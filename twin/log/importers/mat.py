"""MATLAB: versions 4 to 7.2 through SciPy, 7.3 as the HDF5 file it is.

A field of a struct is named ``struct.field``, whatever the version.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import scipy.io
from numpy.typing import NDArray

from twin.apart import apart
from twin.log.chunks import LARGEST_RATIO
from twin.log.importers import hdf5
from twin.log.importers.mapping import ImportMap
from twin.log.importers.table import SMALLEST_TABLE, Table, chosen, parsing, split_columns

SHORTEST = 5.0  # s that a file may take, whatever its size
SLOWEST = 1e6  # bytes a second


def read(path: Path, mapping: ImportMap) -> Table:
    """Columns of a MAT file; raises InputError."""
    if hdf5.is_hdf5(path):
        return hdf5.read_named(path, mapping, separator=".")
    # In a process of its own: SciPy's reader of damaged files may crash, hang or fill the memory.
    size = path.stat().st_size
    return Table(
        apart(
            _read, path, mapping.column_names(),
            seconds=SHORTEST + size / SLOWEST, memory=SMALLEST_TABLE + LARGEST_RATIO * size,
        )
    )  # fmt: skip


def _read(path: Path, names: Sequence[str]) -> dict[str, NDArray]:
    with parsing("MAT"):
        content = scipy.io.loadmat(path, simplify_cells=True)
    columns = _columns("", {k: v for k, v in content.items() if not k.startswith("__")})
    return {name: columns[name] for name in chosen(names, columns)}


def _columns(prefix: str, content: Mapping[str, Any]) -> dict[str, NDArray]:
    columns: dict[str, NDArray] = {}
    for key, value in content.items():
        name = f"{prefix}{key}"
        if isinstance(value, Mapping):
            columns |= _columns(f"{name}.", value)
        elif isinstance(value, np.ndarray):
            columns |= split_columns(name, value)
    return columns
