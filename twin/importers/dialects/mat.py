"""MATLAB: versions 4 to 7.2 through SciPy, 7.3 as the HDF5 file that it is.

A field of a struct is named ``struct.field``. Simulink's structures with time are
``name.time`` and, for each signal, ``name.signals.label``; arrays of To File have the times first.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import scipy.io
from numpy.typing import NDArray
from scipy.io.matlab import MatlabOpaque

from twin.errors import InputError
from twin.importers import matlab_hdf
from twin.importers.dialects import Dialect
from twin.importers.mapping import ImportMap
from twin.importers.nested import flat
from twin.importers.table import SMALLEST_TABLE, SignalTable, chosen, parsing, require_fits
from twin.isolated import isolated

_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_FED, _PIECE = 1 << 16, 1 << 20  # bytes that are decompressed, and that come of them, at once


def read(path: Path, mapping: ImportMap) -> SignalTable:
    """Columns of a MAT file; raises InputError."""
    matlab_header = 512  # bytes before the signature in a MAT file of version 7.3
    with open(path, "rb") as stream:
        head = stream.read(matlab_header + len(_SIGNATURE))
    if head.startswith(_SIGNATURE) or head[matlab_header:] == _SIGNATURE:  # of version 7.3
        return SignalTable(_columns(matlab_hdf.content_of(path), mapping.column_names()))
    with parsing("MAT"):
        content = content_bytes(path)
    shortest = 5.0  # s that a MAT file may take, whatever its size
    slowest = 2e7  # bytes of its content a second
    copies = 4  # of its content, that SciPy and the way back to this process take
    # In a process of its own: SciPy's reader of damaged files may crash, hang or fill the memory.
    seconds, memory = shortest + content / slowest, SMALLEST_TABLE + copies * content
    return SignalTable(
        isolated(_load, path, mapping.column_names(), seconds=seconds, memory=memory)
    )


def content_bytes(path: Path) -> int:
    """Bytes that a file of version 4 to 7.2 holds, decompressed, found in little memory.

    What is compressed proves itself by a checksum, so that only so much memory need be granted as
    there are data. Raises zlib.error, and InputError for more than such a file may hold.
    """
    header, compressed = 128, 15
    size = path.stat().st_size
    with open(path, "rb") as stream:
        marks = stream.read(header)[-4:]
        if marks not in (b"\x00\x01IM", b"\x01\x00MI"):  # version 5 to 7.2, either byte order
            return size
        tag = struct.Struct("<II" if marks.endswith(b"IM") else ">II")
        total = 0
        while len(head := stream.read(tag.size)) == tag.size:
            kind, length = tag.unpack(head)
            if kind == compressed:
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


def _load(path: Path, names: Sequence[str]) -> dict[str, NDArray]:
    with parsing("MAT"):
        content = scipy.io.loadmat(path, simplify_cells=True)
    kept = {k: v for k, v in content.items() if not k.startswith("__")}
    return _columns({k: None if isinstance(v, MatlabOpaque) else v for k, v in kept.items()}, names)


def _columns(content: Mapping[str, Any], names: Sequence[str]) -> dict[str, NDArray]:
    """The columns of variables, None for an object, that are asked for; all for none."""
    columns = flat({k: v for k, v in content.items() if v is not None})
    opaque = any(v is None for v in content.values())
    few = 20  # rows; no recording of fewer is of use
    none = not any(len(c) > few for c in columns.values()) if not names else False
    if opaque and (none or not set(names) <= set(columns)):
        raise InputError(
            "holds objects of MATLAB, such as timeseries or a Dataset of Simulink, which only "
            "MATLAB reads; save structures with time, or arrays: t = x.Time; q = x.Data"
        )
    return {name: columns[name] for name in chosen(names, columns)}


DIALECT = Dialect("MATLAB", (".mat",), read)
