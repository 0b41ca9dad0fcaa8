"""An MCAP file as records and chunks: framing, sizes and checksums, not what is in them."""

from __future__ import annotations

import math
import os
import struct
import zlib
from collections.abc import Callable, Container, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from io import BytesIO
from pathlib import Path
from typing import BinaryIO, TypeVar

import lz4.frame
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, ChunkIndex, DataEnd, Footer, Statistics

from twin.errors import InputError, at

SMALLEST_WINDOW, LARGEST_WINDOW = 1 << 16, 1 << 22


class FileBytes:
    """The bytes of an open file by their place; raises InputError where the disk refuses them."""

    def __init__(self, stream: BinaryIO, size: int) -> None:
        self._stream = stream
        self._size = size

    def __len__(self) -> int:
        return self._size

    def part(self, start: int, stop: int) -> bytes:
        """The bytes from ``start`` to before ``stop``, or as many as there are."""
        try:
            self._stream.seek(start)
            return self._stream.read(max(0, min(stop, self._size) - start))
        except OSError as error:
            raise InputError(f"cannot be read: {error.strerror or error}") from error

    def windows(self, start: int, stop: int, beyond: int) -> Iterator[tuple[int, int, bytes]]:
        """Place, length and bytes of windows side by side, each with ``beyond`` bytes of the next.

        They grow, as what is searched for is mostly near.
        """
        length = SMALLEST_WINDOW
        while start < stop:
            own = min(length, stop - start)
            yield start, own, self.part(start, start + own + beyond)
            start, length = start + own, min(2 * length, LARGEST_WINDOW)

    def checksum(self, start: int, stop: int) -> int:
        """CRC-32 of the bytes from ``start`` to before ``stop``."""
        crc = 0
        for _, _, data in self.windows(start, stop, 0):
            crc = zlib.crc32(data, crc)
        return crc


MAGIC = b"\x89MCAP0\r\n"
RECORD_HEAD = struct.Struct("<BQ")  # opcode, length of what follows
_FOOTER_SIZE = RECORD_HEAD.size + 20
IN_CHUNKS = (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE)

T = TypeVar("T")


class Damaged(InputError):
    """The bytes are not what the writer wrote: cut off, flipped, or not framed as MCAP."""


@dataclass(frozen=True)
class Record:
    """One record: its opcode, the byte where it begins in the file, and its content."""

    opcode: int
    offset: int
    content: bytes

    @property
    def end(self) -> int:
        """Byte after the record."""
        return self.offset + RECORD_HEAD.size + len(self.content)

    def parsed(self, kind: type[T]) -> T:
        """The content as a record class of ``mcap.records``; raises Damaged."""
        return parse(kind, self.content, f"{kind.__name__} record at byte {self.offset}")


def parse(kind: type[T], content: bytes, place: str) -> T:
    """Parse ``content`` with the stock record class; whatever it raises becomes Damaged."""
    try:
        return kind.read(ReadDataStream(BytesIO(content)))  # type: ignore[attr-defined]
    except (McapError, struct.error, ValueError, OverflowError) as error:
        raise Damaged(f"{place}: cannot be parsed") from error


class McapFile:
    """An open MCAP file whose closing magic and summary are verified.

    statistics: message counts by channel, or None where the writer left them out.
    """

    def __init__(self, stream: BinaryIO, size: int) -> None:
        self.size = size
        self.checked = False  # whether a checksum of all records was found right
        self._stream = stream
        self._check_magic()
        self._summary: list[Record] = []
        self._data_end = self._read_summary()
        self.statistics = next(iter(self._summarised(Opcode.STATISTICS, Statistics)), None)

    def _read_at(self, offset: int, length: int) -> bytes:
        self._stream.seek(offset)
        return self._stream.read(length)

    def _check_magic(self) -> None:
        if self.size == 0:
            raise Damaged("the file is empty")
        if self._read_at(0, len(MAGIC)) != MAGIC:
            raise InputError(
                "not an MCAP file (wrong magic in bytes 0 to 7); convert it with: twin import"
            )
        if (
            self.size < 2 * len(MAGIC) + _FOOTER_SIZE
            or self._read_at(self.size - len(MAGIC), len(MAGIC)) != MAGIC
        ):
            raise Damaged(f"truncated: ends at byte {self.size} without the closing MCAP magic")

    def _read_summary(self) -> int:
        """Keep the records of the summary; returns where the data end."""
        start = self.size - len(MAGIC) - _FOOTER_SIZE
        record = self._record(start, self.size - len(MAGIC))
        if record.opcode != Opcode.FOOTER or len(record.content) != 20:
            raise Damaged(f"no footer record at byte {start}")
        footer = record.parsed(Footer)
        if footer.summary_start == 0:
            return start
        if not len(MAGIC) <= footer.summary_start <= start:
            raise Damaged(f"footer at byte {start} points outside the file")
        summary = self._read_at(footer.summary_start, self.size - footer.summary_start)
        covered = summary[: -len(MAGIC) - 4]
        if footer.summary_crc not in (0, zlib.crc32(covered)):
            raise Damaged(f"summary section at byte {footer.summary_start}: wrong checksum")
        offset = footer.summary_start
        while offset < start:
            record = self._record(offset, start)
            self._summary.append(record)
            offset = record.end
        return footer.summary_start

    def _summarised(self, opcode: int, kind: type[T]) -> list[T]:
        return [record.parsed(kind) for record in self._summary if record.opcode == opcode]

    def channels(self) -> list[Channel]:
        """The channels, as the summary lists them."""
        return self._summarised(Opcode.CHANNEL, Channel)

    def definitions(self) -> list[Record]:
        """The schemas and channels, as the summary lists them."""
        return [r for r in self._summary if r.opcode in (Opcode.SCHEMA, Opcode.CHANNEL)]

    @cached_property
    def _chunks(self) -> list[ChunkIndex]:
        return self._summarised(Opcode.CHUNK_INDEX, ChunkIndex)

    def selected(
        self, channels: Container[int], start: float = -math.inf, stop: float = math.inf
    ) -> Iterator[Record]:
        """Records before the first chunk, and the chunks with messages of some channels and times.

        start, stop: ns. All records where the summary has no index of the chunks.
        """
        if not self._chunks:
            yield from self.records()
            return
        first = min(c.chunk_start_offset for c in self._chunks)
        for record in self.records():
            if record.offset >= first:
                break
            yield record
        for chunk in sorted(self._chunks, key=lambda c: c.message_start_time):
            between = chunk.message_end_time >= start and chunk.message_start_time < stop
            if between and _holds(chunk, channels):
                yield self._record(chunk.chunk_start_offset, self._data_end)

    def records_with(self, channels: Container[int]) -> Iterator[Record]:
        """All records but the chunks that hold messages of other channels alone.

        Those are read as well, so that the checksum of the data section covers them.
        """
        held = {c.chunk_start_offset: _holds(c, channels) for c in self._chunks}
        return (record for record in self.records() if held.get(record.offset, True))

    def _record(self, offset: int, end: int) -> Record:
        head = self._read_at(offset, RECORD_HEAD.size)
        if len(head) < RECORD_HEAD.size or offset + len(head) > end:
            raise Damaged(f"a record is cut off at byte {offset}")
        opcode, length = RECORD_HEAD.unpack(head)
        if length > end - offset - len(head):
            raise Damaged(f"the record at byte {offset} claims {length} bytes, more than follow")
        return Record(opcode, offset, self._stream.read(length))

    def records(self) -> Iterator[Record]:
        """Records of the data section, its checksum verified at the end."""
        offset, crc = len(MAGIC), zlib.crc32(MAGIC)
        while True:
            record = self._record(offset, self._data_end)
            if record.opcode == Opcode.DATA_END:
                break
            yield record
            head = RECORD_HEAD.pack(record.opcode, len(record.content))
            crc = zlib.crc32(record.content, zlib.crc32(head, crc))
            offset = record.end
        if record.end != self._data_end or len(record.content) != 4:
            raise Damaged(f"the data section ends at byte {record.offset}, before the summary")
        stated = record.parsed(DataEnd).data_section_crc
        self.checked = stated == crc
        if stated not in (0, crc):
            raise Damaged(
                f"data section (bytes 0 to {offset}): wrong checksum though every chunk is intact; "
                "metadata, an attachment or an index is damaged"
            )


def _holds(chunk: ChunkIndex, channels: Container[int]) -> bool:
    """Whether a chunk may have messages of these channels; an index may leave out its channels."""
    held = chunk.message_index_offsets
    return not held or any(channel in channels for channel in held)


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Name the file in every failure of reading it, and make each an InputError."""
    with at(str(path)):
        try:
            yield
        except OSError as error:
            raise InputError(
                f"cannot be read: {error.strerror or error}; check the name"
            ) from error
        except MemoryError as error:
            raise InputError("does not fit into memory; split the log") from error


@contextmanager
def open_mcap(path: Path) -> Iterator[McapFile]:
    """Open ``path``; every failure is an InputError that names the file."""
    with reading(path), open(path, "rb") as stream:
        yield McapFile(stream, os.fstat(stream.fileno()).st_size)


SMALLEST_INFLATION = 1 << 24  # bytes, whatever the size of the file
LARGEST_RATIO = 256
LARGEST_BOMB = 1 << 27  # bytes of a chunk that shrank by more than is usual
USUAL_RATIO = 16


@dataclass(frozen=True)
class Payload:
    """Schema, channel and message records as they stand in a chunk, decompressed.

    proved: whether a checksum says that they are what was written.
    """

    place: str
    data: bytes
    proved: bool


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
        data = decompressed(chunk)
    return Payload(place, data, chunk.uncompressed_crc != 0)


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
    """The chunks; the rest goes to ``other``. Raises Damaged, InputError."""
    for record in records:
        if record.opcode == Opcode.CHUNK:
            payload = open_chunk(record, budget)
            if payload.data and not payload.proved:
                raise Damaged(f"{payload.place}: states no checksum of its samples")
            yield payload
        elif record.opcode == Opcode.MESSAGE:
            raise InputError(
                f"a message at byte {record.offset} is outside the chunks; convert the log with: "
                "twin import"
            )
        else:
            other(record)
