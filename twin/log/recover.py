"""Recover a damaged log: every stretch of samples that a checksum proves, without a gap in it."""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from mcap.opcode import Opcode
from mcap.records import ChunkIndex, Footer

from twin.errors import InputError, at
from twin.log.assemble import Extras, Run
from twin.log.container import (
    IN_CHUNKS,
    MAGIC,
    RECORD_HEAD,
    Inflation,
    Record,
    has_checksum,
    open_chunk,
    open_mcap,
    reading,
)
from twin.log.decode import Decoder, read_strictly
from twin.log.layout import Block
from twin.log.log import Log
from twin.log.scan import FoundChunk, FoundChunks
from twin.log.series import seconds
from twin.log.topics import Topics

_OPCODES = frozenset(Opcode)
METADATA = "the metadata (experiment, seed, source) has no checksum of its own"
_DATA_END = RECORD_HEAD.pack(Opcode.DATA_END, 4)
_FOOTER_BYTES = RECORD_HEAD.size + 20


@dataclass(frozen=True)
class Recovery:
    """What was kept of a log, and one sentence for each loss (none: the log was intact).

    unproved: what was kept although no checksum proves it, one sentence each. others: the stretches
    of samples that a gap separates from the longest one, in the order of time.
    """

    kept: str
    lost: tuple[str, ...]
    unproved: tuple[str, ...] = ()
    others: tuple[Log, ...] = ()

    def __str__(self) -> str:
        lost = self.lost or ("nothing was lost",)
        return "\n".join((f"kept {self.kept}", *(f"not proved: {u}" for u in self.unproved), *lost))


def recover_log(path: str | Path, *, unproved: bool = False) -> tuple[Log, Recovery]:
    """Read the longest series of intact chunks without a gap between them, and all others.

    Samples are kept only where a checksum proves them, or, where ``unproved`` is asked for, where
    nothing speaks against them. Metadata has no checksum of its own; where it contradicts the
    chunks it is ignored. Raises InputError where nothing is left.
    """
    path = Path(path)
    try:
        log = read_strictly(path)
    except InputError as error:
        reason = str(error).removeprefix(f"{path}: ")
    else:
        doubt = _doubt(path)
        if doubt and not unproved:
            raise InputError(f"{path}: {doubt[0]}; it can be read as it is, or with --unproved")
        return log, Recovery(f"all {len(log)} samples", (), doubt)
    with reading(path):
        return _Salvage(path.read_bytes(), reason, unproved).result()


def _doubt(path: Path) -> tuple[str, ...]:
    """Why nothing proves the samples of a log in which no fault was found."""
    with open_mcap(path) as file:
        records = file.records()
        opcodes = {r.opcode for r in records if r.opcode != Opcode.CHUNK or not has_checksum(r)}
        if file.checked or not opcodes & {Opcode.CHUNK, Opcode.MESSAGE}:
            return ()
    return ("the log has no checksums that prove its samples",)


@dataclass(frozen=True)
class _Part:
    """The samples of one chunk, or of the messages outside chunks."""

    place: str
    data: bytes
    blocks: list[Block]

    @property
    def start(self) -> tuple[int, int]:
        """Time in ns and number of its first sample."""
        return min((int(b.log_time[0]), int(b.sequence[0])) for b in self.blocks)

    @property
    def span(self) -> tuple[int, int]:
        """Times of its first and last message, ns."""
        return self.start[0], max(int(b.log_time[-1]) for b in self.blocks)


class _Salvage:
    """What can be had from the bytes of a damaged log."""

    def __init__(self, data: bytes, reason: str, unproved: bool) -> None:
        self._data = data
        self._wanted = unproved
        self._lost = [reason]
        self._unproved: list[str] = []
        self._extras = Extras()
        self._topics = Topics()
        self._decoder = Decoder(self._topics)
        self._announced: list[ChunkIndex] = []
        self._loose = bytearray()  # schemas, channels and messages outside chunks
        self._chunks = FoundChunks(data)
        self._damaged: set[int] = set()  # places of chunks that were found damaged
        self._register_summary()
        self._parts = self._sorted(list(self._read()))

    def result(self) -> tuple[Log, Recovery]:
        """The longest series and the others; raises InputError where there is none."""
        runs = self._runs()
        self._report_absent_chunks()
        counts = [self._count(run) for run in runs]
        if not any(counts):
            hint = "" if self._wanted or not self._unproved else "; read it with --unproved"
            lost = "; ".join(dict.fromkeys([*self._lost, *self._unproved]))
            raise InputError(f"nothing can be recovered ({lost}){hint}")
        # the rate is stated in every chunk too, and there a checksum protects it
        self._extras.metadata.pop("sample_rate_hz", None)
        longest = counts.index(max(counts))
        log, kept = self._log(runs[longest], counts[longest])
        others = list(self._others(runs, counts, longest))
        lost = self._lost if self._wanted else [*self._lost, *self._unproved]
        unproved = [METADATA] if self._extras.metadata else []
        unproved += self._unproved if self._wanted else []
        recovery = Recovery(
            kept, tuple(dict.fromkeys(lost)), tuple(dict.fromkeys(unproved)), tuple(others)
        )
        return log, recovery

    def _log(self, run: Run, count: int) -> tuple[Log, str]:
        kept = f"{count} samples from {seconds(run.start())}"
        metadata = {**self._extras.metadata, "recovered": kept}
        if self._wanted and self._unproved:
            metadata["not_proved"] = "; ".join(self._unproved)
        return run.trimmed_log(Extras(metadata, self._extras.attachments)), kept

    def _others(self, runs: list[Run], counts: list[int], longest: int) -> Iterator[Log]:
        for i, (run, count) in enumerate(zip(runs, counts, strict=True)):
            if i == longest or not count:
                continue
            start = seconds(run.start())
            try:
                yield self._log(run, count)[0]
            except InputError as error:
                self._lost.append(f"{count} samples from {start}: {error}")
                continue
            self._lost.append(
                f"{count} intact samples from {start} are in a log of their own: a gap separates "
                "them from the longer run"
            )

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
                self._topics.register(record.opcode, record.content)
            offset = record.end

    def _read(self) -> Iterator[_Part]:
        """Samples in the order of the file, and along the way metadata and attachments."""
        for chunk in self._walk():
            place = f"chunk at byte {chunk.offset}"
            if not chunk.length_holds:
                self._lost.append(
                    f"bytes {chunk.offset} to {chunk.offset + RECORD_HEAD.size - 1}: the length of "
                    "a chunk is unreadable; its samples are intact"
                )
            if not chunk.proved:
                self._unproved.append(f"{place}: has no checksum that proves its samples")
                if not self._wanted:
                    continue
            yield from self._part(place, chunk.data)
        if not self._loose:
            return
        parts = list(self._part("messages outside chunks", bytes(self._loose)))
        if any(p.blocks for p in parts):
            self._unproved.append("messages outside chunks: no checksum proves their samples")
            yield from parts if self._wanted else ()

    def _part(self, place: str, data: bytes) -> Iterator[_Part]:
        try:
            with at(place):
                blocks = [b for b in self._decoder.blocks(data) if len(b.log_time)]
        except InputError as error:
            self._lost.append(str(error))
            return
        if blocks:
            yield _Part(place, data, blocks)

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
                self._lost.append(f"bytes {offset} to {len(data) - 1}: cut off or unreadable")
                return
            else:
                self._lost.append(f"bytes {previous} to {following.offset - 1}: unreadable")
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
                self._damaged.add(record.offset)
                open_chunk(record, budget)
            elif record.opcode in IN_CHUNKS:
                self._loose += RECORD_HEAD.pack(record.opcode, len(record.content))
                self._loose += record.content
            elif record.opcode == Opcode.CHUNK_INDEX:
                self._announced.append(record.parsed(ChunkIndex))
            else:
                self._extras.add(record)
        except InputError as error:
            self._lost.append(str(error))

    def _sorted(self, parts: list[_Part]) -> list[_Part]:
        """In the order of time, each once."""
        seen: dict[bytes, str] = {}
        once = []
        for part in parts:
            if (first := seen.setdefault(part.data, part.place)) != part.place:
                self._lost.append(f"a copy of the {first} is left out (the {part.place})")
            else:
                once.append(part)
        ordered = sorted(once, key=lambda p: p.start)
        if [p.place for p in ordered] != [p.place for p in once]:
            self._lost.append("chunks were out of order; they are sorted by time")
        return ordered

    def _runs(self) -> list[Run]:
        """The samples in stretches without a gap."""
        runs: list[Run] = []
        losses = -1  # how many were known when the last samples were taken
        for part in self._parts:
            try:
                for block in part.blocks if runs else ():
                    runs[-1].append(block)
                if runs:
                    continue
            except InputError as error:
                if len(self._lost) == losses:  # no damage was seen where the gap is
                    self._lost.append(f"{part.place}: {error}")
            runs.append(Run(self._topics, None, {}))
            try:
                for block in part.blocks:
                    runs[-1].append(block)
            except InputError as error:
                self._lost.append(f"{part.place}: {error}")
        return runs

    def _report_absent_chunks(self) -> None:
        """Chunks of the summary that were not found at all, not even damaged."""
        there = {p.span for p in self._parts}
        for index in self._announced:
            span = (index.message_start_time, index.message_end_time)
            if span not in there and index.chunk_start_offset not in self._damaged:
                self._lost.append(
                    f"the chunk of samples from {seconds(span[0])} to {seconds(span[1])} that the "
                    "summary announces is not there"
                )

    def _count(self, run: Run) -> int:
        try:
            return run.common_count()
        except InputError as error:
            self._lost.append(str(error))
            return 0


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
