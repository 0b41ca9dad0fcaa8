"""What can be had from the bytes of a damaged log: chunks, loose messages, metadata."""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from dataclasses import dataclass

from mcap.opcode import Opcode
from mcap.records import ChunkIndex, Footer

from twin.errors import InputError, at
from twin.log import chunks
from twin.log.assemble import Extras
from twin.log.chunks import Inflation, open_chunk
from twin.log.container import IN_CHUNKS, MAGIC, RECORD_HEAD, Record
from twin.log.decode import Decoder
from twin.log.layout import Block
from twin.log.scan import FoundChunk, FoundChunks
from twin.log.topics import Topics

_OPCODES = frozenset(Opcode)
_DATA_END = RECORD_HEAD.pack(Opcode.DATA_END, 4)
_FOOTER_BYTES = RECORD_HEAD.size + 20


@dataclass(frozen=True)
class Part:
    """The samples of a chunk, or of messages outside chunks; losses: how many were known then."""

    place: str
    data: bytes
    blocks: list[Block]
    losses: int

    @property
    def start(self) -> tuple[int, int]:
        """Time in ns and number of its first sample."""
        return min((int(b.log_time[0]), int(b.sequence[0])) for b in self.blocks)

    @property
    def span(self) -> tuple[int, int]:
        """Times of its first and last message, ns."""
        return self.start[0], max(int(b.log_time[-1]) for b in self.blocks)


class Salvage:
    """One pass over the bytes of a damaged log.

    lost: one sentence for each damage; unproved: one for what no checksum proves, which is taken
    where ``keep_unproved``. announced: chunks of the summary; damaged: places of those found so.
    """

    def __init__(self, data: bytes, reason: str, keep_unproved: bool) -> None:
        self.lost = [reason]
        self.unproved: list[str] = []
        self.extras = Extras()
        self.topics = Topics()
        self.announced: list[ChunkIndex] = []
        self.damaged: set[int] = set()
        self._data = data
        self._keep_unproved = keep_unproved
        self._decoder = Decoder(self.topics)
        self._loose: dict[int, bytearray] = {}  # place -> definitions and messages outside chunks
        self._chunks = FoundChunks(data)
        self._register_summary()

    def parts(self) -> Iterator[Part]:
        """Samples in the order of the file, and along the way metadata and attachments."""
        for chunk in self._walk():
            place = f"chunk at byte {chunk.offset}"
            if not chunk.length_holds:
                self.lost.append(
                    f"bytes {chunk.offset} to {chunk.offset + RECORD_HEAD.size - 1}: the length of "
                    "a chunk is unreadable; its samples are intact"
                )
            if not chunk.proved:
                self.unproved.append(f"{place}: has no checksum that proves its samples")
                if not self._keep_unproved:
                    continue
            yield from self._part(place, chunk.data)
        for start, batch in self._loose.items():
            for part in self._part(f"messages from byte {start}", bytes(batch)):
                self.unproved.append(f"{part.place}: no checksum proves their samples")
                if self._keep_unproved:
                    yield part

    def _part(self, place: str, data: bytes) -> Iterator[Part]:
        try:
            with at(place):
                blocks = [b for b in self._decoder.blocks(data) if len(b.log_time)]
        except InputError as error:
            self.lost.append(str(error))
            return
        if blocks:
            yield Part(place, data, blocks, len(self.lost))

    def _walk(self) -> Iterator[FoundChunk]:
        """Chunks in the order of the file; behind unreadable bytes, from the next one on."""
        data, previous, offset = self._data, len(MAGIC), len(MAGIC)
        budget = Inflation(len(data))
        while offset < len(data) and data[offset:] != MAGIC:
            chunk = self._chunks.at(offset)
            if chunk is not None:
                yield chunk
                previous = offset = chunk.end
                continue
            record = _record_at(data, offset)
            following = self._chunks.next(previous)
            if record is not None and not self._hides(record, following):
                self._take(record, budget)
                previous, offset = offset, record.end
            elif following is None:
                self.lost.append(f"bytes {offset} to {len(data) - 1}: cut off or unreadable")
                return
            else:
                self.lost.append(f"bytes {previous} to {following.offset - 1}: unreadable")
                previous = offset = following.offset

    def _hides(self, record: Record, following: FoundChunk | None) -> bool:
        """Whether a record reaches over a chunk because its length is damaged."""
        if following is None or following.offset >= record.end:
            return False
        return record.opcode != Opcode.ATTACHMENT or not _attachment_holds(record)

    def _take(self, record: Record, budget: Inflation) -> None:
        """Take metadata, an attachment, or a message outside the chunks."""
        try:
            if record.opcode == Opcode.CHUNK:
                self.damaged.add(record.offset)
                open_chunk(record, budget)
            elif record.opcode in IN_CHUNKS:
                self._add_loose(record)
            elif record.opcode == Opcode.CHUNK_INDEX:
                self.announced.append(record.parsed(ChunkIndex))
            else:
                self.extras.add(record)
        except InputError as error:
            self.lost.append(str(error))

    def _add_loose(self, record: Record) -> None:
        batch = next(reversed(self._loose.values()), None)
        if batch is None or len(batch) >= chunks.LOOSE_BYTES:
            batch = self._loose[record.offset] = bytearray()
        batch += RECORD_HEAD.pack(record.opcode, len(record.content)) + record.content

    def _register_summary(self) -> None:
        """Take schemas and channels from the summary, where its checksum holds."""
        data, footer_at = self._data, len(self._data) - len(MAGIC) - _FOOTER_BYTES
        record = _record_at(data, footer_at) if footer_at > 0 else None
        if record is None or record.opcode != Opcode.FOOTER or len(record.content) != 20:
            return
        footer = record.parsed(Footer)
        # Where bytes are gone or too many, the summary is not where the footer says.
        after_data = data.rfind(_DATA_END, 0, footer_at) + len(_DATA_END) + 4
        for start in (footer.summary_start, after_data):
            if (
                footer.summary_crc
                and zlib.crc32(data[start : record.end - 4]) == footer.summary_crc
            ):
                self._register(start, footer_at)
                return

    def _register(self, offset: int, end: int) -> None:
        while offset < end and (record := _record_at(self._data, offset)):
            if record.opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                self.topics.register(record.opcode, record.content)
            offset = record.end


def _record_at(data: bytes, offset: int) -> Record | None:
    start = offset + RECORD_HEAD.size
    if start > len(data):
        return None
    opcode, length = RECORD_HEAD.unpack_from(data, offset)
    if opcode not in _OPCODES or length > len(data) - start:
        return None
    return Record(opcode, offset, data[start : start + length])


def _attachment_holds(record: Record) -> bool:
    """Whether its checksum proves an attachment; it may hold a log, with chunks of its own."""
    content = record.content
    return zlib.crc32(content[:-4]) == int.from_bytes(content[-4:], "little")
