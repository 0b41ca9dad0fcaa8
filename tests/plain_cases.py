"""Small logs, put together record by record, and what reading them gives."""

import struct
from collections.abc import Iterable, Mapping

import pytest
from mcap.records import Channel, Message, Schema
from mcap_bytes import log_file

from twin.errors import InputError
from twin.logs import Log, read_log
from twin.logs.topics import file_descriptor_set, tag

MS = 1_000_000
RATED = {"sample_rate_hz": "1000"}


def schema(number: int = 1, fields: Iterable[str] = ("position", "force")) -> Schema:
    """The schema of a message of these fields, numbered from 1."""
    numbers = {name: n for n, name in enumerate(fields, 1)}
    data = file_descriptor_set("twin.AxisSample", numbers)
    return Schema(number, data, "protobuf", "twin.AxisSample")


def channel(
    number: int, topic: str, metadata: Mapping[str, str] | None = None, of: int = 1
) -> Channel:
    """A channel of such messages at 1 kHz."""
    return Channel(number, topic, "protobuf", {**RATED, **(metadata or {})}, of)


def message(channel: int, k: int, values: Mapping[str, float], time: int | None = None) -> Message:
    """Message k of a channel, one a ms or at a time in ns."""
    data = b"".join(tag(n) + struct.pack("<d", value) for n, value in enumerate(values.values(), 1))
    at = MS * k if time is None else time
    return Message(channel, at, data, at, k)


def sample(k: int, channel: int = 1, time: int | None = None) -> Message:
    """Sample k of a channel: numbers that no other sample of the file has."""
    values = {"position": 10.0 * channel + k, "force": -100.0 * channel - k}
    return message(channel, k, values, time)


HEAD = [schema(), channel(1, "/axis/x")]
SAMPLES = [sample(k) for k in range(6)]


def refused(path, items, text: str) -> str:
    """The one line, naming the file, that a log of these records is answered with."""
    path.write_bytes(log_file(items))
    with pytest.raises(InputError, match=text) as caught:
        read_log(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)
    return str(caught.value)


def accepted(path, items) -> Log:
    """The log of a file of these records."""
    path.write_bytes(log_file(items))
    return read_log(path)
