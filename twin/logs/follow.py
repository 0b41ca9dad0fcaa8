"""A log that is still being written: its samples as they come, in windows of one length."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np
from mcap.opcode import Opcode

from twin.errors import InputError
from twin.logs.container import (
    IN_CHUNKS,
    MAGIC,
    RECORD_HEAD,
    Damaged,
    Inflation,
    Record,
    open_chunk,
)
from twin.logs.decode import Extras, assembled
from twin.logs.log import Array, Log
from twin.logs.topics import MessageBlock, Series, Topic, Topics

LARGEST_RECORD = 1 << 28  # bytes; a length beyond is none


@dataclass
class _Stretch:
    """The samples of a topic that no window has had yet, from a time (ns) on."""

    series: Series
    start: int
    columns: dict[str, Array]

    def take(self, count: int) -> dict[str, Array]:
        """The first ones, which are held no longer."""
        out = {name: column[:count] for name, column in self.columns.items()}
        self.columns = {name: column[count:].copy() for name, column in self.columns.items()}
        self.start += round(count * 1e9 / self.series.rate)
        return out

    def __len__(self) -> int:
        return len(next(iter(self.columns.values()), ()))


class Incoming:
    """The samples of all topics of a log as they come. Only what no window has had yet is held."""

    def __init__(self, fields: Sequence[str] | None = None) -> None:
        self.topics, self.extras = Topics(), Extras()
        self._fields = fields
        self._held: dict[int, _Stretch] = {}

    def take(self, data: bytes) -> None:
        """The records of a chunk. Raises InputError where they do not follow those before.

        Then what is held is dropped, and what comes next is a beginning.
        """
        try:
            for block in self.topics.blocks(data):
                self._append(block)
        except InputError:
            self.drop()
            raise

    def drop(self) -> None:
        """Hold nothing of what was there."""
        self._held.clear()

    def _append(self, block: MessageBlock) -> None:
        topic = self.topics.topic(block.channel)
        if topic is None or topic.is_truth:
            return
        held = self._held.get(block.channel)
        if held is None:
            held = _Stretch(Series(topic, 0, self._fields), int(block.log_time[0]), {})
            self._held[block.channel] = held
        held.series.append(block)
        new = held.series.taken()
        held.columns = {n: np.concatenate([held.columns.get(n, c[:0]), c]) for n, c in new.items()}

    def whole(self, length: float) -> Iterator[tuple[float, Log]]:
        """The windows of a length (s) of which all topics have all samples, with their times."""
        expected = [c for c in self.topics.channels if self._is_wanted(c)]
        while self._held and all(c in self._held for c in expected):
            start = max(held.start for held in self._held.values())
            for held in self._held.values():  # behind a gap not all begin at once
                held.take(round((start - held.start) * 1e-9 * held.series.rate))
            counts = {c: round(length * h.series.rate) for c, h in self._held.items()}
            if any(len(self._held[c]) < count for c, count in counts.items()):
                return
            parts = [(h.series.topic, h.take(counts[c])) for c, h in sorted(self._held.items())]
            rate = next(iter(self._held.values())).series.rate
            yield start * 1e-9, assembled(parts, rate, self.extras)

    def _is_wanted(self, channel: int) -> bool:
        topic: Topic | None = self.topics.topic(channel)
        return topic is not None and not topic.is_truth


class Follower:
    """Follows a file whose writer appends to it.

    told: what was lost on the way, a line each: a torn chunk, a gap, a clock that jumps, a writer
    that begins anew. ended: whether the writer has closed the file.
    """

    def __init__(self, path: Path, fields: Sequence[str] | None = None) -> None:
        self.path, self.fields = path, fields
        self.told: list[str] = []
        self._begin(None)

    def _begin(self, file: tuple[int, int] | None) -> None:
        self._file, self._offset, self.ended = file, len(MAGIC), False
        self._incoming = Incoming(self.fields)

    def windows(self, length: float) -> Iterator[tuple[float, Log]]:
        """The whole windows of a length (s) that are there by now, each with its time in s.

        Raises InputError where the file is no log, or goes on in no way that can be read.
        """
        try:
            with self.path.open("rb") as stream:
                self._look(stream)
                for record in self._records(stream):
                    self._take(record)
                    yield from self._incoming.whole(length)
        except FileNotFoundError:
            return  # its writer has not begun, or begins anew

    def close(self) -> None:
        """Nothing is open between two looks."""

    def _look(self, stream: BinaryIO) -> None:
        """Whether it is the file that was followed."""
        about = os.fstat(stream.fileno())
        file = (about.st_dev, about.st_ino)
        least = self._offset if self._offset > len(MAGIC) else 0  # which a new file does not have
        if self._file is not None and (file != self._file or about.st_size < least):
            self.told.append(f"{self.path}: its writer begins anew")
            self._file = None
        if self._file is None:
            self._begin(file)
        if stream.read(len(MAGIC)) not in (MAGIC, b""):
            raise InputError(f"{self.path}: not an MCAP file (wrong magic in bytes 0 to 7)")

    def _records(self, stream: BinaryIO) -> Iterator[Record]:
        """The records that are whole by now."""
        while not self.ended:
            stream.seek(self._offset)
            head = stream.read(RECORD_HEAD.size)
            if len(head) < RECORD_HEAD.size:
                return
            opcode, length = RECORD_HEAD.unpack(head)
            if length > LARGEST_RECORD:
                raise Damaged(
                    f"{self.path}: the record at byte {self._offset} claims {length} bytes; keep "
                    "what is intact with: twin recover"
                )
            content = stream.read(length)
            if len(content) < length:
                return
            record = Record(opcode, self._offset, content)
            self._offset = record.end
            yield record

    def _take(self, record: Record) -> None:
        if record.opcode in IN_CHUNKS:
            self._incoming.topics.register(record.opcode, record.content)
        elif record.opcode == Opcode.METADATA:
            self._incoming.extras.add(record)
        elif record.opcode == Opcode.DATA_END:
            self.ended = True
        elif record.opcode == Opcode.CHUNK:
            try:
                self._incoming.take(open_chunk(record, Inflation(len(record.content)))[0])
            except InputError as error:
                self.told.append(f"{self.path}: {error}; what was held of it is left out")
                self._incoming.drop()
