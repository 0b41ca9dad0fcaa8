"""MCAP files of anyone, whole or damaged: the messages that whole records hold, and what is lost.

A file is walked record by record, as its writer left it: with or without a summary, in chunks or
outside. A chunk with a wrong checksum is left out. Where the framing ends, the next chunk that its
checksum proves is looked for, so that all behind a damaged place is read too.
"""

from __future__ import annotations

import re
import struct
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, Footer, Metadata, Schema, Statistics
from mcap.writer import CompressionType, Writer

from twin.errors import InputError, at
from twin.files import atomic_writer
from twin.logs.container import (
    IN_CHUNKS,
    MAGIC,
    RECORD_HEAD,
    Damaged,
    FileBytes,
    Inflation,
    McapFile,
    Record,
    decompressed,
    open_chunk,
    reading,
    record_at,
    require_fetched,
)
from twin.logs.topics import AXIS_SAMPLE, AXIS_TRUTH, Topics, seconds

_MESSAGE_HEAD = struct.Struct("<HIQQ")  # channel, sequence, log time, publish time
_CHUNK_HEAD = struct.Struct("<BQQQQI")  # of a chunk, up to the name of its compression
_COMPRESSION = re.compile(rb"\x04\0\0\0zstd|\x03\0\0\0lz4")
_OPCODES = frozenset(Opcode)
_WINDOW = 1 << 18  # bytes that are searched for a chunk at a time


class BagMessage(NamedTuple):  # of which a bag has millions
    """A message: its channel, schema (None: none) and number, log and publish time in ns, and data.

    part: of how many damaged places it is behind; messages of one part follow each other.
    """

    channel: Channel
    schema: Schema | None
    sequence: int
    log_time: int
    publish_time: int
    data: bytes
    part: int


@dataclass
class Bag:
    """An MCAP file of anyone; ``lost`` has a sentence for each loss once ``messages`` has ended."""

    file: FileBytes
    lost: list[str] = field(default_factory=list)
    metadata: list[Metadata] = field(default_factory=list)
    attachments: list[Attachment] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._topics = Topics()
        self._part = 0
        self._last: int | None = None  # ns, log time of the last message
        self._read: Counter[int] = Counter()
        self._announced: dict[int, int] | None = None
        if self.file.part(0, len(MAGIC)) != MAGIC:
            raise InputError("not an MCAP file (wrong magic in bytes 0 to 7); export it again")
        with suppress(InputError):  # a chunk that is lost may be the one that defines a channel
            for record in McapFile(self.file).definitions:
                self._topics.register(record.opcode, record.content)

    def messages(self) -> Iterator[BagMessage]:
        """The messages that whole records hold, in the order of the file."""
        budget = Inflation(len(self.file))
        for record in self._records():
            if record.opcode == Opcode.CHUNK:
                try:
                    data, _ = open_chunk(record, budget)
                    found = list(_inner(data))
                except Damaged as error:
                    self._lose(record.offset, record.end, str(error), record)
                    continue
                for opcode, content in found:
                    if (message := self._taken(opcode, content)) is not None:
                        yield message
            elif record.opcode in IN_CHUNKS:
                if (message := self._taken(record.opcode, record.content)) is not None:
                    yield message
            else:
                self._keep(record)
        read = self._read.total()
        if self._announced is not None and (all_ := sum(self._announced.values())) > read:
            if not self.lost:
                self.lost.append(f"{all_ - read} of {all_} messages that its statistics announce")
            self.lost.append(f"of {all_} messages {read} were read")

    def _taken(self, opcode: int, content: bytes) -> BagMessage | None:
        """The message in a record; None where it has none."""
        if opcode != Opcode.MESSAGE:
            self._topics.register(opcode, content)
            return None
        if len(content) < _MESSAGE_HEAD.size:
            raise Damaged(f"a message of {len(content)} bytes, which is too short")
        number, sequence, logged, published = _MESSAGE_HEAD.unpack_from(content)
        if (channel := self._topics.channels.get(number)) is None:
            self.lost.append(f"messages of channel {number}, which is not defined")
            return None
        self._last = logged
        self._read[number] += 1
        schema = self._topics.schemas.get(channel.schema_id)
        data = content[_MESSAGE_HEAD.size :]
        return BagMessage(channel, schema, sequence, logged, published, data, self._part)

    def _keep(self, record: Record) -> None:
        """Take what lies beside the messages."""
        try:
            if record.opcode == Opcode.METADATA:
                self.metadata.append(record.parsed(Metadata))
            elif record.opcode == Opcode.ATTACHMENT:
                self.attachments.append(record.parsed(Attachment))
            elif record.opcode == Opcode.STATISTICS:
                self._announced = dict(record.parsed(Statistics).channel_message_counts)
        except Damaged as error:
            self.lost.append(str(error))

    def _records(self) -> Iterator[Record]:
        """Records in the order of the file, those of its summary too."""
        offset, end = len(MAGIC), len(self.file)
        while offset < end:
            if offset == end - len(MAGIC) and self.file.part(offset, end) == MAGIC:
                return
            record = self._record(offset)
            if record is None:
                behind = self._next_chunk(offset + 1)
                whole = "cut off" if behind is None else "unreadable"
                self._lose(offset, behind or end, whole, self._torn(offset))
                if behind is None:
                    return
                offset = behind
                continue
            if record.opcode == Opcode.FOOTER:
                self._require_end(record)
            yield record
            offset = record.end
        self.lost.append(f"bytes {end} and more: the file ends without its closing mark")

    def _require_end(self, footer: Record) -> None:
        if footer.parsed(Footer).summary_start > footer.offset:
            self.lost.append(f"footer at byte {footer.offset}: points behind itself")

    def _record(self, offset: int) -> Record | None:
        """The record at a place; None where there is none, or not all of it."""
        start = offset + RECORD_HEAD.size
        head = self.file.part(offset, start)
        if len(head) < RECORD_HEAD.size:
            return None
        opcode, length = RECORD_HEAD.unpack(head)
        if opcode not in _OPCODES or length > len(self.file) - start:
            return None
        return Record(opcode, offset, self.file.part(start, start + length))

    def _torn(self, offset: int) -> Record | None:
        """What is left of a chunk at a place, for its times; None where it is no chunk."""
        head = self.file.part(offset, offset + _CHUNK_HEAD.size)
        if len(head) < _CHUNK_HEAD.size or head[0] != Opcode.CHUNK:
            return None
        return Record(Opcode.CHUNK, offset, head[RECORD_HEAD.size :])

    def _next_chunk(self, start: int) -> int | None:
        """Where the next chunk lies that can be decompressed and that its checksum proves."""
        budget = Inflation(len(self.file))
        for place in range(start, len(self.file), _WINDOW):
            data = self.file.part(place, place + _WINDOW + _CHUNK_HEAD.size)
            for name in _COMPRESSION.finditer(data, _CHUNK_HEAD.size):
                offset = place + name.start() - _CHUNK_HEAD.size
                record = self._record(offset)
                if record is None or record.opcode != Opcode.CHUNK:
                    continue
                try:
                    chunk = record.parsed(Chunk)
                    budget.take(chunk.uncompressed_size, len(chunk.data))
                    decompressed(chunk)
                except Damaged:
                    continue
                return offset
        return None

    def _lose(self, start: int, stop: int, why: str, chunk: Record | None) -> None:
        """Say what is lost between two bytes, and of which time."""
        self._part += 1
        when = "" if self._last is None else f", behind {seconds(self._last)}"
        if chunk is not None and len(chunk.content) >= 16:
            first, last = struct.unpack_from("<QQ", chunk.content)
            if first <= last < 1 << 63:
                when = f", the chunk of {seconds(first)} to {seconds(last)}"
        self.lost.append(f"bytes {start} to {stop - 1}{when}: {why}")


def _inner(data: bytes) -> Iterator[tuple[int, bytes]]:
    """Opcode and content of the records in a chunk; raises Damaged."""
    offset = 0
    while offset < len(data):
        opcode, content, offset = record_at(data, offset)
        yield opcode, content


@contextmanager
def open_bag(path: Path) -> Iterator[Bag]:
    """Open an MCAP file of anyone; every failure is an InputError that names the file."""
    with reading(path):
        require_fetched(path)
        with open(path, "rb") as stream:
            yield Bag(FileBytes(stream))


def is_of_another(path: Path) -> bool:
    """Whether an MCAP file has messages, and none of them are samples of this program's logs."""
    found = False
    with suppress(InputError), open_bag(path) as bag:
        for message in bag.messages():
            found = True
            if message.schema is not None and message.schema.name in (AXIS_SAMPLE, AXIS_TRUTH):
                return False
    return found


def recover_bag(path: Path, out: Path) -> tuple[str, tuple[str, ...]]:
    """Write all messages that can be read to a whole bag: what was kept, and what was lost.

    Raises InputError where there is none, and where writing fails.
    """
    counts: Counter[str] = Counter()
    first = last = 0
    with open_bag(path) as bag, atomic_writer(out) as stream:
        writer = Writer(stream, compression=CompressionType.ZSTD)
        writer.start()
        schemas: dict[int, int] = {0: 0}
        channels: dict[int, int] = {}
        with at(str(path)):
            for m in bag.messages():
                if m.channel.id not in channels:
                    if m.schema is not None and m.schema.id not in schemas:
                        schemas[m.schema.id] = writer.register_schema(
                            m.schema.name, m.schema.encoding, m.schema.data
                        )
                    channels[m.channel.id] = writer.register_channel(
                        m.channel.topic, m.channel.message_encoding,
                        schemas.get(m.channel.schema_id, 0), m.channel.metadata,
                    )  # fmt: skip
                writer.add_message(
                    channels[m.channel.id], m.log_time, m.data, m.publish_time, m.sequence
                )
                first = m.log_time if not counts else first
                counts[m.channel.topic] += 1
                last = m.log_time
            if not counts:
                why = "; ".join(bag.lost) or "no message"
                raise InputError(f"nothing can be recovered ({why})")
        for metadata in bag.metadata:
            writer.add_metadata(metadata.name, metadata.metadata)
        for a in bag.attachments:
            writer.add_attachment(a.create_time, a.log_time, a.name, a.media_type, a.data)
        writer.finish()
    kept = ", ".join(f"{count} messages on {topic}" for topic, count in counts.items())
    return f"{kept}, {seconds(first)} to {seconds(last)}", tuple(dict.fromkeys(bag.lost))
