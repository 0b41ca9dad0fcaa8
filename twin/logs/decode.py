"""MCAP -> Log, strictly: every fault is one InputError that names file, place and remedy."""

from __future__ import annotations

import math
import struct
from collections import Counter
from collections.abc import Container, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

from mcap.opcode import Opcode

from twin.errors import InputError, at
from twin.logs.assemble import EVERYTHING, Extras, Run, Wanted
from twin.logs.container import (
    IN_CHUNKS,
    RECORD_HEAD,
    Damaged,
    Inflation,
    McapFile,
    Record,
    open_mcap,
    payloads,
)
from twin.logs.layout import Block, MessageLayout, RowLayout
from twin.logs.log import Log
from twin.logs.schema import segments_of
from twin.logs.topics import AXIS_PREFIX, Topics

MOST_DEFINITIONS = 100_000  # of schemas and channels in a chunk; there are 65535 of each
_MESSAGE_HEAD = struct.Struct("<HIQQ")  # channel, sequence, log time, publish time


def read_log(
    path: str | Path,
    axes: Sequence[str] | None = None,
    *,
    fields: Sequence[str] | None = None,
    truth: bool = True,
    start: float | None = None,
    stop: float | None = None,
) -> Log:
    """Read an MCAP log, or of it what is asked for.

    axes, fields: by name, None for all. truth: whether the simulator's truth is read too, which
    takes more than half of the memory. start, stop: times in s of the log; the first sample is the
    first from ``start`` on. Of a log with an index only the chunks with what is asked for are read.

    Every checksum of these is verified, and the samples must be complete, evenly spaced and finite.
    Raises InputError otherwise, and where no axis has position and one of current and force.
    """
    wanted = Wanted(axes, fields, truth)
    with _remedied(path):
        if start is None and stop is None:
            return read_strictly(Path(path), wanted)
        return read_between(Path(path), wanted, start or 0.0, math.inf if stop is None else stop)


def read_parts(
    path: str | Path, samples: int, *, fields: Sequence[str] | None = None
) -> Iterator[Log]:
    """The same log without truth in parts of ``samples`` or a few more, one after the other.

    So that a long one need not be held in memory. Raises InputError as read_log does. A log that
    does not state its sample rate, that has no statistics, or whose topics do not lie side by side,
    is one part.
    """
    wanted = Wanted(None, fields, truth=False)
    with _remedied(path), open_mcap(Path(path)) as file:
        yield from log_parts(file, file.selected(_channels(file, wanted)), wanted, samples)


def verified_parts(path: str | Path, samples: int) -> Iterator[Log]:
    """The same, with all of the file verified when the last part was taken."""
    wanted = Wanted(truth=False)
    with _remedied(path), open_mcap(Path(path)) as file:
        yield from log_parts(file, file.records_with(_channels(file, wanted)), wanted, samples)


def read_strictly(path: Path, wanted: Wanted = EVERYTHING) -> Log:
    """``read_log`` without the remedy in its messages."""
    with open_mcap(path) as file:
        everything = wanted == EVERYTHING
        records = file.records() if everything else file.selected(_channels(file, wanted))
        return next(log_parts(file, records, wanted, None))


def samples_by_axis(path: str | Path) -> dict[str, int]:
    """Samples of each axis as the file's statistics announce them; nothing where there are none."""
    with _remedied(path), open_mcap(Path(path)) as file:
        counts = file.statistics.channel_message_counts if file.statistics else {}
        return {
            c.topic.removeprefix(AXIS_PREFIX): counts.get(c.id, 0)
            for c in file.channels()
            if c.topic.startswith(AXIS_PREFIX)
        }


@contextmanager
def _remedied(path: str | Path) -> Iterator[None]:
    try:
        yield
    except Damaged as error:
        raise Damaged(
            f"{error}; copy the file again, or keep what is intact: twin recover {path} -o GOOD"
        ) from error


def log_parts(
    file: McapFile, records: Iterator[Record], wanted: Wanted, samples: int | None
) -> Iterator[Log]:
    """The log in parts of ``samples`` or a few more; whole where None."""
    topics, extras, counts = _topics(file), Extras(), Counter[int]()
    decoder, room, every = Decoder(topics), _capacities(file, samples), _with_samples(file, wanted)
    run = before = Run(topics, wanted, room)
    for payload in payloads(records, extras.add, Inflation(file.size)):
        if samples is not None and run.holds(samples, every):
            run.require_behind(before)
            counts.update(run.counts)
            yield run.log(extras)
            run, before = Run(topics, wanted, room), run
        with at(payload.place):
            run.extend(decoder.blocks(payload.data))
    counts.update(run.counts)
    _check_counts(file, topics, counts)
    run.require_behind(before)
    yield run.log(extras)


def read_between(path: Path, wanted: Wanted, start: float, stop: float) -> Log:
    """The samples from ``start`` to before ``stop``, s."""
    if not start < stop:
        raise InputError(f"{path}: start = {start:g} s is not before stop = {stop:g} s")
    with open_mcap(path) as file:
        topics, extras = _topics(file), Extras()
        decoder, run = Decoder(topics), Run(topics, wanted)
        span = round(start * 1e9), min(stop * 1e9, 2.0**63)
        records = file.selected(_channels(file, wanted), *span)
        for payload in payloads(records, extras.add, Inflation(file.size)):
            with at(payload.place):
                run.extend(decoder.blocks(payload.data))
        return run.between(extras, start, stop)


def _topics(file: McapFile) -> Topics:
    """The topics as the summary lists them, whose chunks may never be read."""
    topics = Topics()
    for record in file.definitions():
        topics.register(record.opcode, record.content)
    return topics


def _channels(file: McapFile, wanted: Wanted) -> Container[int]:
    """The channels that are wanted; all where the summary lists none."""
    listed = file.channels()
    return {c.id for c in listed if wanted.takes(c.topic)} if listed else range(1 << 16)


def _with_samples(file: McapFile, wanted: Wanted) -> int:
    """How many wanted topics have samples, as the statistics announce them; 0 where unknown."""
    counts = file.statistics.channel_message_counts if file.statistics else {}
    return sum(counts.get(c.id, 0) > 0 for c in file.channels() if wanted.takes(c.topic))


def _check_counts(file: McapFile, topics: Topics, counts: Mapping[int, int]) -> None:
    """Compare the samples with the number of messages the file announces; raises Damaged."""
    if file.statistics is None:
        return
    announced = file.statistics.channel_message_counts
    for channel, count in counts.items():
        if count != announced.get(channel, 0):
            raise Damaged(
                f"{topics.channels[channel].topic}: {count} samples where the statistics "
                f"announce {announced.get(channel, 0)}"
            )


def _capacities(file: McapFile, samples: int | None) -> dict[int, int]:
    """Samples to make room for; no more than bytes in the file, whatever its statistics say."""
    counts = file.statistics.channel_message_counts if file.statistics else {}
    most = file.size if samples is None else min(file.size, samples + (samples >> 4))
    return {channel: min(count, most) for channel, count in counts.items()}


class Decoder:
    """Turns the records of a chunk into blocks of samples."""

    def __init__(self, topics: Topics) -> None:
        self._topics = topics
        self._layouts: dict[int, RowLayout] = {}  # by the channel of their first message

    def blocks(self, data: bytes) -> list[Block]:
        """Samples by channel; raises InputError, Damaged for broken framing.

        The messages of a chunk must all be laid out as the first ones, as this program writes them.
        """
        offset = self._register_leading(data)
        if offset == len(data):
            return []
        if len(data) - offset < RECORD_HEAD.size + _MESSAGE_HEAD.size:
            raise Damaged(f"a record is cut off, {offset} bytes into it")
        first = _MESSAGE_HEAD.unpack_from(data, offset + RECORD_HEAD.size)[0]
        if self._topics.topic(first) is None:
            return []
        for likely in (lambda: self._layouts.get(first), lambda: self._inferred(data, offset)):
            layout = likely()
            rows = layout.rows(data, offset) if layout else None
            if layout and rows is not None and offset + rows.nbytes == len(data):
                self._layouts[first] = layout
                return list(layout.blocks(rows))
        raise InputError(
            "its messages are not laid out as this program writes them; convert the log with: "
            "twin import"
        )

    def _register_leading(self, data: bytes) -> int:
        offset = registered = 0
        while offset < len(data):
            opcode, content, end = record_at(data, offset)
            if opcode == Opcode.MESSAGE:
                break
            registered += 1
            if registered > MOST_DEFINITIONS:
                raise Damaged(f"more than {MOST_DEFINITIONS} schemas and channels in one chunk")
            self._topics.register(opcode, content)
            offset = end
        return offset

    def _inferred(self, data: bytes, offset: int) -> RowLayout | None:
        """Layout of the messages up to the one whose channel comes a second time."""
        messages: dict[int, MessageLayout] = {}
        while offset < len(data):
            opcode, content, offset = record_at(data, offset)
            if opcode != Opcode.MESSAGE:
                return None
            channel, _, _, _, payload = message_parts(content)
            if channel in messages:
                break
            topic = self._topics.topic(channel)
            segments = segments_of(payload, topic.numbers) if topic else None
            if segments is None:
                return None
            messages[channel] = MessageLayout(channel, segments)
        return RowLayout(tuple(messages.values()))


def record_at(data: bytes, offset: int) -> tuple[int, bytes, int]:
    """Opcode, content and end of the record at ``offset``."""
    start = offset + RECORD_HEAD.size
    if start > len(data):
        raise Damaged(f"a record is cut off, {offset} bytes into it")
    opcode, length = RECORD_HEAD.unpack_from(data, offset)
    if length > len(data) - start:
        raise Damaged(f"a record claims more bytes than follow, {offset} bytes into it")
    if opcode not in IN_CHUNKS:
        raise Damaged(f"a record of kind {opcode}, which no chunk holds, {offset} bytes into it")
    return opcode, data[start : start + length], start + length


def message_parts(content: bytes) -> tuple[int, int, int, int, bytes]:
    """Channel, sequence, log time, publish time (ns) and payload of a message record."""
    if len(content) < _MESSAGE_HEAD.size:
        raise Damaged("a message record is too short")
    return *_MESSAGE_HEAD.unpack_from(content), content[_MESSAGE_HEAD.size :]
