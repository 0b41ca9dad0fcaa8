"""Chunks in the bytes of a damaged file, wherever they lie, each with or without its proof.

A chunk record is opcode u1, length u8, first and last time u8 each, uncompressed size u8, checksum
u4, the name of the compression (u4 and text), the size of the data u8, and the data. The checksum
is that of the decompressed data, so where it holds, it proves the samples and all that led to them.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator
from dataclasses import dataclass

from mcap.records import Chunk

from twin.logs.container import RECORD_HEAD, Damaged, FileBytes, Inflation, decompressed

_HEAD = struct.Struct("<BQQQQII")  # up to the length of the compression's name
_SIZE = struct.Struct("<Q")
_NAMES = {b"\x04\0\0\0zstd": "zstd", b"\x03\0\0\0lz4": "lz4"}
_FIXED = _HEAD.size + _SIZE.size - RECORD_HEAD.size  # content of a chunk less name and data
# An uncompressed chunk has no name to look for, but four numbers with high halves of zero.
_PLAIN = re.compile(rb"\x06(?=.{4}\0{4}.{16}.{4}\0{4}.{4}\0{4}.{4}\0{4})", re.DOTALL)


_LEAST_ROOM = 1 << 12  # bytes: what does not shrink may grow, a little
_BEYOND = _HEAD.size + 4 + _SIZE.size  # bytes that tell whether a chunk may begin at a place


@dataclass(frozen=True)
class FoundChunk:
    """A chunk that lies in the file from ``offset`` to ``end``, its data from ``start`` on.

    proved: whether a checksum says that its records are what was written. length_holds: whether
    the length of the record says so too.
    """

    offset: int
    start: int
    end: int
    compression: str
    size: int
    crc: int
    length_holds: bool

    @property
    def proved(self) -> bool:
        """See FoundChunk."""
        return self.crc != 0

    def content(self, file: FileBytes) -> bytes:
        """Its schema, channel and message records, decompressed; raises Damaged."""
        data = file.part(self.start, self.end)
        chunk = Chunk(self.compression, data, 0, 0, self.crc, self.size)
        return decompressed(chunk)


def found_chunks(file: FileBytes) -> Iterator[tuple[FoundChunk, bytes]]:
    """The chunks that can be decompressed and have no wrong checksum, each with its content.

    In the order of their places. Within one that is proved none is looked for.
    """
    budget, start = Inflation(len(file)), 0
    while (found := _first(file, start, budget)) is not None:
        yield found
        chunk = found[0]
        start = chunk.end if chunk.proved else chunk.offset + 1


def _first(file: FileBytes, start: int, budget: Inflation) -> tuple[FoundChunk, bytes] | None:
    for place, length, data in file.windows(start, len(file), _BEYOND):
        for offset, name in sorted({*_compressed(data), *_plain(data)}):
            if offset < length:
                found = _opened(file, place + offset, data[offset : offset + _BEYOND], name, budget)
                if found is not None:
                    return found
    return None


def _compressed(data: bytes) -> Iterator[tuple[int, str]]:
    """Places where a compressed chunk may begin, and how it is compressed."""
    before = _HEAD.size - 4
    for text, name in _NAMES.items():
        found = data.find(text, before)
        while found >= 0:
            yield found - before, name
            found = data.find(text, found + 1)


def _plain(data: bytes) -> Iterator[tuple[int, str]]:
    """Places where a chunk may begin that is not compressed: its sizes agree, but for one."""
    for match in _PLAIN.finditer(data):
        offset = match.start()
        _, length, _, _, size, _, _ = _HEAD.unpack_from(data, offset)
        (inner,) = _SIZE.unpack_from(data, offset + _HEAD.size)
        if inner and len({inner, size, length - _FIXED}) < 3:
            yield offset, ""


def _opened(
    file: FileBytes, offset: int, head: bytes, name: str, budget: Inflation
) -> tuple[FoundChunk, bytes] | None:
    """The chunk at a place, by either of the two sizes that it states of its data."""
    before = _HEAD.size + len(name)
    if len(head) < before + _SIZE.size:
        return None
    _, length, first, last, size, crc, _ = _HEAD.unpack_from(head)
    (inner,) = _SIZE.unpack_from(head, before)
    start, outer = offset + before + _SIZE.size, length - _FIXED - len(name)
    for stored in dict.fromkeys((inner, outer)):
        if not 0 < stored <= min(len(file) - start, 2 * size + _LEAST_ROOM):
            continue
        end = start + stored
        try:
            budget.take(size, stored)  # before it is read: what only looks like chunks may be many
            content = decompressed(Chunk(name, file.part(start, end), last, first, crc, size))
        except Damaged:
            continue
        return FoundChunk(offset, start, end, name, size, crc, stored == outer), content
    return None
