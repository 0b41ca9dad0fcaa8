"""Recover a damaged log: every stretch of samples that a checksum proves, without a gap in it.

Every chunk of a log can be read alone, and its messages carry the numbers of their samples. So the
chunks are looked for wherever they lie in the file. A chunk record is opcode u1, length u8, first
and last time u8 each, uncompressed size u8, checksum u4, the name of the compression (u4 and text),
the size of the data u8, and the data. The checksum is that of the decompressed data, so where it
holds, it proves the samples and all that led to them.

Samples stay in the file until they are written or asked for, so that a log of any length can be
recovered.
"""

from __future__ import annotations

import re
import struct
import zlib
from bisect import bisect_right
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from pathlib import Path

import numpy as np
from mcap.opcode import Opcode
from mcap.records import Chunk, ChunkIndex

from twin.errors import InputError, at
from twin.files import is_same_file
from twin.logs.bags import is_of_another, recover_bag
from twin.logs.container import (
    MAGIC,
    RECORD_HEAD,
    Damaged,
    FileBytes,
    Inflation,
    Record,
    decompressed,
    open_chunk,
    open_mcap,
    reading,
)
from twin.logs.decode import EVERYTHING, Extras, assembled, common_rate, log_parts
from twin.logs.log import Array, Log, joined
from twin.logs.topics import (
    MessageBlock,
    Topic,
    Topics,
    require_even,
    require_finite,
    sample_times,
    seconds,
)
from twin.logs.writer import write_parts

GAP = "a gap separates them from the longer run"
METADATA = "the metadata (experiment, seed, source) has no checksum of its own"

_HEAD = struct.Struct("<BQQQQI8sQ")  # of a chunk, up to its data
_ZSTD = b"\x04\0\0\0zstd"
_NAME_AT = _HEAD.size - len(_ZSTD) - 8  # of the compression, in the head
_OPCODES = frozenset(Opcode)
_Kept = tuple[str, Callable[[], Iterator[Log]]]
"""A stretch of samples: what it is, and its logs, which follow each other."""


@dataclass(frozen=True)
class Recovery:
    """What was kept of a log, and one sentence for each loss (none: the log was intact).

    not_proved: what was kept although no checksum proves it, one sentence each. others: the
    stretches of samples that a gap separates from the longest one, in the order of time.
    """

    kept: str
    lost: tuple[str, ...]
    not_proved: tuple[str, ...] = ()
    others: tuple[Log, ...] = ()

    def __str__(self) -> str:
        lost = self.lost or ("nothing was lost",)
        return "\n".join(
            (f"kept {self.kept}", *(f"not proved: {u}" for u in self.not_proved), *lost)
        )


def recover_log(path: str | Path, *, unproved: bool = False) -> tuple[Log, Recovery]:
    """Read the longest series of intact chunks without a gap between them, and all others.

    Samples are kept only where a checksum proves them, or, where ``unproved`` is asked for, where
    nothing speaks against them. Raises InputError where nothing is left.
    """
    with _recovered(Path(path), unproved) as (kept, recovery):
        log, *others = [joined(logs()) for _, logs in kept]
    return log, replace(recovery, others=tuple(others))


def recover_file(
    path: Path, out: Path, *, unproved: bool = False
) -> tuple[Recovery, dict[Path, str]]:
    """Write what ``recover_log`` reads to files, a piece at a time: the longest series to ``out``.

    The others are beside it. Returns the recovery without its logs, and what each file holds.
    Of a bag of another program all messages that can be read are kept, in one file. Raises
    InputError as recover_log does, and where writing fails.
    """
    if is_of_another(path):
        if is_same_file(out, path):
            raise InputError(f"{path}: would be overwritten; give another name than {out}")
        text, lost = recover_bag(path, out)
        return Recovery(text, lost), {out: text}
    with _recovered(path, unproved) as (kept, recovery):
        names = (out.with_name(f"{out.stem}.part{n}{out.suffix}") for n in range(1, len(kept)))
        files = dict(zip((out, *names), kept, strict=True))
        for name in files:
            if is_same_file(name, path):
                raise InputError(f"{path}: would be overwritten; give another name than {out}")
        for name, (_, logs) in files.items():
            write_parts(logs(), name)
    return recovery, {name: text for name, (text, _) in files.items()}


@contextmanager
def _recovered(path: Path, unproved: bool) -> Iterator[tuple[list[_Kept], Recovery]]:
    """What is kept, the longest first; the file stays open until it was read."""
    try:
        count = sum(len(part) for part in _intact(path))
    except InputError as error:
        reason = str(error).removeprefix(f"{path}: ")
    else:
        text = f"all {count} samples"
        yield [(text, lambda: _intact(path))], Recovery(text, ())
        return
    with reading(path):
        stream = open(path, "rb")  # noqa: SIM115
    with stream:
        with reading(path):
            kept, recovery = _Salvage(FileBytes(stream), reason, unproved).result(str(path))
        yield kept, recovery


def _intact(path: Path) -> Iterator[Log]:
    """A log in which no fault is found, in parts; raises InputError."""
    with open_mcap(path) as file:
        # samples of an intact log that are held in memory at a time: some 20 MB
        intact_step = 1 << 17
        yield from log_parts(file, file.records(), EVERYTHING, intact_step)


@dataclass(frozen=True)
class _FoundChunk:
    """A chunk in the file; size, crc: of what it holds; length_holds: whether its record's does."""

    offset: int
    end: int
    size: int
    crc: int
    length_holds: bool

    @property
    def proved(self) -> bool:
        """Whether a checksum says that its records are what was written."""
        return self.crc != 0

    @property
    def place(self) -> str:
        """Where it is."""
        return f"chunk at byte {self.offset}"

    def content(self, file: FileBytes) -> bytes:
        """Its schema, channel and message records, decompressed; raises Damaged."""
        data = file.part(self.offset + _HEAD.size, self.end)
        return decompressed(Chunk("zstd", data, 0, 0, self.crc, self.size))


def _found_chunks(file: FileBytes) -> Iterator[_FoundChunk]:
    """The chunks that can be decompressed and have no wrong checksum, none within a proved one."""
    budget, behind = Inflation(len(file)), 0
    window = 1 << 18  # bytes that are searched at a time
    for place in range(0, len(file), window):
        data = file.part(place, place + window + _HEAD.size)  # with all of a head that begins here
        for name in re.finditer(re.escape(_ZSTD), data[_NAME_AT:-8]):
            offset = place + name.start()
            head = _HEAD.unpack_from(data, name.start())
            if offset >= behind and (found := _opened(file, offset, head, budget)):
                yield found
                behind = found.end if found.proved else found.offset + 1


def _opened(file: FileBytes, offset: int, head: tuple, budget: Inflation) -> _FoundChunk | None:
    """The chunk at a place, by either of the two sizes that it states of its data."""
    _, length, _, _, size, crc, _, inner = head
    start, outer = offset + _HEAD.size, length - (_HEAD.size - RECORD_HEAD.size)
    for stored in dict.fromkeys((inner, outer)):
        least_room = 1 << 12  # bytes: what does not shrink may grow, a little
        if not 0 < stored <= min(len(file) - start, 2 * size + least_room):
            continue
        found = _FoundChunk(offset, start + stored, size, crc, stored == outer)
        try:
            budget.take(size, stored)  # before it is read: what only looks like chunks may be many
            found.content(file)
        except Damaged:
            continue
        return found
    return None


def _instant(topic: Topic, sample: int) -> str:
    return seconds(int(sample_times(sample, 1, topic.sample_rate)[0]))


@dataclass(frozen=True)
class _Piece:
    """Samples number ``first`` to before ``stop`` of a topic, which lie in a chunk."""

    topic: Topic
    first: int
    stop: int
    chunk: _FoundChunk


@dataclass(frozen=True)
class _Stretch:
    """Samples of topics by their numbers; the pieces of each topic hold at least these."""

    pieces: Mapping[str, Sequence[_Piece]]
    samples: range

    def __str__(self) -> str:
        topic = next(iter(self.pieces.values()))[0].topic
        return f"{len(self.samples)} samples from {_instant(topic, self.samples.start)}"

    def empty(self, extras: Extras) -> Log:
        """The log without samples; raises InputError where an axis has too few signals, ..."""
        topics = [pieces[0].topic for pieces in self.pieces.values()]
        for topic in topics:
            topic.require_fields()
        nothing = ((topic, {name: np.empty(0) for name in topic.fields}) for topic in topics)
        return assembled(nothing, common_rate(topics, extras), extras)

    def logs(self, extras: Extras, read: Callable[[_Piece], MessageBlock]) -> Iterator[Log]:
        """Its samples as logs that follow each other; raises InputError as ``empty`` does."""
        rate, every = self.empty(extras).sample_rate, self.pieces.values()
        step = 1 << 15  # the same of a damaged one, whose chunks are held beside them
        for first in self.samples[::step]:
            stop = min(first + step, self.samples.stop)
            columns = ((own[0].topic, _columns(own, first, stop, read)) for own in every)
            yield assembled(columns, rate, extras)


def _columns(
    pieces: Sequence[_Piece], first: int, stop: int, read: Callable[[_Piece], MessageBlock]
) -> dict[str, Array]:
    """Samples number ``first`` to before ``stop`` of one topic."""
    found: dict[str, list[Array]] = {name: [] for name in pieces[0].topic.fields}
    for piece in pieces[bisect_right(pieces, first, key=lambda p: p.stop) :]:
        if piece.first >= stop:
            break
        block = read(piece)
        for name, parts in found.items():
            parts.append(block.columns[name][max(0, first - piece.first) : stop - piece.first])
    return {name: np.concatenate(parts) for name, parts in found.items()}


class _Salvage:
    """What can be had from a log with a fault (``reason``): no samples, but where they are."""

    def __init__(self, file: FileBytes, reason: str, keep_unproved: bool) -> None:
        self._file = file
        self._keep_unproved = keep_unproved
        self._lost = [reason]
        self._unproved: list[str] = []
        self._extras = Extras()
        self._topics = Topics()
        self._announced: dict[int, int] = {}  # ns, of the last sample by channel, by the summary
        self._content = lru_cache(2)(lambda chunk: chunk.content(file))  # decompressed at a time

    def result(self, name: str) -> tuple[list[_Kept], Recovery]:
        """The longest stretch of the file called so and the others; raises InputError for none."""
        stretches = self._stretches(self._by_topic())
        if not stretches:
            unread = self._unproved and not self._keep_unproved
            hint = "; keep what no checksum proves as well (unproved)" * bool(unread)
            why = "; ".join(dict.fromkeys([*self._lost, *self._unproved]))
            raise InputError(f"nothing can be recovered ({why}){hint}")
        # the rate is stated in every chunk too, and there a checksum protects it
        self._extras.metadata.pop("sample_rate_hz", None)
        longest = max(stretches, key=lambda s: len(s.samples) * len(s.pieces))
        longest.empty(self._extras)
        kept, topics = [longest], {topic for s in stretches for topic in s.pieces}
        for stretch in (s for s in stretches if s is not longest):
            absent = ", ".join(sorted(topics - stretch.pieces.keys()))
            why = f"{absent} has no samples there" if absent else GAP
            with self._losing(), at(str(stretch)):
                stretch.empty(self._extras)
                kept.append(stretch)
                said = str(stretch).replace("samples", "intact samples")
                self._lost.append(f"{said} are in a log of their own: {why}")
        unproved = [METADATA] if self._extras.metadata and not self._extras.proved else []
        (unproved if self._keep_unproved else self._lost).extend(self._unproved)
        lost = tuple(dict.fromkeys(self._lost))
        recovery = Recovery(str(longest), lost, tuple(dict.fromkeys(unproved)))
        return [self._kept(stretch, name) for stretch in kept], recovery

    def _kept(self, stretch: _Stretch, name: str) -> _Kept:
        metadata = {**self._extras.metadata, "recovered": str(stretch)}
        if self._keep_unproved and self._unproved:
            metadata["not_proved"] = "; ".join(self._unproved)
        extras = Extras(metadata, self._extras.attachments)

        def logs() -> Iterator[Log]:
            with at(name):
                yield from stretch.logs(extras, self._block)

        return str(stretch), logs

    def _block(self, piece: _Piece) -> MessageBlock:
        """The samples of a piece, read from the file again."""
        blocks = self._topics.blocks(self._content(piece.chunk))
        return next(block for block in blocks if block.channel == piece.topic.layout.channel)

    def _by_topic(self) -> dict[str, list[_Piece]]:
        """The pieces of each topic by their numbers, each once; topics in the order of the file."""
        found: dict[int, list[_Piece]] = {}
        for chunk in self._walk():
            if not chunk.length_holds:
                self._lost.append(
                    f"bytes {chunk.offset} to {chunk.offset + RECORD_HEAD.size - 1}: the length of "
                    "a chunk is unreadable; its samples are intact"
                )
            if not chunk.proved:
                self._unproved.append(f"{chunk.place}: has no checksum that proves its samples")
            if chunk.proved or self._keep_unproved:
                for piece in self._pieces(chunk):
                    found.setdefault(piece.topic.layout.channel, []).append(piece)
        out: dict[str, list[_Piece]] = {}
        for _, pieces in sorted(found.items()):
            name = pieces[0].topic.name
            if name in out:
                self._lost.append(f"{pieces[0].chunk.place}: another channel has the topic {name}")
            else:
                out[name] = self._sorted(pieces)
        return out

    def _pieces(self, chunk: _FoundChunk) -> list[_Piece]:
        """The samples of a chunk, each topic's that are numbered, timed and finite as they must."""
        blocks, pieces = [], []
        with self._losing(), at(chunk.place):
            blocks = self._topics.blocks(self._content(chunk))
        for block in blocks:
            topic, first = self._topics.topic(block.channel), int(block.sequence[0])
            assert topic is not None
            with self._losing(), at(chunk.place):
                require_even(topic, block, first, 0, first)
                for name in topic.fields:
                    require_finite(topic, block, name, first)
                pieces.append(_Piece(topic, first, first + len(block.sequence), chunk))
        return pieces

    @contextmanager
    def _losing(self) -> Iterator[None]:
        """A fault within is noted as a loss of this file, and raised no further."""
        try:
            yield
        except InputError as error:
            self._lost.append(str(error))

    def _sorted(self, pieces: list[_Piece]) -> list[_Piece]:
        """In the order of their numbers, each once, what is proved before what is not."""
        ordered = sorted(pieces, key=lambda p: (p.first, not p.chunk.proved, p.chunk.offset))
        out: list[_Piece] = []
        for piece in ordered:
            if out and piece.first < out[-1].stop:
                self._lost.append(
                    f"a copy of the {out[-1].chunk.place} is left out (the {piece.chunk.place})"
                )
            else:
                out.append(piece)
        if any(one.chunk.offset > other.chunk.offset for one, other in pairwise(out)):
            self._lost.append("chunks were out of order; they are sorted by time")
        return out

    def _stretches(self, pieces: Mapping[str, list[_Piece]]) -> list[_Stretch]:
        """The samples that the same topics have side by side, an axis at least."""
        runs = {name: self._runs(name, own) for name, own in pieces.items()}
        edges = {e for own in runs.values() for run in own for e in (run.start, run.stop)}
        out = []
        for a, b in pairwise(sorted(edges)):
            here = {n: pieces[n] for n, own in runs.items() if any(a in run for run in own)}
            if here and all(own[0].topic.is_truth for own in here.values()):
                self._lost.append(f"{b - a} samples of {', '.join(here)} have no axis beside them")
            elif here:
                out.append(_Stretch(here, range(a, b)))
        return out

    def _runs(self, name: str, pieces: Sequence[_Piece]) -> list[range]:
        """The numbers of samples that follow each other without a gap."""
        topic, runs, stop = pieces[0].topic, [range(0)], 0
        announced = self._announced.get(topic.layout.channel, -1e9)
        end = round(announced * 1e-9 * topic.sample_rate) + 1
        for first, last in [*((p.first, p.stop) for p in pieces), (max(end, 0), 0)]:
            if first > stop:
                self._lost.append(
                    f"{name}: {first - stop} samples are missing, from {_instant(topic, stop)} to "
                    f"{_instant(topic, first)}"
                )
                runs.append(range(first, first))
            stop = max(stop, last)
            runs[-1] = range(runs[-1].start, max(stop, runs[-1].stop))
        return [run for run in runs if run]

    def _walk(self) -> Iterator[_FoundChunk]:
        """Chunks in the order of the file; what lies between them is taken record by record."""
        offset, budget = len(MAGIC), Inflation(len(self._file))
        for chunk in _found_chunks(self._file):
            if chunk.offset >= offset:
                offset = self._between(offset, chunk, budget)
            if chunk.offset == offset:
                yield chunk
                offset = chunk.end
        self._between(offset, None, budget)

    def _between(self, offset: int, following: _FoundChunk | None, budget: Inflation) -> int:
        """Take the records up to the next chunk, or to the end; returns where the last one ends."""
        last, stop = offset, len(self._file) if following is None else following.offset
        while offset < stop:
            if offset == len(self._file) - len(MAGIC) and self._file.part(offset, stop) == MAGIC:
                return stop
            end = self._end(offset, following)
            if end is None:
                place, why = (last, "") if following else (offset, "cut off or ")
                self._lost.append(f"bytes {place} to {stop - 1}: {why}unreadable")
                return stop
            self._take(offset, end, budget)
            last, offset = offset, end
        return offset

    def _end(self, offset: int, following: _FoundChunk | None) -> int | None:
        """Where the record at a place ends, if there is one."""
        start = offset + RECORD_HEAD.size
        head = self._file.part(offset, start)
        if len(head) < RECORD_HEAD.size:
            return None
        opcode, length = RECORD_HEAD.unpack(head)
        end = start + length
        if opcode not in _OPCODES or end > len(self._file):
            return None
        # A chunk in it: its length is damaged, unless it is an attachment that holds a log.
        if following is not None and following.offset < end:
            content = self._file.part(start, end) if opcode == Opcode.ATTACHMENT else b""
            if zlib.crc32(content[:-4]) != int.from_bytes(content[-4:], "little") or not content:
                return None
        return end

    def _take(self, offset: int, end: int, budget: Inflation) -> None:
        """Take metadata or an attachment; say what is wrong with a chunk that was not found."""
        opcode = self._file.part(offset, offset + 1)[0]
        if opcode not in (Opcode.CHUNK, Opcode.CHUNK_INDEX, Opcode.METADATA, Opcode.ATTACHMENT):
            return
        record = Record(opcode, offset, self._file.part(offset + RECORD_HEAD.size, end))
        with self._losing():
            if opcode == Opcode.CHUNK:
                open_chunk(record, budget)
            elif opcode == Opcode.CHUNK_INDEX:
                index = record.parsed(ChunkIndex)
                for channel in index.message_index_offsets:
                    ends = self._announced.get(channel, 0), index.message_end_time
                    self._announced[channel] = max(ends)
            else:
                self._extras.add(record)
