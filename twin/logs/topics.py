"""The topics of a log: names, units and rates as its channels state them, and their samples.

Messages of doubles in protobuf, as they lie in a chunk: all of a topic have the same size.

A message record is opcode u1, length u8, channel u2, sequence u4, log_time u8, publish_time u8
(little-endian), then the payload: for each field its tag and 8 bytes. Every field is written, also
those that are 0, in the order of the schema. So one packed NumPy structure describes a message, or
a row of one of each channel, and a chunk is written and read column by column.
"""

from __future__ import annotations

import math
import re
import struct
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import cached_property
from typing import Any

import numpy as np
from google.protobuf.descriptor_pb2 import FieldDescriptorProto as Field
from google.protobuf.descriptor_pb2 import FileDescriptorProto, FileDescriptorSet
from google.protobuf.message import DecodeError
from mcap.opcode import Opcode
from mcap.records import Channel, Schema
from numpy.typing import NDArray

from twin.errors import InputError, at
from twin.logs.container import RECORD_HEAD, Damaged, parse, record_at
from twin.logs.log import FIELDS, Array, complete_units
from twin.numbers import first_not_finite

AXIS_SAMPLE = "twin.AxisSample"
AXIS_TRUTH = "twin.AxisTruth"


def numbered(names: Iterable[str]) -> dict[str, int]:
    """The field numbers of columns; from this first one on, the tag of a field has four bytes.

    No fast compressor takes a repetition of less. So a number's tag, with what the number has in
    common with the one a sample before, is taken in one step, and costs nothing.
    """
    return {name: number for number, name in enumerate(names, 1 << 18)}


FIELD_NUMBERS = numbered(FIELDS)


def file_descriptor_set(message: str, numbers: Mapping[str, int]) -> bytes:
    """Serialized schema of ``message`` ("package.Name") with a double for each name: number."""
    package, name = message.split(".")
    file = FileDescriptorProto(name=f"{package}/{name}.proto", package=package, syntax="proto3")
    descriptor = file.message_type.add(name=name)
    for column, number in numbers.items():
        kind, label = Field.TYPE_DOUBLE, Field.LABEL_OPTIONAL
        descriptor.field.add(name=column, number=number, type=kind, label=label)
    return FileDescriptorSet(file=[file]).SerializeToString(deterministic=True)


def field_numbers(channel: Channel, schema: Schema | None) -> dict[str, int]:
    """Name -> number of the doubles in a channel's messages; InputError for anything else."""
    if schema is None or (channel.message_encoding, schema.encoding) != ("protobuf", "protobuf"):
        raise InputError(
            f"messages are encoded as {channel.message_encoding!r} with "
            f"{schema.encoding if schema else 'no'!r} schema; only logs of this program are read, "
            "in protobuf; convert the log with: twin import"
        )
    try:
        files = FileDescriptorSet.FromString(schema.data).file
    except DecodeError as error:
        raise InputError(f"the protobuf schema {schema.name!r} cannot be used") from error
    found = [m for f in files for m in f.message_type if f"{f.package}.{m.name}" == schema.name]
    fields = found[0].field if found else ()
    doubles = [f for f in fields if f.type == Field.TYPE_DOUBLE and f.name.isidentifier()]
    numbers = {f.name: f.number for f in doubles if f.number > 0}
    if not found or len(numbers) != len(fields):
        raise InputError(
            f"the protobuf schema {schema.name!r} is not of doubles alone; convert the log with: "
            "twin import"
        )
    return numbers


def tag(number: int) -> bytes:
    """The bytes before the double of a field: 7 bits each, the low ones first."""
    double_on_wire = 1  # the type of a field, in the low three bits of its tag
    value, out = number << 3 | double_on_wire, bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes([*out, value])


# A column is an identifier, so no column can be called like one of these.
_HEAD = [
    (".opcode", "u1"),
    (".length", "<u8"),
    (".channel", "<u2"),
    (".sequence", "<u4"),
    (".log_time", "<u8"),
    (".publish_time", "<u8"),
]
_VARYING = (".sequence", ".log_time", ".publish_time")


def sample_times(first: int, count: int, sample_rate: float) -> NDArray[np.int64]:
    """(count,) times in ns of the samples from number ``first``: round(k dt)."""
    k = np.arange(first, first + count, dtype=np.float64)
    return np.rint(k * 1e9 / sample_rate).astype(np.int64)


@dataclass(frozen=True)
class MessageBlock:
    """Consecutive samples of one channel: sequence, log_time (ns) and columns by name, (n,)."""

    channel: int
    sequence: NDArray[np.uint32]
    log_time: NDArray[np.uint64]
    columns: Mapping[str, Array]


@dataclass(frozen=True)
class MessageLayout:
    """The message record of one channel; numbers: field -> its number, in the order written."""

    channel: int
    numbers: Mapping[str, int]

    @cached_property
    def dtype(self) -> np.dtype:
        """Packed structure of the record; the tag of a field is called "field.tag"."""
        payload = []
        for name, number in self.numbers.items():
            size = len(tag(number))
            # one number is compared faster than its bytes
            of_tag = f"<u{size}" if size in (1, 2, 4) else f"V{size}"
            payload += [(f"{name}.tag", of_tag), (name, "<f8")]
        return np.dtype(_HEAD + payload)

    @cached_property
    def template(self) -> np.ndarray:
        """(1,) record with every constant filled in, everything else 0."""
        record = np.zeros(1, self.dtype)
        record[".opcode"] = Opcode.MESSAGE
        outside_length = 9  # opcode and length, which the record's length does not count
        record[".length"] = self.dtype.itemsize - outside_length
        record[".channel"] = self.channel
        for name, number in self.numbers.items():
            record[f"{name}.tag"] = np.frombuffer(tag(number), self.dtype[f"{name}.tag"])
        return record


def blocks_of(
    layouts: Sequence[MessageLayout], data: bytes, offset: int
) -> list[MessageBlock] | None:
    """The samples from ``offset`` on, as views; None unless they are rows of every channel."""
    row = np.dtype([(str(layout.channel), layout.dtype) for layout in layouts])
    count, rest = divmod(len(data) - offset, row.itemsize)
    if rest:
        return None
    rows = np.frombuffer(data, row, count, offset)
    blocks = []
    for layout in layouts:
        records = rows[str(layout.channel)]
        fixed = [n for n in layout.dtype.names or () if "." in n and n not in _VARYING]
        if not all((records[name] == layout.template[name]).all() for name in fixed):
            return None
        columns = {name: records[name] for name in layout.numbers}
        blocks.append(
            MessageBlock(layout.channel, records[".sequence"], records[".log_time"], columns)
        )
    return blocks


# --- topics ---------------------------------------------------------------------------------------

AXIS_PREFIX = "/axis/"
TRUTH_PREFIX = "/truth/"
IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_MESSAGE = struct.Struct("<BQH")  # opcode, length of what follows, channel


@dataclass(frozen=True)
class Topic:
    """One topic of samples: "/axis/x" or "/truth/x", and how its messages lie in the file."""

    name: str
    metadata: Mapping[str, str]
    layout: MessageLayout

    @property
    def axis(self) -> str:
        """Name of the axis."""
        return axis_of(self.name)

    @property
    def is_truth(self) -> bool:
        """Whether the samples are the simulator's truth."""
        return self.name.startswith(TRUTH_PREFIX)

    @property
    def fields(self) -> tuple[str, ...]:
        """The signals that a log has of it."""
        there = self.layout.numbers
        return tuple(there) if self.is_truth else tuple(f for f in FIELDS if f in there)

    @property
    def sample_rate(self) -> float:
        """Sample rate in Hz; raises InputError where it is not stated."""
        rate = positive_number(self.metadata, "sample_rate_hz")
        if rate is None:
            raise InputError("states no sample rate; convert the log with: twin import")
        return rate

    @property
    def force_constant(self) -> float | None:
        """Force constant in N/A, where stated."""
        return positive_number(self.metadata, "force_constant")

    @property
    def units(self) -> Mapping[str, str]:
        """Unit of every field; raises InputError for a unit that is not SI."""
        stated = {f: u for f in FIELDS if (u := self.metadata.get(f"unit.{f}")) is not None}
        return complete_units(stated)

    def require_fields(self) -> None:
        """Raise InputError where an axis has no position, or neither current nor force."""
        there = self.layout.numbers
        if self.is_truth or ("position" in there and ("current" in there or "force" in there)):
            return
        missing = "position" if "position" not in there else "current or force"
        raise InputError(
            f"{self.name} has no {missing}; fields in its messages: {', '.join(there) or 'none'}; "
            "rename or add the field, or convert the log with: twin import"
        )


def axis_of(topic: str) -> str:
    """Name of the axis of a topic of samples."""
    return topic.rpartition("/")[2]


def positive_number(metadata: Mapping[str, str], key: str) -> float | None:
    """``metadata[key]`` as a finite number above 0, or None where it is absent."""
    if key not in metadata:
        return None
    try:
        value = float(metadata[key])
    except ValueError:
        value = math.nan
    if not 0.0 < value < math.inf:
        raise InputError(f"metadata {key} is {metadata[key]!r}; give a number above 0")
    return value


@dataclass
class Topics:
    """Schemas and channels seen so far, and the samples in the chunks that they describe."""

    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    _topics: dict[int, Topic | None] = field(default_factory=dict)
    _seen: set[bytes] = field(default_factory=set)

    def register(self, opcode: int, content: bytes) -> None:
        """Take a schema or channel record; every chunk may repeat them."""
        if content in self._seen:
            return
        is_schema = opcode == Opcode.SCHEMA
        name, known = ("schema", self.schemas) if is_schema else ("channel", self.channels)
        record: Any = parse(Schema if is_schema else Channel, content, f"{name} record")
        if known.setdefault(record.id, record) != record:
            raise Damaged(f"{name} {record.id} is defined twice, differently")
        self._seen.add(content)

    def forget(self, channel: int) -> None:
        """Know a channel no more; its number may become that of another."""
        del self.schemas[self.channels.pop(channel).schema_id]
        self._topics.pop(channel, None)

    def names(self) -> list[str]:
        """All topics of the file, also those of no axis."""
        return sorted(channel.topic for channel in self.channels.values())

    def topic(self, channel: int) -> Topic | None:
        """Topic of a channel; None where it holds no samples."""
        if channel in self._topics:
            return self._topics[channel]
        own, topic = self.channels.get(channel), None
        if own is None:
            raise Damaged(f"a message belongs to channel {channel}, which is not defined")
        axis = axis_of(own.topic)
        known = own.topic in (AXIS_PREFIX + axis, TRUTH_PREFIX + axis)
        if known and IDENTIFIER.fullmatch(axis):
            with at(own.topic):
                numbers = field_numbers(own, self.schemas.get(own.schema_id))
            topic = Topic(own.topic, own.metadata, MessageLayout(channel, numbers))
        self._topics[channel] = topic
        return topic

    def blocks(self, data: bytes) -> list[MessageBlock]:
        """Samples of a chunk by channel; raises InputError, Damaged for broken framing.

        The messages of a chunk must all be laid out as the first ones, as this program writes them.
        """
        offset = registered = 0
        while offset < len(data):
            opcode, content, end = record_at(data, offset)
            if opcode == Opcode.MESSAGE:
                break
            registered += 1
            # of schemas and channels in a chunk; there are 65535 of each
            most_definitions = 100_000
            if registered > most_definitions:
                raise Damaged(f"more than {most_definitions} schemas and channels in one chunk")
            self.register(opcode, content)
            offset = end
        if offset == len(data):
            return []
        channels = list(self._row(data, offset))
        if self.topic(channels[0]) is None:
            return []
        layouts = [topic.layout for channel in channels if (topic := self.topic(channel))]
        blocks = blocks_of(layouts, data, offset) if len(layouts) == len(channels) else None
        if blocks is not None:
            return blocks
        raise InputError(
            "its messages are not laid out as this program writes them; convert the log with: "
            "twin import"
        )

    def _row(self, data: bytes, offset: int) -> Iterator[int]:
        """The channels of the messages up to the one whose channel comes a second time."""
        seen: set[int] = set()
        while offset < len(data):
            if len(data) - offset < _MESSAGE.size:
                raise Damaged(f"a record is cut off, {offset} bytes into it")
            _, length, channel = _MESSAGE.unpack_from(data, offset)
            if channel in seen:
                return
            yield channel
            seen.add(channel)
            offset += RECORD_HEAD.size + length


# --- a topic's samples as they arrive -------------------------------------------------------------


def is_calendar(seconds: float) -> bool:
    """Whether a time in s counts since 1970."""
    earliest, latest = 5e8, 5e9  # s since 1970, between which a time is that of a calendar
    return earliest < seconds < latest


def seconds(nanoseconds: float) -> str:
    """A time in ns for a message."""
    if is_calendar(nanoseconds * 1e-9):
        whole, rest = divmod(round(nanoseconds), 10**9)
        day = datetime.fromtimestamp(whole, UTC).strftime("%Y-%m-%d %H:%M:%S")
        fraction = f".{rest:09d}".rstrip("0").rstrip(".")
        return f"{day}{fraction} UTC"
    return f"{nanoseconds * 1e-9:.9f}".rstrip("0").rstrip(".") + " s"


def instant(time: float) -> str:
    """A time in s for a message, to the microsecond where it counts since 1970."""
    return seconds(round(time * 1e6) * 1000) if is_calendar(time) else f"{time:.9g} s"


class Series:
    """Columns of one topic; ``append`` refuses what is not evenly spaced and finite.

    capacity: samples expected at once; more are taken too. wanted: the fields that are kept, None
    for all. start: time of the first sample in ns; ``count`` samples were taken, of which the last
    ``held`` are in the columns; rate in Hz.
    """

    def __init__(self, topic: Topic, capacity: int, wanted: Collection[str] | None = None) -> None:
        self.topic = topic
        self.rate = topic.sample_rate
        self.start = self.count = self.held = 0
        self._first_sequence = 0
        self._capacity = capacity
        self._fields = [f for f in topic.fields if wanted is None or f in wanted]
        self._columns: dict[str, Array] = {}

    @property
    def span(self) -> range:
        """The numbers of all its samples: where the periods since time 0 have them."""
        first = round(self.start * 1e-9 * self.rate)
        return range(first, first + self.count)

    def append(self, block: MessageBlock) -> None:
        """Take the next samples; raises InputError for a gap, a NaN or a time out of place."""
        if self.count == 0:
            self.start = int(block.log_time[0])
            self._first_sequence = int(block.sequence[0])
        first = self._first_sequence + self.count
        require_even(self.topic, block, first, self.start, self.count)
        size = len(block.log_time)
        need = self.held + size
        if not self._columns:
            self._columns = {name: np.empty(max(need, self._capacity)) for name in self._fields}
        for name, column in self._columns.items():
            if need > len(column):
                self._columns[name] = np.empty(max(need, 2 * len(column)))
                self._columns[name][: self.held] = column[: self.held]
            self._columns[name][self.held : need] = block.columns[name]
            require_finite(self.topic, block, name, self.count)
        self.count += size
        self.held = need

    def taken(self) -> dict[str, Array]:
        """The samples that are held, of every field; from here on only new ones are."""
        columns = self._columns
        for name, column in columns.items():  # one by one, so that one alone is held twice
            columns[name] = column if len(column) == self.held else column[: self.held].copy()
        self._columns, self.held = {}, 0
        return columns


def require_even(topic: Topic, block: MessageBlock, sequence: int, start: int, count: int) -> None:
    """Raise InputError where samples of a topic are not those behind ``count`` others.

    sequence: number that their first must have; start: time of the topic's first sample in ns.
    """
    name, rate = topic.name, topic.sample_rate
    expected = np.arange(sequence, sequence + len(block.sequence)).astype(np.uint32)
    wrong = block.sequence != expected
    if wrong.any():
        i = int(np.argmax(wrong))
        raise InputError(
            f"{name}: message {count + i} has sequence number {block.sequence[i]}, "
            f"expected {expected[i]}: messages are missing or out of order"
        )
    time = block.log_time.astype(np.int64)
    if time.min() < 0:
        latest = int(block.log_time.max())
        raise InputError(f"{name}: a message has the time {latest} ns, which no clock shows")
    last = (count + len(expected)) * 1e9 / rate
    if not last < 1 << 62:  # ns, 146 years: no clock of a machine, and no sum of two overflows
        raise InputError(f"{name}: at {rate:g} Hz {len(expected)} samples would last {last:g} ns")
    elapsed = time - start
    times = sample_times(count, len(elapsed), rate)
    rounding = 2.0  # ns: how far a time may be off that of its number, of which both are rounded
    off = np.abs(elapsed - times) > rounding
    if off.any():
        i = int(np.argmax(off))
        before, now = (int(elapsed[i - 1]) if i else times[0] - 1e9 / rate), int(elapsed[i])
        fault = "gap" if now - before > 1.5e9 / rate else "uneven time"
        raise InputError(
            f"{name}: {fault if now > before else 'time does not increase'}: "
            f"{seconds(start + before)} is followed by {seconds(start + now)} at sample "
            f"{count + i}, expected a sample every {1.0 / rate:.9g} s ({rate:.9g} Hz); keep the "
            "longest even part with: twin recover, or convert the log with: twin import"
        )


def require_finite(topic: Topic, block: MessageBlock, name: str, count: int) -> None:
    """Raise InputError where a column of the samples behind ``count`` others is not a number."""
    column = block.columns[name]
    if (i := first_not_finite(column)) is not None:
        raise InputError(
            f"{topic.name}: {name} is {column[i]} at {seconds(float(block.log_time[i]))} "
            f"(sample {count + i}); leave out a signal that was not recorded, "
            "or keep the longest part without it with: twin recover"
        )
