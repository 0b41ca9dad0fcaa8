"""NumPy: an archive of arrays by name, or one array, whose columns go by field or by number."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from zipfile import ZipFile, is_zipfile

import numpy as np

from twin.importers.dialects import Dialect
from twin.importers.mapping import ImportMap
from twin.importers.nested import ROWS, flat
from twin.importers.table import SignalTable, chosen, parsing, require_fits


def read(path: Path, mapping: ImportMap) -> SignalTable:
    """Columns of a NumPy file; raises InputError. No objects are unpickled: they may run code."""
    with parsing("NumPy"):
        if is_zipfile(path):
            with ZipFile(path) as packed:
                require_fits(sum(one.file_size for one in packed.infolist()), path)
        with open(path, "rb") as stream:
            loaded = np.load(stream, allow_pickle=False)
            arrays = dict(loaded) if isinstance(loaded, np.lib.npyio.NpzFile) else {ROWS: loaded}
        content: dict[str, Any] = {}
        for name, array in arrays.items():
            fields = array.dtype.names or ()
            above = f"{name}." if len(arrays) > 1 else ""
            content |= {f"{above}{f}": array[f] for f in fields} if fields else {name: array}
        columns = flat(content)
    return SignalTable({name: columns[name] for name in chosen(mapping.column_names(), columns)})


DIALECT = Dialect("NumPy", (".npz", ".npy"), read)
