"""The topics of a log: names, units and rates as its channels state them, and their samples."""

from __future__ import annotations

import math
import re
import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from mcap.opcode import Opcode
from mcap.records import Channel, Schema

from twin.errors import InputError, at
from twin.logs.container import RECORD_HEAD, Damaged, parse, record_at
from twin.logs.log import FIELDS, LINEAR_UNITS, ROTARY_UNITS
from twin.logs.messages import Block, MessageLayout, blocks_of, field_numbers

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


def complete_units(stated: Mapping[str, str]) -> dict[str, str]:
    """Units of all fields from those stated; raises InputError for one that is not SI."""
    for name, unit in stated.items():
        if unit not in (LINEAR_UNITS[name], ROTARY_UNITS[name]):
            allowed = " or ".join(dict.fromkeys((LINEAR_UNITS[name], ROTARY_UNITS[name])))
            raise InputError(
                f"unit of {name} is {unit!r}, allowed is {allowed}; convert it with: twin import"
            )
    rotary = any(unit != LINEAR_UNITS[name] for name, unit in stated.items())
    return {**(ROTARY_UNITS if rotary else LINEAR_UNITS), **stated}


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

    def blocks(self, data: bytes) -> list[Block]:
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
