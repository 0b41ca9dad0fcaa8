"""A log as other tools read it: a table of its signals as CSV, MAT or Parquet."""

from __future__ import annotations

import re
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

import numpy as np
import scipy.io

from twin.errors import InputError
from twin.files import atomic_writer
from twin.importers.table import extra
from twin.logs import Log
from twin.signals import Array


def write_table(log: Log, path: Path) -> None:
    """Write ``log.table()``; MAT files have names such as x_position, and their units beside them.

    Raises InputError for another ending than .csv, .mat or .parquet, or what cannot be written.
    """
    known = {".csv": _csv, ".mat": _mat, ".parquet": _parquet}
    if path.suffix.lower() not in known:
        raise InputError(f"{path}: a table is a {', '.join(known)} file; give such a name")
    with atomic_writer(path) as stream:
        known[path.suffix.lower()](stream, log.table())


def _csv(stream: BinaryIO, columns: dict[str, Array]) -> None:
    stream.write((",".join(columns) + "\n").encode())
    np.savetxt(stream, np.column_stack([*columns.values()]), fmt="%.12g", delimiter=",")


def _mat(stream: BinaryIO, columns: dict[str, Array]) -> None:
    split = {name: name.removesuffix("]").rpartition(" [") for name in columns}
    names = {name: re.sub(r"\W", "_", signal) for name, (signal, _, _) in split.items()}
    units = {names[name]: unit for name, (_, _, unit) in split.items()}
    content = {names[name]: column for name, column in columns.items()}
    whole = BytesIO()  # as sizes are filled in later, which a stream to be appended to cannot do
    scipy.io.savemat(whole, {**content, "units": units}, oned_as="column")
    stream.write(whole.getbuffer())


def _parquet(stream: BinaryIO, columns: dict[str, Array]) -> None:
    table = extra("pyarrow").table(columns)
    extra("pyarrow.parquet").write_table(table, stream)
