"""MATLAB: versions 4 to 7.2 through SciPy, 7.3 as the HDF5 file it is.

A field of a struct is named ``struct.field``, whatever the version.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import scipy.io
from numpy.typing import NDArray

from twin.importers.formats import is_hdf5, read_hdf5
from twin.importers.mapping import ImportMap
from twin.importers.table import SMALLEST_TABLE, Table, chosen, parsing, require_fits, split_columns
from twin.isolated import isolated

SHORTEST = 5.0  # s that a file may take, whatever its size
SLOWEST = 2e7  # bytes of content a second
COPIES = 4  # of its content, that SciPy and the way back to this process take
_HEADER, _COMPRESSED = 128, 15
_FED, _PIECE = 1 << 16, 1 << 20  # bytes that are decompressed, and that come of them, at once


def read(path: Path, mapping: ImportMap) -> Table:
    """Columns of a MAT file; raises InputError."""
    if is_hdf5(path):
        return read_hdf5(path, mapping, separator=".")
    with parsing("MAT"):
        content = content_bytes(path)
    # In a process of its own: SciPy's reader of damaged files may crash, hang or fill the memory.
    return Table(
        isolated(
            _read, path, mapping.column_names(),
            seconds=SHORTEST + content / SLOWEST, memory=SMALLEST_TABLE + COPIES * content,
        )
    )  # fmt: skip


def content_bytes(path: Path) -> int:
    """Bytes that a file of version 4 to 7.2 holds, decompressed, found in little memory.

    What is compressed proves itself by a checksum, so that only so much memory need be granted as
    there are data. Raises zlib.error, and InputError for more than such a file may hold.
    """
    size = path.stat().st_size
    with open(path, "rb") as stream:
        marks = stream.read(_HEADER)[-4:]
        if marks not in (b"\x00\x01IM", b"\x01\x00MI"):  # version 5 to 7.2, either byte order
            return size
        tag = struct.Struct("<II" if marks.endswith(b"IM") else ">II")
        total = 0
        while len(head := stream.read(tag.size)) == tag.size:
            kind, length = tag.unpack(head)
            if kind == _COMPRESSED:
                for piece in _inflated(stream.read(min(length, size))):
                    total += piece
                    require_fits(total, path)
            else:
                total += min(length, size)
                stream.seek(length, 1)
    return total


def _inflated(data: bytes) -> Iterator[int]:
    """Sizes of the pieces of decompressed data; raises zlib.error."""
    stream = zlib.decompressobj()
    for start in range(0, len(data), _FED):
        fed = data[start : start + _FED]
        while fed and not stream.eof:
            yield len(stream.decompress(fed, _PIECE))
            fed = stream.unconsumed_tail


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
        elif isinstance(value, np.ndarray | np.generic | int | float | str):
            columns |= split_columns(name, np.asarray(value))
    return columns
