"""The chunks of an MCAP file: decompressed within bounds, their checksums verified."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import lz4.frame
import zstandard
from mcap.opcode import Opcode
from mcap.records import Chunk

from twin.errors import at
from twin.log.container import IN_CHUNKS, RECORD_HEAD, Damaged, Record

LOOSE_BYTES = 1 << 20  # messages outside chunks are decoded in batches of this size
SMALLEST_INFLATION = 1 << 24  # bytes, whatever the size of the file
LARGEST_RATIO = 256
LARGEST_BOMB = 1 << 27  # bytes of a chunk that shrank by more than is usual
USUAL_RATIO = 16
_SIZE_INSIDE, _CHECKSUM = slice(16, 24), slice(24, 28)  # of the content of a chunk


@dataclass(frozen=True)
class Payload:
    """Schema, channel and message records as they stand in a chunk, decompressed."""

    place: str
    data: bytes


class Inflation:
    """How many bytes the chunks of one file may decompress to, told from the file's own size.

    Samples at rest shrink to a fiftieth, others to a half: a file of kB that announces GB has none.
    """

    def __init__(self, file_size: int) -> None:
        self._most = self._left = SMALLEST_INFLATION + LARGEST_RATIO * file_size

    def take(self, size: int, stored: int) -> None:
        """Take the bytes of a chunk that is stored in so many; raises Damaged."""
        if size > max(LARGEST_BOMB, USUAL_RATIO * stored):
            raise Damaged(f"announces {size} bytes, but has {stored}")
        if size > self._left:
            raise Damaged(
                f"announces {size} bytes; the chunks of a file of this size decompress to at most "
                f"{self._most}"
            )
        self._left -= size


def open_chunk(record: Record, budget: Inflation) -> Payload:
    """Decompress a chunk and verify its size and checksum; raises Damaged."""
    place = f"chunk at byte {record.offset}"
    chunk = record.parsed(Chunk)
    with at(place):
        budget.take(chunk.uncompressed_size, len(chunk.data))
        return Payload(place, decompressed(chunk))


def has_checksum(record: Record) -> bool:
    """Whether a chunk states the checksum of its samples; that of no samples is 0."""
    return any(record.content[_CHECKSUM]) or not any(record.content[_SIZE_INSIDE])


def decompressed(chunk: Chunk) -> bytes:
    """The records in a chunk, of the size it states and with the checksum; raises Damaged."""
    data = _decompress(chunk)
    if len(data) != chunk.uncompressed_size:
        raise Damaged(f"{len(data)} bytes where {chunk.uncompressed_size} are announced")
    if chunk.uncompressed_crc not in (0, zlib.crc32(data)):
        raise Damaged("wrong checksum")
    return data


def _decompress(chunk: Chunk) -> bytes:
    size = chunk.uncompressed_size
    try:
        match chunk.compression:
            case "":
                return chunk.data
            case "zstd":
                if zstandard.frame_content_size(chunk.data) not in (-1, size):
                    raise Damaged("its size and that of its zstd frame differ")
                return zstandard.ZstdDecompressor().decompress(chunk.data, max_output_size=size)
            case "lz4":
                return lz4.frame.LZ4FrameDecompressor().decompress(chunk.data, max_length=size)
    except (zstandard.ZstdError, RuntimeError, EOFError) as error:
        raise Damaged(f"the {chunk.compression} data cannot be decompressed") from error
    raise Damaged(f"compression {chunk.compression!r} is not one of zstd, lz4 or none")


def payloads(
    records: Iterator[Record], other: Callable[[Record], None], budget: Inflation
) -> Iterator[Payload]:
    """Chunks, and messages outside chunks joined to batches; the rest goes to ``other``."""
    batch, start = bytearray(), 0
    checked: set[bool] = set()  # a writer gives every chunk its checksum, or none
    for record in records:
        if record.opcode in IN_CHUNKS:
            start = start if batch else record.offset
            batch += RECORD_HEAD.pack(record.opcode, len(record.content)) + record.content
        if batch and (record.opcode == Opcode.CHUNK or len(batch) >= LOOSE_BYTES):
            yield Payload(f"messages from byte {start}", bytes(batch))
            batch.clear()
        if record.opcode == Opcode.CHUNK:
            checked.add(has_checksum(record))
            if len(checked) > 1:
                raise Damaged(
                    f"chunk at byte {record.offset}: some chunks have a checksum and some have none"
                )
            yield open_chunk(record, budget)
        elif record.opcode not in IN_CHUNKS:
            other(record)
    if batch:
        yield Payload(f"messages from byte {start}", bytes(batch))
