"""An MCAP file as records and chunks: framing, sizes and checksums, not what is in them."""

from __future__ import annotations

import math
import os
import struct
import zlib
from collections.abc import Container, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import BinaryIO, TypeVar

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, ChunkIndex, DataEnd, Footer, Statistics
from mcap.stream_reader import CRCValidationError, get_chunk_data_stream

from twin.errors import InputError, at

MAGIC = b"\x89MCAP0\r\n"
RECORD_HEAD = struct.Struct("<BQ")  # opcode, length of what follows
_FOOTER_SIZE = RECORD_HEAD.size + 20
IN_CHUNKS = (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE)
LARGEST_RATIO = 256  # of what any format of this house shrinks to

_LFS = b"version https://git-lfs.github.com/spec/"

T = TypeVar("T")


class Damaged(InputError):
    """The bytes are not what the writer wrote: cut off, flipped, or not framed as MCAP."""


class FileBytes:
    """The bytes of an open file by their place; raises InputError where the disk refuses them."""

    def __init__(self, stream: BinaryIO) -> None:
        self._stream = stream
        self._size = os.fstat(stream.fileno()).st_size

    def __len__(self) -> int:
        return self._size

    def part(self, start: int, stop: int) -> bytes:
        """The bytes from ``start`` to before ``stop``, or as many as there are."""
        try:
            self._stream.seek(start)
            return self._stream.read(max(0, min(stop, self._size) - start))
        except OSError as error:
            raise InputError(f"cannot be read: {error.strerror or error}") from error


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

    @property
    def place(self) -> str:
        """Where a chunk is."""
        return f"chunk at byte {self.offset}"

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

    definitions: the schemas and channels that the summary lists. counts: messages by channel, None
    where the writer left the statistics out.
    """

    def __init__(self, data: FileBytes) -> None:
        self._bytes = data
        self.size = len(data)
        self._summary: list[Record] = []
        self._data_end = self._read_summary()
        self.definitions = [r for r in self._summary if r.opcode in IN_CHUNKS]
        statistics = self._summarised(Opcode.STATISTICS, Statistics)
        self.counts = statistics[0].channel_message_counts if statistics else None

    def _read_summary(self) -> int:
        """Keep the records of the summary; returns where the data end."""
        if self.size == 0:
            raise Damaged("the file is empty")
        if self._bytes.part(0, len(MAGIC)) != MAGIC:
            raise InputError(
                "not an MCAP file (wrong magic in bytes 0 to 7); convert it with: twin import"
            )
        end = self.size - len(MAGIC)
        start = end - _FOOTER_SIZE
        if start < len(MAGIC) or self._bytes.part(end, self.size) != MAGIC:
            raise Damaged(f"truncated: ends at byte {self.size} without the closing MCAP magic")
        record = self._record(start, end)
        if record.opcode != Opcode.FOOTER or record.end != end:
            raise Damaged(f"no footer record at byte {start}")
        footer = record.parsed(Footer)
        offset = footer.summary_start
        if offset == 0:
            return start
        if not len(MAGIC) <= offset <= start:
            raise Damaged(f"footer at byte {start} points outside the file")
        if footer.summary_crc not in (0, zlib.crc32(self._bytes.part(offset, end - 4))):
            raise Damaged(f"summary section at byte {offset}: wrong checksum")
        while offset < start:
            self._summary.append(self._record(offset, start))
            offset = self._summary[-1].end
        return footer.summary_start

    def _summarised(self, opcode: int, kind: type[T]) -> list[T]:
        return [record.parsed(kind) for record in self._summary if record.opcode == opcode]

    def channels(self) -> list[Channel]:
        """The channels, as the summary lists them."""
        return self._summarised(Opcode.CHANNEL, Channel)

    def selected(
        self, channels: Container[int], start: float = -math.inf, stop: float = math.inf
    ) -> Iterator[Record]:
        """Records before the first chunk, and the chunks with messages of some channels and times.

        start, stop: ns. All records where the summary has no index of the chunks.
        """
        chunks = self._summarised(Opcode.CHUNK_INDEX, ChunkIndex)
        first = min((c.chunk_start_offset for c in chunks), default=self.size)
        for record in self.records():
            if record.offset >= first:
                break
            yield record
        for chunk in sorted(chunks, key=lambda c: c.message_start_time):
            held = chunk.message_index_offsets  # which an index may leave out
            between = chunk.message_end_time >= start and chunk.message_start_time < stop
            if between and (not held or any(channel in channels for channel in held)):
                yield self._record(chunk.chunk_start_offset, self._data_end)

    def _record(self, offset: int, end: int) -> Record:
        start = offset + RECORD_HEAD.size
        if offset < 0 or start > end:
            raise Damaged(f"a record is cut off at byte {offset}")
        opcode, length = RECORD_HEAD.unpack(self._bytes.part(offset, start))
        if length > end - start:
            raise Damaged(f"the record at byte {offset} claims {length} bytes, more than follow")
        return Record(opcode, offset, self._bytes.part(start, start + length))

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
        if record.parsed(DataEnd).data_section_crc not in (0, crc):
            raise Damaged(
                f"data section (bytes 0 to {offset}): wrong checksum though every chunk is intact; "
                "metadata, an attachment or an index is damaged"
            )


def record_at(data: bytes, offset: int) -> tuple[int, bytes, int]:
    """Opcode, content and end of the record at ``offset`` of a chunk; raises Damaged."""
    start = offset + RECORD_HEAD.size
    if start > len(data):
        raise Damaged(f"a record is cut off, {offset} bytes into it")
    opcode, length = RECORD_HEAD.unpack_from(data, offset)
    if length > len(data) - start:
        raise Damaged(f"a record claims more bytes than follow, {offset} bytes into it")
    if opcode not in IN_CHUNKS:
        raise Damaged(f"a record of kind {opcode}, which no chunk holds, {offset} bytes into it")
    return opcode, data[start : start + length], start + length


def require_fetched(path: Path) -> None:
    """Raise InputError where a file is the pointer that Git LFS leaves in the place of one."""
    with open(path, "rb") as stream:
        if stream.read(len(_LFS)) == _LFS:
            raise InputError(
                "is a pointer of Git LFS, not the recording itself; fetch that with: git lfs pull"
            )


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
        require_fetched(path)
        yield McapFile(FileBytes(stream))


class Inflation:
    """How many bytes the chunks of one file may decompress to, told from the file's own size.

    Samples at rest shrink to a fiftieth, others to a half: a file of kB that announces GB has none.
    """

    def __init__(self, file_size: int) -> None:
        smallest_inflation = 1 << 24  # bytes, whatever the size of the file
        self._most = self._left = smallest_inflation + LARGEST_RATIO * file_size

    def take(self, size: int, stored: int) -> None:
        """Take the bytes of a chunk that is stored in so many; raises Damaged."""
        largest_bomb = 1 << 27  # bytes of a chunk that shrank by more than is usual
        usual_ratio = 16  # samples of a drive shrink by 2 to 10
        if size > max(largest_bomb, usual_ratio * stored):
            raise Damaged(f"announces {size} bytes, but has {stored}")
        if size > self._left:
            raise Damaged(
                f"announces {size} bytes; the chunks of a file of this size decompress to at most "
                f"{self._most}"
            )
        self._left -= size


def decompressed(chunk: Chunk) -> bytes:
    """The records in a chunk, of the size it states and with the checksum; raises Damaged."""
    kind, size = chunk.compression, chunk.uncompressed_size
    if kind not in ("zstd", "lz4", ""):
        raise Damaged(f"compression {kind!r} is not one of zstd, lz4 or none")
    try:
        # the library takes the size of the frame, whatever the chunk states
        if kind == "zstd" and zstandard.frame_content_size(chunk.data) not in (-1, size):
            raise Damaged("its size and that of its zstd frame differ")
        stream, length = get_chunk_data_stream(chunk, validate_crc=True)
    except (zstandard.ZstdError, RuntimeError, EOFError) as error:
        raise Damaged(f"the {kind} data cannot be decompressed") from error
    except CRCValidationError as error:
        raise Damaged("wrong checksum") from error
    if length != size:
        raise Damaged(f"{length} bytes where {size} are announced")
    return stream.read(length)


def open_chunk(record: Record, budget: Inflation) -> tuple[bytes, bool]:
    """The records in a chunk, and whether a checksum proves them; raises Damaged."""
    chunk = record.parsed(Chunk)
    with at(record.place):
        budget.take(chunk.uncompressed_size, len(chunk.data))
        return decompressed(chunk), chunk.uncompressed_crc != 0
