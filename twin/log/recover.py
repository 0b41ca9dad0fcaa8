"""Recover a damaged log: the longest intact series of samples without a gap."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from mcap.opcode import Opcode
from mcap.records import ChunkIndex

from twin.errors import InputError, at
from twin.log.assemble import Extras, Run
from twin.log.container import MAGIC, RECORD_HEAD, Payload, Record, payloads, reading
from twin.log.decode import Decoder, read_strictly
from twin.log.log import Log
from twin.log.series import seconds
from twin.log.topics import Topics

_OPCODES = frozenset(Opcode)
_BEFORE_COMPRESSION = RECORD_HEAD.size + 28  # bytes of a chunk record before its compression
_CHUNK_TIMES = struct.Struct("<QQ")  # of its first and last message, ns; a chunk begins with them
_COMPRESSIONS = (b"\x04\0\0\0zstd", b"\x03\0\0\0lz4")


@dataclass(frozen=True)
class Recovery:
    """What was kept of a log, and one sentence for each loss (none: the log was intact)."""

    kept: str
    lost: tuple[str, ...]

    def __str__(self) -> str:
        return "\n".join((f"kept {self.kept}", *(self.lost or ("nothing was lost",))))


def recover_log(path: str | Path) -> tuple[Log, Recovery]:
    """Read the longest series of intact chunks without a gap between them.

    Chunks are kept only where their checksum holds. Metadata has no checksum of its own; where
    it contradicts the chunks it is ignored. Raises InputError where nothing is left.
    """
    path = Path(path)
    try:
        log = read_strictly(path)
    except InputError as error:
        reason = str(error).removeprefix(f"{path}: ")
    else:
        return log, Recovery(f"all {len(log)} samples", ())
    with reading(path):
        salvage = _Salvage(path.read_bytes())
        log = salvage.log()
        return log, Recovery(salvage.kept, tuple(dict.fromkeys([reason, *salvage.lost])))


class _Salvage:
    """One pass over the bytes of a damaged log."""

    def __init__(self, data: bytes) -> None:
        self.lost: list[str] = []
        self.kept = ""
        self._extras = Extras()
        self._topics = Topics()
        self._decoder = Decoder(self._topics)
        self._best = self._run = Run(self._topics, None, {})
        self._found: dict[int, tuple[int, int]] = {}  # place of a chunk -> its times
        self._announced: list[ChunkIndex] = []
        self._losses_before = 0  # how many were known when the last samples were taken
        records = self._records(data)
        while True:
            try:
                for payload in payloads(records, self._add_extra):
                    self._take(payload)
                break
            except InputError as error:  # a damaged chunk: go on with the record after it
                self.lost.append(str(error))
        self._close()
        self._report_absent_chunks()

    def log(self) -> Log:
        """The longest series; raises InputError where it is empty or no valid log."""
        count = self._count(self._best)
        if count == 0:
            raise InputError(f"nothing can be recovered ({'; '.join(self.lost)})")
        # the rate is stated in every chunk too, and there a checksum protects it
        self._extras.metadata.pop("sample_rate_hz", None)
        self.kept = f"{count} samples from {seconds(self._best.start())}"
        self._extras.metadata["recovered"] = self.kept
        return self._best.trimmed_log(self._extras)

    def _add_extra(self, record: Record) -> None:
        try:
            self._extras.add(record)
            if record.opcode == Opcode.CHUNK_INDEX:
                self._announced.append(record.parsed(ChunkIndex))
        except InputError as error:
            self.lost.append(str(error))

    def _take(self, payload: Payload) -> None:
        with at(payload.place):
            blocks = list(self._decoder.blocks(payload.data))
            try:
                for block in blocks:
                    self._run.append(block)
            except InputError as error:
                unexplained = len(self.lost) == self._losses_before
                self._close()
                self._run = Run(self._topics, None, {})
                for block in blocks:
                    self._run.append(block)
                if unexplained:  # no damage was seen where the gap is
                    self.lost.append(f"{payload.place}: {error}")
        self._losses_before = len(self.lost)

    def _report_absent_chunks(self) -> None:
        """Chunks of the summary that were not found at all, not even damaged."""
        times = {(i.message_start_time, i.message_end_time): i for i in self._announced}
        for span, index in times.items():
            instead = self._found.get(index.chunk_start_offset)
            if span in self._found.values() or (instead is not None and instead not in times):
                continue
            self.lost.append(
                f"the chunk of samples from {seconds(span[0])} to {seconds(span[1])} that the "
                "summary announces is not there"
            )

    def _close(self) -> None:
        """Keep the longer of the present series and the best so far, and report the other."""
        best, other = self._best, self._run
        if best is other:
            return
        if self._count(other) > self._count(best):
            best, other = other, best
        if self._count(other):
            self.lost.append(
                f"{self._count(other)} intact samples from {seconds(other.start())} are "
                "left out: a gap separates them from the longer run"
            )
        self._best = best

    def _count(self, run: Run) -> int:
        try:
            return run.common_count()
        except InputError as error:
            self.lost.append(str(error))
            return 0

    def _records(self, data: bytes) -> Iterator[Record]:
        """Records one after the other; behind unreadable bytes, from the next chunk on."""
        previous, offset = 0, len(MAGIC)
        while offset < len(data) and data[offset:] != MAGIC:
            record = _record_at(data, offset)
            if record is not None:
                if record.opcode == Opcode.CHUNK and len(record.content) >= _CHUNK_TIMES.size:
                    first, last = _CHUNK_TIMES.unpack_from(record.content)
                    self._found[offset] = (first, last)
                yield record
                previous, offset = offset, record.end
                continue
            found = _next_chunk(data, previous + 1)
            if found is None:
                self.lost.append(f"bytes {offset} to {len(data) - 1}: cut off or unreadable")
                return
            self.lost.append(f"bytes {previous} to {found - 1}: unreadable")
            previous = offset = found


def _record_at(data: bytes, offset: int) -> Record | None:
    start = offset + RECORD_HEAD.size
    if start > len(data):
        return None
    opcode, length = RECORD_HEAD.unpack_from(data, offset)
    if opcode not in _OPCODES or length > len(data) - start:
        return None
    return Record(opcode, offset, data[start : start + length])


def _next_chunk(data: bytes, start: int) -> int | None:
    """Where the next compressed chunk record may begin; its checksum verifies it."""
    found = (data.find(c, start + _BEFORE_COMPRESSION) for c in _COMPRESSIONS)
    candidates = [f - _BEFORE_COMPRESSION for f in found if f >= 0]
    return min(candidates, default=None)
