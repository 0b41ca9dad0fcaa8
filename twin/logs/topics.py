"""The topics of a log: names, channel metadata, and the codec of each channel."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field

from mcap.opcode import Opcode
from mcap.records import Channel, Schema

from twin.errors import InputError, at
from twin.logs.container import Damaged, parse
from twin.logs.log import FIELDS, LINEAR_UNITS, ROTARY_UNITS
from twin.logs.schema import fields_of

AXIS_PREFIX = "/axis/"
TRUTH_PREFIX = "/truth/"
IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


@dataclass(frozen=True)
class Topic:
    """One topic of samples: "/axis/x" or "/truth/x"; numbers: field number -> name."""

    name: str
    fields: tuple[str, ...]
    metadata: Mapping[str, str]
    numbers: Mapping[int, str]

    @property
    def axis(self) -> str:
        """Name of the axis."""
        return axis_of(self.name)

    @property
    def is_truth(self) -> bool:
        """Whether the samples are the simulator's truth."""
        return self.name.startswith(TRUTH_PREFIX)

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
    """Schemas and channels seen so far."""

    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    _topics: dict[int, Topic | None] = field(default_factory=dict)
    _seen: set[bytes] = field(default_factory=set)

    def register(self, opcode: int, content: bytes) -> None:
        """Take a schema or channel record; every chunk may repeat them."""
        if content in self._seen:
            return
        if opcode == Opcode.SCHEMA:
            schema = parse(Schema, content, "schema record")
            if self.schemas.setdefault(schema.id, schema) != schema:
                raise Damaged(f"schema {schema.id} is defined twice, differently")
        else:
            channel = parse(Channel, content, "channel record")
            if self.channels.setdefault(channel.id, channel) != channel:
                raise Damaged(f"channel {channel.id} is defined twice, differently")
        self._seen.add(content)

    def topic(self, channel: int) -> Topic | None:
        """Topic of a channel; None where it holds no samples."""
        if channel not in self._topics:
            self._topics[channel] = self._open(channel)
        return self._topics[channel]

    def _open(self, channel_id: int) -> Topic | None:
        channel = self.channels.get(channel_id)
        if channel is None:
            raise Damaged(f"a message belongs to channel {channel_id}, which is not defined")
        for prefix in (AXIS_PREFIX, TRUTH_PREFIX):
            if channel.topic.startswith(prefix) and IDENTIFIER.fullmatch(
                channel.topic.removeprefix(prefix)
            ):
                break
        else:
            return None
        with at(channel.topic):
            numbers = fields_of(channel, self.schemas.get(channel.schema_id))
        there = tuple(numbers.values())
        fields = there if prefix == TRUTH_PREFIX else tuple(f for f in FIELDS if f in there)
        return Topic(channel.topic, fields, channel.metadata, numbers)
