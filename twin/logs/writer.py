"""Log -> MCAP: chunks laid out by NumPy, every index and checksum written, all or nothing."""

from __future__ import annotations

import zlib
from collections import defaultdict, deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from itertools import chain
from pathlib import Path, PurePath
from typing import BinaryIO, TypeVar

import numpy as np
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)
from numpy.typing import NDArray

from twin.files import atomic_writer, recording
from twin.logs.assemble import CHECKSUM, METADATA_NAME, checksum
from twin.logs.container import MAGIC
from twin.logs.layout import sample_times
from twin.logs.log import Array, Log
from twin.logs.outline import Outline, Planned, Samples, outline, outline_of_topics, samples_of

# Made for messages that repeat every few hundred bytes: tables that soon forget find the last one.
# With the tags of `numbered` 8 % smaller than level 3, which most writers use, in half of its time.
_COMPRESSION = zstandard.ZstdCompressionParameters(
    strategy=zstandard.STRATEGY_DFAST, window_log=17, hash_log=8, chain_log=8, search_log=1,
    min_match=4,
)  # fmt: skip
_INDEX_ENTRY = np.dtype([("time", "<u8"), ("offset", "<u8")])
_MEDIA_TYPES = {".toml": "application/toml", ".xml": "application/xml"}


def encoded(records: Iterable[McapRecord]) -> bytes:
    """Records as bytes, one after the other."""
    builder = RecordBuilder()
    for record in records:
        record.write(builder)
    return builder.end()


@dataclass(frozen=True)
class PackedChunk:
    """A chunk ready to be written.

    times: (n,) in ns; channel: of all its messages; offsets: (n,) byte of each in the chunk.
    """

    chunk: Chunk
    times: NDArray[np.int64]
    channel: int
    offsets: NDArray


def pack(
    payload: memoryview, times: NDArray[np.int64], channel: int, offsets: NDArray
) -> PackedChunk:
    """Compress a chunk; takes most of the time of writing, and may run on any thread."""
    chunk = Chunk(
        compression="zstd",
        data=zstandard.ZstdCompressor(compression_params=_COMPRESSION).compress(payload),
        message_start_time=int(times[0]),
        message_end_time=int(times[-1]),
        uncompressed_crc=zlib.crc32(payload),
        uncompressed_size=len(payload),
    )
    return PackedChunk(chunk, times, channel, offsets)


class McapWriter:
    """Writes to ``stream`` from its beginning: metadata and attachments, chunks, ``finish``."""

    def __init__(self, stream: BinaryIO) -> None:
        self._stream = stream
        self._offset = 0
        self._crc = 0
        self._metadata: list[MetadataIndex] = []
        self._attachments: list[AttachmentIndex] = []
        self._chunks: list[ChunkIndex] = []
        self._counts: defaultdict[int, int] = defaultdict(int)
        self._write(MAGIC)
        self._write(encoded([Header(profile="", library=f"proton-twin {software_version()}")]))

    def add_metadata(self, name: str, metadata: Mapping[str, str]) -> None:
        """Write a metadata record."""
        offset, length = self._write(encoded([Metadata(name, dict(metadata))]))
        self._metadata.append(MetadataIndex(offset, length, name))

    def add_attachment(self, name: str, data: bytes) -> None:
        """Write an attachment; its times are 0 so that the same log gives the same bytes."""
        media_type = _MEDIA_TYPES.get(PurePath(name).suffix, "application/octet-stream")
        offset, length = self._write(encoded([Attachment(0, 0, name, media_type, data)]))
        self._attachments.append(AttachmentIndex(offset, length, 0, 0, len(data), name, media_type))

    def add_chunk(self, packed: PackedChunk) -> None:
        """Write a chunk and its message index."""
        chunk = packed.chunk
        start, length = self._write(encoded([chunk]))
        index_start = self._offset
        index_offset = self._write_index(packed.channel, packed.times, packed.offsets)
        self._chunks.append(
            ChunkIndex(
                chunk_length=length,
                chunk_start_offset=start,
                compression=chunk.compression,
                compressed_size=len(chunk.data),
                message_end_time=chunk.message_end_time,
                message_index_length=self._offset - index_start,
                message_index_offsets={packed.channel: index_offset},
                message_start_time=chunk.message_start_time,
                uncompressed_size=chunk.uncompressed_size,
            )
        )

    def _write_index(self, channel: int, times: NDArray[np.int64], offsets: NDArray) -> int:
        # mcap.records.MessageIndex takes a list of tuples, which costs more than all the rest
        entries = np.empty(len(times), _INDEX_ENTRY)
        entries["time"] = times
        entries["offset"] = offsets
        builder = RecordBuilder()
        builder.start_record(Opcode.MESSAGE_INDEX)
        builder.write2(channel)
        builder.write4(entries.nbytes)
        builder.write(entries.tobytes())
        builder.finish_record()
        self._counts[channel] += len(times)
        return self._write(builder.end())[0]

    def finish(self, schemas: Sequence[Schema], channels: Sequence[Channel]) -> None:
        """Close the data section and write summary, footer and magic."""
        self._write(encoded([DataEnd(self._crc)]))
        start, self._crc = self._offset, 0
        groups: list[tuple[Opcode, Sequence[McapRecord]]] = [
            (Opcode.SCHEMA, schemas),
            (Opcode.CHANNEL, channels),
            (Opcode.STATISTICS, [self._statistics(len(schemas), len(channels))]),
            (Opcode.CHUNK_INDEX, self._chunks),
            (Opcode.ATTACHMENT_INDEX, self._attachments),
            (Opcode.METADATA_INDEX, self._metadata),
        ]
        places = [(opcode, *self._write(encoded(group))) for opcode, group in groups if group]
        offsets_start = self._offset
        self._write(encoded(SummaryOffset(*place) for place in places))
        # the checksum of the summary covers the footer up to the checksum itself
        unchecked = encoded([Footer(start, offsets_start, 0)])[:-4]
        self._write(unchecked)
        self._write(self._crc.to_bytes(4, "little") + MAGIC)

    def _statistics(self, schemas: int, channels: int) -> Statistics:
        return Statistics(
            attachment_count=len(self._attachments),
            channel_count=channels,
            channel_message_counts=dict(self._counts),
            chunk_count=len(self._chunks),
            message_count=sum(self._counts.values()),
            message_end_time=self._chunks[-1].message_end_time,
            message_start_time=self._chunks[0].message_start_time,
            metadata_count=len(self._metadata),
            schema_count=schemas,
        )

    def _write(self, data: bytes) -> tuple[int, int]:
        """Write bytes; returns where they begin and how many they are."""
        start = self._offset
        self._stream.write(data)
        self._offset += len(data)
        self._crc = zlib.crc32(data, self._crc)
        return start, len(data)


@cache  # a package's metadata are pages, parsed line by line
def software_version(package: str = "proton-twin") -> str:
    """The version of a package, or that it is not installed."""
    try:
        return version(package)
    except PackageNotFoundError:
        return "uninstalled"


CHUNK_BYTES = 1 << 20
WORKERS = 2

S = TypeVar("S")
T = TypeVar("T")

Progress = Callable[[int, int], None]
"""Called with the samples written so far and their total."""


def write_log(log: Log, path: str | Path, progress: Progress | None = None) -> None:
    """Write ``log`` as MCAP; the same log gives the same bytes.

    ``path`` appears only when it is complete. Raises InputError for a log that could not be read
    back (a NaN, columns of different length, no position, ...) and where writing fails.
    """
    plan, samples = outline(log), samples_of(log)
    with atomic_writer(Path(path)) as stream:
        for written in _written(stream, plan, [samples], log.sample_rate, log.attachments):
            if progress is not None:
                progress(written, len(log))


def record_log(parts: Iterable[Log], path: str | Path) -> int:
    """Write a log part by part while it is being recorded; returns the number of samples.

    The parts follow each other without a gap. The bytes are those that ``write_log`` writes of the
    whole. ``path`` appears only when it is complete; until then the file is called
    ``path.unfinished``, and what a killed run leaves of it can be recovered up to the last chunk.
    Raises InputError as write_log does.
    """
    with recording(Path(path)) as stream:
        return _recorded(stream, parts)


def write_parts(parts: Iterable[Log], path: str | Path) -> int:
    """``record_log`` for what is there already: nothing is left of it where it is not finished."""
    with atomic_writer(Path(path)) as stream:
        return _recorded(stream, parts)


def _recorded(stream: BinaryIO, parts: Iterable[Log]) -> int:
    coming = iter(parts)
    first = next(coming)
    samples = _counted(chain([first], coming))
    written = _written(stream, outline(first), samples, first.sample_rate, first.attachments)
    return deque(written, maxlen=1).pop()


def write_topics(
    topics: Mapping[str, Mapping[str, Array]],
    units: Mapping[str, str],
    sample_rate: float,
    path: str | Path,
) -> None:
    """Write columns (n,) of any topics, "/model/x" -> name -> column, for other programs to show.

    units: "/model/x/force" -> unit. Raises InputError as write_log does.
    """
    plan, samples = outline_of_topics(topics, units, sample_rate)
    with atomic_writer(Path(path)) as stream:
        for _ in _written(stream, plan, [samples], sample_rate, {}):
            pass


def _counted(parts: Iterable[Log]) -> Iterator[Samples]:
    """The samples of parts that follow each other."""
    first = 0
    for part in parts:
        yield samples_of(part, first)
        first += len(part)


def _written(
    stream: BinaryIO,
    plan: Outline,
    parts: Iterable[Samples],
    sample_rate: float,
    attachments: Mapping[str, bytes],
) -> Iterator[int]:
    """Write a whole file; yields the number of samples written after each stretch of them.

    Of a stretch every topic has a chunk of its own, so that one can be read without the others.
    Every chunk begins with its schema and channel: any one of them can be read alone.
    """
    writer = McapWriter(stream)
    proof = {CHECKSUM: checksum(plan.metadata)}
    writer.add_metadata(METADATA_NAME, {**plan.metadata, **proof})
    for name, data in attachments.items():
        writer.add_attachment(name, data)
    most = max(1, CHUNK_BYTES // plan.row_bytes)
    stretches = _in_chunks(parts, most)
    # The axes come last, so that what a killed run leaves of a stretch is seldom some axes alone.
    chunks = (
        (topic, first, columns)
        for first, samples in stretches
        for topic, columns in reversed(list(zip(plan.topics, samples, strict=True)))
    )

    def chunk(item: tuple[Planned, int, Mapping[str, Array]]) -> PackedChunk:
        return _packed(*item, sample_rate)

    written = 0
    for packed in _ordered(chunk, chunks):
        writer.add_chunk(packed)
        if packed.channel == plan.topics[0].channel.id:
            written += len(packed.times)
            yield written
    writer.finish(plan.schemas, [topic.channel for topic in plan.topics])


def _in_chunks(parts: Iterable[Samples], most: int) -> Iterator[tuple[int, Samples]]:
    """The samples in chunks of ``most``, each with the number of its first; the last is shorter."""
    first, held = 0, None
    for part in parts:
        samples = part if held is None else _behind(held, part)
        whole = _count(samples) // most * most
        for start in range(0, whole, most):
            yield first + start, _cut(samples, start, start + most)
        first += whole
        held = _cut(samples, whole, _count(samples))
    if held is not None and _count(held):
        yield first, held


def _count(samples: Samples) -> int:
    return len(next(iter(samples[0].values())))


def _cut(samples: Samples, start: int, stop: int) -> Samples:
    return tuple({name: c[start:stop] for name, c in columns.items()} for columns in samples)


def _behind(before: Samples, after: Samples) -> Samples:
    return tuple(
        {name: np.concatenate([column, new[name]]) for name, column in columns.items()}
        for columns, new in zip(before, after, strict=True)
    )


def _packed(
    topic: Planned, first: int, columns: Mapping[str, Array], sample_rate: float
) -> PackedChunk:
    """The chunk of a topic's samples from number ``first`` on."""
    head, layout = encoded([topic.schema, topic.channel]), topic.layout
    times = sample_times(first, len(next(iter(columns.values()))), sample_rate)
    size = layout.dtype.itemsize
    buffer = np.empty(len(head) + len(times) * size, np.uint8)
    buffer[: len(head)] = np.frombuffer(head, np.uint8)
    messages = buffer[len(head) :].view(layout.dtype)
    messages[:] = layout.template
    messages[".sequence"] = np.arange(first, first + len(messages))
    messages[".log_time"] = messages[".publish_time"] = times
    for name, column in columns.items():
        messages[name] = column
    offsets = len(head) + size * np.arange(len(times))
    return pack(buffer.data, times, topic.channel.id, offsets)


def _ordered(function: Callable[[S], T], items: Iterable[S]) -> Iterator[T]:
    """Results in the order of ``items``, a few of them computed ahead on other threads."""
    with ThreadPoolExecutor(WORKERS) as pool:
        pending: deque[Future[T]] = deque()
        for item in items:
            pending.append(pool.submit(function, item))
            if len(pending) > WORKERS:
                yield pending.popleft().result()
        while pending:
            yield pending.popleft().result()
