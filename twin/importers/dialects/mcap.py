"""MCAP of other writers: messages of protobuf, JSON and ROS; see ``twin/importers/messages.py``.

Of a bag that was cut off, has no summary or is damaged somewhere, what whole chunks prove is read.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from twin.errors import InputError
from twin.importers.dialects import Dialect
from twin.importers.mapping import ImportMap
from twin.importers.messages import Messages
from twin.importers.ros_types import ros_decoder
from twin.importers.table import SignalTable, extra, parsing
from twin.logs.bags import BagMessage, open_bag

Decoder = Callable[[bytes], Any]
READ = "json, protobuf, cdr and ros1"
_BATCH = 2048  # messages of a channel that are decoded at once


def read(path: Path, mapping: ImportMap) -> SignalTable:
    """Columns of an MCAP file; raises InputError."""
    wanted = mapping.column_names()
    messages = Messages(wanted)
    channels: dict[int, _Channel] = {}
    with parsing("MCAP"), open_bag(path) as bag:
        for m in bag.messages():
            channel = channels.get(m.channel.id)
            if channel is None:
                channel = channels[m.channel.id] = _Channel(m, _decoder(m))
                channel.hand_to(messages, [m])  # so that the first of a topic is known as such
                channel.wanted = messages.is_wanted(m.channel.id, m.channel.topic)
                continue
            if not channel.wanted:
                continue
            if channel.waiting and channel.waiting[0].part != m.part:
                channel.empty_to(messages)
            channel.waiting.append(m)
            if len(channel.waiting) == _BATCH:
                channel.empty_to(messages)
        for channel in channels.values():
            channel.empty_to(messages)
        lost = tuple(dict.fromkeys(bag.lost))
    unread = dict.fromkeys(_unread(c.first) for c in channels.values() if c.decode is None)
    return messages.table(lost, tuple(unread))


@dataclass
class _Channel:
    """A channel: its first message, what reads its messages (None: nothing), those not yet read.

    wanted: whether more than the first is asked for.
    """

    first: BagMessage
    decode: Decoder | None
    wanted: bool = True
    waiting: list[BagMessage] = field(default_factory=list)

    def empty_to(self, messages: Messages) -> None:
        """Hand on what waits."""
        if self.waiting:
            self.hand_to(messages, self.waiting)
            self.waiting = []

    def hand_to(self, messages: Messages, batch: Sequence[BagMessage]) -> None:
        """Decode messages of one part and hand them on; raises InputError."""
        first, decode = batch[0], self.decode
        decoded: Sequence[Any]
        if decode is None:
            decoded = [None] * len(batch)
        else:
            joined = _joined_json(batch) if decode is json.loads else None
            decoded = joined or [_decoded(m, decode) for m in batch]
        times = [m.log_time for m in batch]
        messages.add_all(first.channel.id, first.channel.topic, decoded, times, first.part)


def _joined_json(batch: Sequence[BagMessage]) -> list[Any] | None:
    """Messages read as one array, twice as fast; None where they must be read one by one."""
    try:
        read = json.loads(b"[" + b",".join(m.data for m in batch) + b"]")
    except ValueError:
        return None
    return read if len(read) == len(batch) else None


def _decoder(m: BagMessage) -> Decoder | None:
    """What reads the messages of a channel; None where nothing does."""
    encoding, schema = m.channel.message_encoding, m.schema
    if encoding == "json":
        return json.loads
    if encoding == "protobuf" and schema is not None and schema.encoding == "protobuf":
        decode: Decoder = extra("mcap_protobuf.decoder").DecoderFactory().decoder_for(
            encoding, schema)  # fmt: skip
        return decode
    if encoding in ("cdr", "ros1") and schema is not None:
        return ros_decoder(encoding, schema.encoding, schema.name, schema.data)
    return None


def _decoded(m: BagMessage, decode: Decoder) -> Any:
    """The message; raises InputError that names topic and time."""
    try:
        return decode(m.data)
    except InputError:
        raise
    except Exception as error:  # whatever a library raises on bytes that are none of its
        raise InputError(
            f"a message on {m.channel.topic} at {m.log_time} ns cannot be read as "
            f"{m.channel.message_encoding} ({error}); record it again"
        ) from error


def _unread(m: BagMessage) -> str:
    schema = "no schema" if m.schema is None else f"a schema of {m.schema.encoding or 'no kind'}"
    return (
        f"topic {m.channel.topic} is of encoding {m.channel.message_encoding or 'none'} with "
        f"{schema}, which is not read; known are {READ}: record or convert it to one of these"
    )


DIALECT = Dialect("MCAP of other writers, such as ROS 2", (".mcap",), read)
