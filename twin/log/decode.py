"""MCAP -> Log, strictly: every fault is one InputError that names file, place and remedy."""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from mcap.opcode import Opcode

from twin.errors import at
from twin.log.assemble import Extras, Run
from twin.log.container import (
    IN_CHUNKS,
    RECORD_HEAD,
    Damaged,
    Inflation,
    McapFile,
    open_mcap,
    payloads,
)
from twin.log.layout import Block, MessageLayout, RowLayout
from twin.log.log import Log
from twin.log.topics import Topics

MOST_DEFINITIONS = 100_000  # of schemas and channels in a chunk; there are 65535 of each
_MESSAGE_HEAD = struct.Struct("<HIQQ")  # channel, sequence, log time, publish time


def read_log(path: str | Path, axes: Sequence[str] | None = None, *, truth: bool = True) -> Log:
    """Read an MCAP log; ``axes`` limits it to those named, None reads all.

    truth: whether the simulator's truth is read too, which takes more than half of the memory.

    Every checksum is verified, and the samples must be complete, evenly spaced and finite.
    Raises InputError otherwise, and where no axis has position and one of current and force.
    """
    try:
        return read_strictly(Path(path), axes, truth)
    except Damaged as error:
        raise Damaged(
            f"{error}; copy the file again, or keep what is intact: twin recover {path} -o GOOD"
        ) from error


def read_strictly(path: Path, axes: Sequence[str] | None = None, truth: bool = True) -> Log:
    """``read_log`` without the remedy in its messages."""
    with open_mcap(path) as file:
        topics, extras = Topics(), Extras()
        run = Run(topics, axes, _capacities(file), truth)
        decoder = Decoder(topics)
        for payload in payloads(file.records(), extras.add, Inflation(file.size)):
            with at(payload.place):
                for block in decoder.blocks(payload.data):
                    run.append(block)
        if file.statistics is not None:
            run.check_counts(file.statistics.channel_message_counts)
        return run.log(extras)


def _capacities(file: McapFile) -> dict[int, int]:
    """Samples to make room for; no more than bytes in the file, whatever its statistics say."""
    counts = file.statistics.channel_message_counts if file.statistics else {}
    return {channel: min(count, file.size) for channel, count in counts.items()}


class Decoder:
    """Turns schema, channel and message records into blocks of samples."""

    def __init__(self, topics: Topics) -> None:
        self._topics = topics
        self._layout: RowLayout | None = None
        self._registered = 0  # schemas and channels in the present chunk

    def blocks(self, data: bytes) -> Iterator[Block]:
        """Samples by channel, in file order; raises InputError, Damaged for broken framing.

        Rows of the same layout are taken as they lie; whatever else there is, message by message.
        """
        self._registered = 0
        offset = self._register_leading(data)
        for layout in self._layouts(data, offset):
            rows = layout.rows(data, offset)
            if rows is not None:
                yield from layout.blocks(rows)
                offset += rows.nbytes
                self._layout = layout
                break
        yield from self._message_blocks(data, offset)

    def _layouts(self, data: bytes, offset: int) -> Iterator[RowLayout]:
        """Layouts to try: the one of the chunk before, and what the first messages look like."""
        if self._layout is not None:
            yield self._layout
        inferred = self._infer(data, offset)
        if inferred is not None:
            yield inferred

    def _register_leading(self, data: bytes) -> int:
        offset = 0
        while offset < len(data):
            opcode, content, end = _record(data, offset)
            if opcode == Opcode.MESSAGE:
                break
            self._register(opcode, content)
            offset = end
        return offset

    def _register(self, opcode: int, content: bytes) -> None:
        self._registered += 1
        if self._registered > MOST_DEFINITIONS:
            raise Damaged(f"more than {MOST_DEFINITIONS} schemas and channels in one chunk")
        self._topics.register(opcode, content)

    def _infer(self, data: bytes, offset: int) -> RowLayout | None:
        """Layout of the messages up to the one whose channel comes a second time."""
        messages: dict[int, MessageLayout] = {}
        while offset < len(data):
            opcode, content, offset = _record(data, offset)
            if opcode != Opcode.MESSAGE:
                return None
            channel, _, _, _, payload = _message(content)
            if channel in messages:
                break
            topic = self._topics.topic(channel, payload)
            segments = topic.codec.segments(payload) if topic else None
            if segments is None:
                return None
            messages[channel] = MessageLayout(channel, segments)
        return RowLayout(tuple(messages.values())) if messages else None

    def _message_blocks(self, data: bytes, offset: int) -> Iterator[Block]:
        samples: dict[int, list[tuple[int, int, Sequence[float]]]] = {}
        while offset < len(data):
            opcode, content, offset = _record(data, offset)
            if opcode != Opcode.MESSAGE:
                self._register(opcode, content)
            else:
                channel, sequence, time, _, payload = _message(content)
                topic = self._topics.topic(channel, payload)
                if topic is not None:
                    with at(topic.name):
                        values = topic.codec.values(payload)
                    samples.setdefault(channel, []).append((sequence, time, values))
        for channel, rows in samples.items():
            topic = self._topics.topic(channel, b"")
            assert topic is not None
            numbers, times, values = zip(*rows, strict=True)
            columns = dict(zip(topic.codec.fields, np.array(values).T, strict=True))
            yield Block(channel, np.array(numbers, "u4"), np.array(times, "u8"), columns)


def _record(data: bytes, offset: int) -> tuple[int, bytes, int]:
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


def _message(content: bytes) -> tuple[int, int, int, int, bytes]:
    if len(content) < _MESSAGE_HEAD.size:
        raise Damaged("a message record is too short")
    return *_MESSAGE_HEAD.unpack_from(content), content[_MESSAGE_HEAD.size :]
