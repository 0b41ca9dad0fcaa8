"""What can be had from the bytes of a damaged log: chunks, loose messages, metadata."""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

from mcap.opcode import Opcode
from mcap.records import ChunkIndex, Footer

from twin.errors import InputError, at
from twin.logs import container
from twin.logs.assemble import Extras
from twin.logs.container import (
    IN_CHUNKS,
    MAGIC,
    RECORD_HEAD,
    FileBytes,
    Inflation,
    Record,
    open_chunk,
)
from twin.logs.decode import Decoder
from twin.logs.layout import Block
from twin.logs.scan import FoundChunk, found_chunks
from twin.logs.topics import Topics

_OPCODES = frozenset(Opcode)
_DATA_END = RECORD_HEAD.pack(Opcode.DATA_END, 4)
_TAKEN = (Opcode.CHUNK, Opcode.CHUNK_INDEX, Opcode.METADATA, Opcode.ATTACHMENT)
_FOOTER_BYTES = RECORD_HEAD.size + 20
_KEPT_CONTENTS = 2  # decompressed at a time, as several topics may lie in one chunk

Stored = FoundChunk | tuple[tuple[int, int], ...]
"""Where samples lie in the file: a chunk, or stretches of definitions and messages outside them."""


@dataclass(frozen=True)
class Part:
    """The samples of a chunk, or of messages outside chunks.

    start: time in ns and number of the first sample; end: time of the last. identity: the same for
    a copy. losses: how many were known when it was found.
    """

    place: str
    stored: Stored
    start: tuple[int, int]
    end: int
    identity: tuple[int, ...]
    losses: int

    @property
    def span(self) -> tuple[int, int]:
        """Times of its first and last message, ns."""
        return self.start[0], self.end


class Salvage:
    """One pass over the bytes of a damaged log, which keeps no sample, but where they are.

    lost: one sentence for each damage; unproved: one for what no checksum proves, which is taken
    where ``keep_unproved``. announced: place and times (ns) of the chunks in the summary. damaged:
    places of those found so.
    """

    def __init__(self, file: FileBytes, reason: str, keep_unproved: bool) -> None:
        self.lost = [reason]
        self.unproved: list[str] = []
        self.extras = Extras()
        self.topics = Topics()
        self.announced: list[tuple[int, tuple[int, int]]] = []
        self.damaged: set[int] = set()
        self._file = file
        self._keep_unproved = keep_unproved
        self._decoder = Decoder(self.topics)
        self._loose: list[list[tuple[int, int]]] = []  # places, in batches
        self._content = lru_cache(_KEPT_CONTENTS)(self._read)
        self._register_summary()

    def parts(self) -> Iterator[Part]:
        """Samples in the order of the file, and along the way metadata and attachments."""
        for chunk, content in self._walk():
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
            yield from self._part(place, chunk, content)
        for batch in self._loose:
            place, stored = f"messages from byte {batch[0][0]}", tuple(batch)
            for part in self._part(place, stored, self._read(stored)):
                self.unproved.append(f"{part.place}: no checksum proves their samples")
                if self._keep_unproved:
                    yield part

    def blocks(self, part: Part) -> list[Block]:
        """The samples of a part, read from the file again."""
        return [b for b in self._decoder.blocks(self._content(part.stored)) if len(b.log_time)]

    def _read(self, stored: Stored) -> bytes:
        if isinstance(stored, FoundChunk):
            return stored.content(self._file)
        return b"".join(self._file.part(start, end) for start, end in stored)

    def _part(self, place: str, stored: Stored, content: bytes) -> Iterator[Part]:
        try:
            with at(place):
                blocks = [b for b in self._decoder.blocks(content) if len(b.log_time)]
        except InputError as error:
            self.lost.append(str(error))
            return
        if blocks:
            start = min((int(b.log_time[0]), int(b.sequence[0])) for b in blocks)
            end = max(int(b.log_time[-1]) for b in blocks)
            crc = stored.crc if isinstance(stored, FoundChunk) else 0
            identity = (*start, end, len(content), crc or zlib.crc32(content))
            yield Part(place, stored, start, end, identity, len(self.lost))

    def _walk(self) -> Iterator[tuple[FoundChunk, bytes]]:
        """Chunks in the order of the file; behind unreadable bytes, from the next one on."""
        file, previous, offset = self._file, len(MAGIC), len(MAGIC)
        budget, found = Inflation(len(file)), found_chunks(file)
        following = next(found, None)
        while offset < len(file) and not self._ends(offset):
            while following is not None and following[0].offset < offset:
                following = next(found, None)
            if following is not None and following[0].offset == offset:
                yield following
                previous = offset = following[0].end
                continue
            end = _record_end(file, offset)
            if end is not None and not self._hides(offset, end, following and following[0]):
                self._take(offset, end, budget)
                previous, offset = offset, end
            elif following is None:
                self.lost.append(f"bytes {offset} to {len(file) - 1}: cut off or unreadable")
                return
            else:
                self.lost.append(f"bytes {previous} to {following[0].offset - 1}: unreadable")
                previous = offset = following[0].offset

    def _ends(self, offset: int) -> bool:
        return (
            offset == len(self._file) - len(MAGIC) and self._file.part(offset, offset + 8) == MAGIC
        )

    def _hides(self, offset: int, end: int, following: FoundChunk | None) -> bool:
        """Whether a record reaches over a chunk because its length is damaged.

        An attachment whose checksum holds may be a log, with chunks of its own.
        """
        if following is None or following.offset >= end:
            return False
        if self._file.part(offset, offset + 1)[0] != Opcode.ATTACHMENT:
            return True
        crc = self._file.checksum(offset + RECORD_HEAD.size, end - 4)
        return crc != int.from_bytes(self._file.part(end - 4, end), "little")

    def _take(self, offset: int, end: int, budget: Inflation) -> None:
        """Take metadata, an attachment, or a message outside the chunks."""
        opcode = self._file.part(offset, offset + 1)[0]
        if opcode in IN_CHUNKS:
            self._add_loose(offset, end)
        elif opcode in _TAKEN:
            try:
                self._take_record(_record(self._file, offset, end), budget)
            except InputError as error:
                self.lost.append(str(error))

    def _take_record(self, record: Record, budget: Inflation) -> None:
        if record.opcode == Opcode.CHUNK:
            self.damaged.add(record.offset)
            open_chunk(record, budget)
        elif record.opcode == Opcode.CHUNK_INDEX:
            index = record.parsed(ChunkIndex)
            span = (index.message_start_time, index.message_end_time)
            self.announced.append((index.chunk_start_offset, span))
        else:
            self.extras.add(record)

    def _add_loose(self, offset: int, end: int) -> None:
        """Remember where it is; records side by side are one place."""
        batch = self._loose[-1] if self._loose else None
        if batch is None or sum(b - a for a, b in batch) >= container.LOOSE_BYTES:
            batch = []
            self._loose.append(batch)
        if batch and batch[-1][1] == offset:
            batch[-1] = (batch[-1][0], end)
        else:
            batch.append((offset, end))

    def _register_summary(self) -> None:
        """Take schemas and channels from the summary, where its checksum holds."""
        file, footer_at = self._file, len(self._file) - len(MAGIC) - _FOOTER_BYTES
        end = _record_end(file, footer_at) if footer_at > 0 else None
        if end != footer_at + _FOOTER_BYTES:
            return
        record = _record(file, footer_at, end)
        if record.opcode != Opcode.FOOTER:
            return
        footer = record.parsed(Footer)
        if not footer.summary_crc:
            return
        # Where bytes are gone or too many, the summary is not where the footer says.
        data_end = file.last(_DATA_END, footer_at)
        starts = [footer.summary_start]
        starts += [] if data_end is None else [data_end + len(_DATA_END) + 4]
        for start in starts:
            if file.checksum(start, end - 4) == footer.summary_crc:
                self._register(start, footer_at)
                return

    def _register(self, offset: int, stop: int) -> None:
        while offset < stop and (end := _record_end(self._file, offset)):
            record = _record(self._file, offset, end)
            if record.opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                self.topics.register(record.opcode, record.content)
            offset = end


def _record_end(file: FileBytes, offset: int) -> int | None:
    """Where the record at a place ends, if there may be one."""
    head = file.part(offset, offset + RECORD_HEAD.size)
    if len(head) < RECORD_HEAD.size:
        return None
    opcode, length = RECORD_HEAD.unpack(head)
    end = offset + len(head) + length
    return end if opcode in _OPCODES and end <= len(file) else None


def _record(file: FileBytes, offset: int, end: int) -> Record:
    opcode, content = file.part(offset, offset + 1)[0], offset + RECORD_HEAD.size
    return Record(opcode, offset, file.part(content, end))
