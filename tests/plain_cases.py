"""Small files of JSON messages, put together record by record, and what reading them gives."""

import pytest
from mcap.records import Message
from mcap_bytes import json_channel, json_message, json_schema, plain_file

from twin.errors import InputError
from twin.logs import Log, read_log

MS = 1_000_000
HEAD = [json_schema(1), json_channel(1, "/axis/x", schema=1)]


def sample(k: int, channel: int = 1, time: int | None = None, sequence: int = 0) -> Message:
    """Sample k of a channel, one a ms: numbers that no other sample of the file has."""
    values = {"position": 10.0 * channel + k, "force": -100.0 * channel - k}
    return json_message(channel, MS * k if time is None else time, values, sequence)


SAMPLES = [sample(k) for k in range(6)]


def refused(path, items, message: str) -> str:
    """The one line, naming the file, that a file of these records is answered with."""
    path.write_bytes(plain_file(items))
    with pytest.raises(InputError, match=message) as caught:
        read_log(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)
    return str(caught.value)


def accepted(path, items) -> Log:
    """The log of a file of these records."""
    path.write_bytes(plain_file(items))
    return read_log(path)
