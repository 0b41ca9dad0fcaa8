"""An MCAP file as records: framing, magic and checksums, not their content."""

from __future__ import annotations

import math
import os
import struct
import zlib
from collections.abc import Container, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from io import BytesIO
from pathlib import Path
from typing import BinaryIO, TypeVar

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, ChunkIndex, DataEnd, Footer, Statistics

from twin.errors import InputError, at

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
