"""MCAP taken apart and put together byte by byte, without the product's code."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from io import BytesIO

import zstandard
from mcap.data_stream import ReadDataStream, RecordBuilder
from mcap.records import (
    Channel,
    Chunk,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Message,
    Metadata,
)

MAGIC = b"\x89MCAP0\r\n"


@dataclass(frozen=True)
class Piece:
    """One record as it lies in a file: its bytes are ``data[start:end]``, its content ``body``."""

    opcode: int
    start: int
    end: int
    body: bytes


def pieces(data: bytes, start: int, end: int) -> list[Piece]:
    """Records between two bytes; they must fill the space exactly."""
    found = []
    while start < end:
        opcode, length = struct.unpack_from("<BQ", data, start)
        stop = start + 9 + length
        assert stop <= end
        found.append(Piece(opcode, start, stop, data[start + 9 : stop]))
        start = stop
    return found


def records(data: bytes) -> list[Piece]:
    """All records of a file."""
    assert data[:8] == data[-8:] == MAGIC
    return pieces(data, 8, len(data) - 8)


def of(data: bytes, opcode: int) -> list[Piece]:
    """The records of a kind."""
    return [piece for piece in records(data) if piece.opcode == opcode]


def parsed(kind: type, piece: Piece):
    """A record by the stock class."""
    return kind.read(ReadDataStream(BytesIO(piece.body)))


def parsed_message(piece: Piece) -> Message:
    """A message record by the stock class."""
    return Message.read(ReadDataStream(BytesIO(piece.body)), len(piece.body))


def joined(items: Iterable[McapRecord]) -> bytes:
    """Records one after the other, by the stock classes."""
    builder = RecordBuilder()
    for item in items:
        item.write(builder)
    return builder.end()


def plain_file(items: Iterable[McapRecord]) -> bytes:
    """A file without chunks, checksums and summary that holds these records."""
    ends = [DataEnd(0), Footer(0, 0, 0)]
    return MAGIC + joined([Header("", "test"), *items, *ends]) + MAGIC


def log_file(items: Iterable[McapRecord]) -> bytes:
    """A log without a summary: metadata, and all else in one chunk with its checksum."""
    given = list(items)
    outside = [item for item in given if isinstance(item, Metadata)]
    content = joined(item for item in given if not isinstance(item, Metadata))
    data = zstandard.compress(content)
    chunk = Chunk("zstd", data, 0, 0, zlib.crc32(content), len(content))
    return plain_file([*outside, chunk])


def json_channel(
    number: int, topic: str, metadata: Mapping[str, str] | None = None, schema: int = 0
) -> Channel:
    """A channel of JSON messages."""
    return Channel(number, topic, "json", dict(metadata or {}), schema)
