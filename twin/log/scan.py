"""Chunks in the bytes of a damaged file, wherever they lie, each with or without its proof.

A chunk record is opcode u1, length u8, first and last time u8 each, uncompressed size u8, checksum
u4, the name of the compression (u4 and text), the size of the data u8, and the data. The checksum
is that of the decompressed data, so where it holds, it proves the samples and all that led to them.
"""

from __future__ import annotations

import re
import struct
from bisect import bisect_left
from collections.abc import Iterator
from dataclasses import dataclass

from mcap.records import Chunk

from twin.log.chunks import Inflation, decompressed
from twin.log.container import RECORD_HEAD, Damaged

_HEAD = struct.Struct("<BQQQQII")  # up to the length of the compression's name
_SIZE = struct.Struct("<Q")
_NAMES = {b"\x04\0\0\0zstd": "zstd", b"\x03\0\0\0lz4": "lz4"}
_FIXED = _HEAD.size + _SIZE.size - RECORD_HEAD.size  # content of a chunk less name and data
# An uncompressed chunk has no name to look for, but four numbers with high halves of zero.
_PLAIN = re.compile(rb"\x06(?=.{4}\0{4}.{16}.{4}\0{4}.{4}\0{4}.{4}\0{4})", re.DOTALL)


@dataclass(frozen=True)
class FoundChunk:
    """Decompressed schema, channel and message records; they lie in the file up to ``end``.

    proved: whether a checksum says that they are what was written. length_holds: whether the
    length of the record says so too.
    """

    offset: int
    end: int
    data: bytes
    proved: bool
    length_holds: bool


class FoundChunks:
    """All chunks of a file that can be decompressed and have no wrong checksum, by their place."""

    def __init__(self, data: bytes) -> None:
        self._found: dict[int, FoundChunk] = {}
        budget, end = Inflation(len(data)), 0
        for offset, name in sorted({*_compressed(data), *_plain(data)}):
            if offset < end:  # within a chunk that is proved
                continue
            chunk = _opened(data, offset, name, budget)
            if chunk is not None:
                self._found[offset] = chunk
                end = chunk.end if chunk.proved else end
        self._offsets = sorted(self._found)

    def at(self, offset: int) -> FoundChunk | None:
        """The chunk that begins there."""
        return self._found.get(offset)

    def next(self, start: int) -> FoundChunk | None:
        """The first chunk that begins there or later."""
        i = bisect_left(self._offsets, start)
        return self._found[self._offsets[i]] if i < len(self._offsets) else None


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


def _opened(data: bytes, offset: int, name: str, budget: Inflation) -> FoundChunk | None:
    """The chunk at a place, by either of the two sizes that it states of its data."""
    start = offset + _HEAD.size + len(name) + _SIZE.size
    if start > len(data):
        return None
    _, length, first, last, size, crc, _ = _HEAD.unpack_from(data, offset)
    (inner,) = _SIZE.unpack_from(data, start - _SIZE.size)
    outer = length - _FIXED - len(name)
    for stored in dict.fromkeys((inner, outer)):
        if not 0 < stored <= len(data) - start:
            continue
        chunk = Chunk(name, data[start : start + stored], last, first, crc, size)
        try:
            content = decompressed(chunk, budget)
        except Damaged:
            continue
        return FoundChunk(offset, start + stored, content, crc != 0, stored == outer)
    return None
