"""The MCAP container as it is written: records, indexes, statistics and checksums."""

from __future__ import annotations

import zlib
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import PurePath
from typing import BinaryIO

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

from twin.log.container import MAGIC

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
