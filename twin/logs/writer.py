"""Log -> MCAP: chunks laid out by NumPy, every index and checksum written, all or nothing."""

from __future__ import annotations

import math
import struct
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
from mcap import records
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.well_known import MessageEncoding, SchemaEncoding

from twin.errors import InputError, at
from twin.files import atomic_writer, recording
from twin.logs.container import MAGIC
from twin.logs.decode import CHECKSUM, METADATA_NAME, SCHEMA_VERSION, checksum
from twin.logs.log import Array, AxisLog, Log, complete_units, in_multiples
from twin.logs.topics import (
    AXIS_PREFIX,
    AXIS_SAMPLE,
    AXIS_TRUTH,
    FIELD_NUMBERS,
    IDENTIFIER,
    TRUTH_PREFIX,
    MessageLayout,
    file_descriptor_set,
    numbered,
    sample_times,
    seconds,
)
from twin.numbers import first_not_finite

CHUNK_BYTES = 1 << 20  # of the samples in all chunks of a stretch, as the format recommends
SERIES = "twin.Series"  # the message of a topic that no log of a machine has
# Made for messages that repeat every few hundred bytes: tables that soon forget find the last one.
# With the tags of `numbered` 8 % smaller than level 3, which most writers use, in half of its time.
_COMPRESSION = zstandard.ZstdCompressionParameters(
    strategy=zstandard.STRATEGY_DFAST, window_log=17, hash_log=8, chain_log=8, search_log=1,
    min_match=4,
)  # fmt: skip
_INDEX_HEAD = struct.Struct("<BQHI")  # opcode, length of what follows, channel, bytes of entries
_INDEX_ENTRY = np.dtype([("time", "<u8"), ("offset", "<u8")])
_MEDIA_TYPES = {".toml": "application/toml", ".xml": "application/xml"}
_TRUTH_UNITS = ("position", "velocity")  # truth columns of these names have the axis' units
S = TypeVar("S")
T = TypeVar("T")


@dataclass(frozen=True)
class TopicSignals:
    """One topic to be written: numbers gives field -> protobuf number, in the order written."""

    topic: str
    message: str
    columns: Mapping[str, Array]
    numbers: Mapping[str, int]
    metadata: Mapping[str, str]


@dataclass(frozen=True)
class Planned:
    """One topic of a file: its schema, channel and the layout of its messages."""

    schema: records.Schema
    channel: records.Channel
    layout: MessageLayout


@dataclass(frozen=True)
class Outline:
    """Everything of a file but the samples. sample_rate: Hz."""

    topics: tuple[Planned, ...]
    sample_rate: float
    metadata: Mapping[str, str]
    attachments: Mapping[str, bytes]

    @classmethod
    def of(
        cls, topics: Iterable[TopicSignals], sample_rate: float, metadata: Mapping[str, str],
        attachments: Mapping[str, bytes],
    ) -> Outline:  # fmt: skip
        """The file of these topics; equal schemas are written once."""
        schemas: dict[bytes, records.Schema] = {}
        planned = []
        for number, signals in enumerate(topics, 1):
            data = file_descriptor_set(signals.message, signals.numbers)
            new = records.Schema(len(schemas) + 1, data, SchemaEncoding.Protobuf, signals.message)
            schema = schemas.setdefault(data, new)
            channel = records.Channel(
                number, signals.topic, MessageEncoding.Protobuf, dict(signals.metadata), schema.id
            )
            planned.append(Planned(schema, channel, MessageLayout(number, signals.numbers)))
        return cls(tuple(planned), sample_rate, metadata, attachments)


def outline_of(log: Log) -> Outline:
    """The file of a log; raises InputError for one that could not be read back."""
    if not log.axes or len(log) == 0:
        raise InputError("the log has no samples; record or import at least one")
    for name in (*log.axes, *log.truth):
        if not IDENTIFIER.fullmatch(name):
            raise InputError(f"axis name {name!r}: use letters, digits and underscores, as in x")
    for key, value in log.metadata.items():
        if not isinstance(value, str):
            raise InputError(f"metadata {key} is {value!r}; metadata values are text")
    rate, axes = repr(float(log.sample_rate)), ",".join(log.axes)
    own = {"schema_version": SCHEMA_VERSION, "sample_rate_hz": rate, "axes": axes}
    given = {key: value for key, value in log.metadata.items() if key != CHECKSUM}
    return Outline.of(signals_of(log), log.sample_rate, {**given, **own}, log.attachments)


def signals_of(log: Log) -> Iterator[TopicSignals]:
    """The topics of a log, or of a part of one; raises InputError where an axis lacks anything."""
    rate = {"sample_rate_hz": repr(float(log.sample_rate))}
    for name, axis in log.axes.items():
        topic = AXIS_PREFIX + name
        with at(topic):
            _check_axis(axis)
            units = complete_units(axis.units)
        numbers = {field: n for field, n in FIELD_NUMBERS.items() if field in axis.columns}
        known = {f"unit.{field}": units[field] for field in numbers}
        metadata = {"axis": name, **rate, **known}
        if axis.force_constant is not None:
            metadata["force_constant"] = repr(float(axis.force_constant))
        yield TopicSignals(topic, AXIS_SAMPLE, axis.columns, numbers, metadata)
    for name, columns in log.truth.items():
        units = complete_units(log.axes[name].units) if name in log.axes else {}
        known = {f"unit.{c}": units[c] for c in _TRUTH_UNITS if c in columns and c in units}
        metadata = {"axis": name, **rate, **known}
        yield TopicSignals(TRUTH_PREFIX + name, AXIS_TRUTH, columns, numbered(columns), metadata)


def _check_axis(axis: AxisLog) -> None:
    unknown = set(axis.columns) - set(FIELD_NUMBERS)
    if unknown:
        raise InputError(
            f"unknown signal {', '.join(sorted(unknown))}; allowed: {', '.join(FIELD_NUMBERS)}"
        )
    if "position" not in axis.columns or not {"current", "force"} & set(axis.columns):
        raise InputError("a log needs position and one of current and force; add what is missing")
    constant = axis.force_constant
    if constant is not None and not 0.0 < constant < math.inf:
        raise InputError(f"force constant is {constant} {axis.kind('N/A')}; give a number above 0")


def _require_samples(signals: TopicSignals, count: int, sample_rate: float, first: int) -> None:
    """Raise InputError where a column is not a number for each of the samples from ``first`` on."""
    for name, column in signals.columns.items():
        if not IDENTIFIER.fullmatch(name):
            raise InputError(f"column name {name!r}: use letters, digits and underscores")
        if np.shape(column) != (count,):
            raise InputError(
                f"{name} has shape {np.shape(column)}, expected ({count},): one value a sample"
            )
        if np.asarray(column).dtype.kind not in "fiu":
            raise InputError(f"{name} holds {np.asarray(column).dtype} values; give real numbers")
        if (i := first_not_finite(column)) is not None:
            raise InputError(
                f"{name} is {column[i]} at {seconds((first + i) * 1e9 / sample_rate)} "
                f"(sample {first + i}); "
                "leave out a signal that was not recorded"
            )


def write_log(log: Log, path: str | Path, *, chunk_bytes: int = CHUNK_BYTES) -> None:
    """Write ``log`` as MCAP; the same log gives the same bytes.

    ``path`` appears only when it is complete. chunk_bytes: of the samples in all chunks of a
    stretch; what damage costs at least. Raises InputError for a log that could not be read back (a
    NaN, columns of different length, no position, ...) and where writing fails.
    """
    write_parts([log], path, chunk_bytes=chunk_bytes)


def record_log(parts: Iterable[Log], path: str | Path, *, chunk_bytes: int = CHUNK_BYTES) -> int:
    """Write a log part by part while it is being recorded; returns the number of samples.

    The parts follow each other without a gap. The bytes are those that ``write_log`` writes of the
    whole. ``path`` appears only when it is complete; until then the file is called
    ``path.unfinished``, and what a killed run leaves of it can be recovered up to the last chunk.
    Raises InputError as write_log does.
    """
    with recording(Path(path)) as stream:
        return _recorded(stream, parts, chunk_bytes)


def write_parts(parts: Iterable[Log], path: str | Path, *, chunk_bytes: int = CHUNK_BYTES) -> int:
    """``record_log`` for what is there already: nothing is left of it where it is not finished."""
    with atomic_writer(Path(path)) as stream:
        return _recorded(stream, parts, chunk_bytes)


def _recorded(stream: BinaryIO, parts: Iterable[Log], chunk_bytes: int) -> int:
    coming = iter(parts)
    first = next(coming)
    return _written(stream, outline_of(first), signals_of, chain([first], coming), chunk_bytes)


def write_topics(
    topics: Mapping[str, Mapping[str, Array]],
    units: Mapping[str, str],
    sample_rate: float,
    path: str | Path,
) -> None:
    """Write columns (n,) of any topics, "/model/x" -> name -> column, for other programs to show.

    units: "/model/x/force" -> unit. Raises InputError as write_log does.
    """
    rate = {"sample_rate_hz": repr(float(sample_rate))}

    def series(log: Log) -> Iterator[TopicSignals]:
        for topic, axis in log.axes.items():
            known = {f"unit.{c}": u for c in axis.columns if (u := units.get(f"{topic}/{c}"))}
            yield TopicSignals(
                topic, SERIES, axis.columns, numbered(axis.columns), {**rate, **known}
            )

    log = Log(sample_rate, {topic: AxisLog(columns) for topic, columns in topics.items()})
    outline = Outline.of(series(log), sample_rate, {"source": "comparison"}, {})
    with atomic_writer(Path(path)) as stream:
        _written(stream, outline, series, [log], CHUNK_BYTES)


Topics = Callable[[Log], Iterable[TopicSignals]]
"""The topics of a part of a log, always the same ones in the same order."""
_Stretch = tuple[Planned, int, Mapping[str, Array]]  # a topic, the number of its first sample


def _written(
    stream: BinaryIO, outline: Outline, topics_of: Topics, parts: Iterable[Log], chunk_bytes: int
) -> int:
    """Write a whole file, whose chunks can be read alone; returns the samples of each topic."""
    writer = McapWriter(stream)
    proof = {CHECKSUM: checksum(outline.metadata)}
    writer.add_metadata(METADATA_NAME, {**outline.metadata, **proof})
    for name, data in outline.attachments.items():
        writer.add_attachment(name, data)
    most = max(1, chunk_bytes // sum(topic.layout.dtype.itemsize for topic in outline.topics))

    def chunk(stretch: _Stretch) -> tuple[int, records.Chunk, np.ndarray]:
        return stretch[0].channel.id, *_packed(*stretch, outline.sample_rate)

    for packed in _ordered(chunk, _stretches(outline, topics_of, parts, most)):
        writer.add_chunk(*packed)
    return writer.finish(outline.topics)


def _stretches(
    outline: Outline, topics_of: Topics, parts: Iterable[Log], most: int
) -> Iterator[_Stretch]:
    """Every topic of each ``most`` samples, with the number of the first; raises InputError."""
    first = 0
    for part in in_multiples(_sound(outline, topics_of, parts), most):
        for start in range(0, len(part), most):
            signals = topics_of(part.part(start, start + most))
            # the axes last: what a killed run leaves of a stretch is seldom some axes alone
            for topic, own in reversed(list(zip(outline.topics, signals, strict=True))):
                yield topic, first + start, own.columns
        first += len(part)


def _sound(outline: Outline, topics_of: Topics, parts: Iterable[Log]) -> Iterator[Log]:
    """The parts, each with a finite number in every place; raises InputError."""
    first = 0
    for part in parts:
        for signals in topics_of(part):
            with at(signals.topic):
                _require_samples(signals, len(part), outline.sample_rate, first)
        yield part
        first += len(part)


def _packed(
    topic: Planned, first: int, columns: Mapping[str, Array], sample_rate: float
) -> tuple[records.Chunk, np.ndarray]:
    """The chunk of a topic's samples from number ``first`` on, and its index, entries (n,)."""
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
    chunk = records.Chunk(
        compression="zstd",
        data=zstandard.ZstdCompressor(compression_params=_COMPRESSION).compress(buffer.data),
        message_start_time=int(times[0]),
        message_end_time=int(times[-1]),
        uncompressed_crc=zlib.crc32(buffer.data),
        uncompressed_size=len(buffer),
    )
    index = np.empty(len(times), _INDEX_ENTRY)
    index["time"] = times
    index["offset"] = len(head) + size * np.arange(len(times))
    return chunk, index


def _ordered(function: Callable[[S], T], items: Iterable[S]) -> Iterator[T]:
    """Results in the order of ``items``, a few of them computed ahead on other threads."""
    workers = 2  # threads that compress; more would wait for the disk
    with ThreadPoolExecutor(workers) as pool:
        pending: deque[Future[T]] = deque()
        for item in items:
            pending.append(pool.submit(function, item))
            if len(pending) > workers:
                yield pending.popleft().result()
        while pending:
            yield pending.popleft().result()


def encoded(of: Iterable[records.McapRecord]) -> bytes:
    """Records as bytes, one after the other."""
    builder = RecordBuilder()
    for record in of:
        record.write(builder)
    return builder.end()


class McapWriter:
    """Writes to ``stream`` from its beginning: metadata and attachments, chunks, ``finish``."""

    def __init__(self, stream: BinaryIO) -> None:
        self._stream = stream
        self._offset = self._crc = 0
        self._metadata: list[records.MetadataIndex] = []
        self._attachments: list[records.AttachmentIndex] = []
        self._chunks: list[records.ChunkIndex] = []
        self._counts: defaultdict[int, int] = defaultdict(int)
        self._write(MAGIC)
        self._record(records.Header(profile="", library=f"proton-twin {software_version()}"))

    def add_metadata(self, name: str, metadata: Mapping[str, str]) -> None:
        """Write a metadata record."""
        place = self._record(records.Metadata(name, dict(metadata)))
        self._metadata.append(records.MetadataIndex(*place, name))

    def add_attachment(self, name: str, data: bytes) -> None:
        """Write an attachment; its times are 0 so that the same log gives the same bytes."""
        kind = _MEDIA_TYPES.get(PurePath(name).suffix, "application/octet-stream")
        place = self._record(records.Attachment(0, 0, name, kind, data))
        self._attachments.append(records.AttachmentIndex(*place, 0, 0, len(data), name, kind))

    def add_chunk(self, channel: int, chunk: records.Chunk, index: np.ndarray) -> None:
        """Write a chunk of messages of a channel, and their index."""
        start, length = self._record(chunk)
        # mcap.records.MessageIndex takes a list of tuples, which costs more than all the rest
        head = _INDEX_HEAD.pack(Opcode.MESSAGE_INDEX, 6 + index.nbytes, channel, index.nbytes)
        index_start, index_length = self._write(head + index.tobytes())
        self._counts[channel] += len(index)
        self._chunks.append(
            records.ChunkIndex(
                chunk_length=length,
                chunk_start_offset=start,
                compression=chunk.compression,
                compressed_size=len(chunk.data),
                message_end_time=chunk.message_end_time,
                message_index_length=index_length,
                message_index_offsets={channel: index_start},
                message_start_time=chunk.message_start_time,
                uncompressed_size=chunk.uncompressed_size,
            )
        )

    def finish(self, topics: Sequence[Planned]) -> int:
        """Close the data section, write summary, footer and magic; the samples of each topic."""
        self._record(records.DataEnd(self._crc))
        start, self._crc = self._offset, 0
        schemas = list({topic.schema.id: topic.schema for topic in topics}.values())
        statistics = records.Statistics(
            attachment_count=len(self._attachments),
            channel_count=len(topics),
            channel_message_counts=dict(self._counts),
            chunk_count=len(self._chunks),
            message_count=sum(self._counts.values()),
            message_end_time=self._chunks[-1].message_end_time,
            message_start_time=self._chunks[0].message_start_time,
            metadata_count=len(self._metadata),
            schema_count=len(schemas),
        )
        groups: list[tuple[Opcode, Sequence[records.McapRecord]]] = [
            (Opcode.SCHEMA, schemas),
            (Opcode.CHANNEL, [topic.channel for topic in topics]),
            (Opcode.STATISTICS, [statistics]),
            (Opcode.CHUNK_INDEX, self._chunks),
            (Opcode.ATTACHMENT_INDEX, self._attachments),
            (Opcode.METADATA_INDEX, self._metadata),
        ]
        places = [(opcode, *self._write(encoded(group))) for opcode, group in groups if group]
        offsets_start = self._offset
        self._write(encoded(records.SummaryOffset(*place) for place in places))
        # the checksum of the summary covers the footer up to the checksum itself
        unchecked = encoded([records.Footer(start, offsets_start, 0)])[:-4]
        self._write(unchecked)
        self._write(self._crc.to_bytes(4, "little") + MAGIC)
        return self._counts[topics[0].channel.id]

    def _record(self, record: records.McapRecord) -> tuple[int, int]:
        return self._write(encoded([record]))

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
