"""MCAP of other writers: messages of protobuf, JSON and ROS; see ``twin/importers/messages.py``.

Of a bag that was cut off, has no summary or is damaged somewhere, what whole chunks prove is read.
"""

from __future__ import annotations

import json
from collections.abc import Callable
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


def read(path: Path, mapping: ImportMap) -> SignalTable:
    """Columns of an MCAP file; raises InputError."""
    wanted = mapping.column_names()
    messages = Messages(wanted)
    decoders: dict[int, Decoder | None] = {}
    unread: dict[str, None] = {}
    with parsing("MCAP"), open_bag(path) as bag:
        for m in bag.messages():
            if not messages.is_wanted(m.channel.id, m.channel.topic):
                continue
            if m.channel.id not in decoders:
                decoders[m.channel.id] = _decoder(m)
                if decoders[m.channel.id] is None:
                    unread[_unread(m)] = None
            decode = decoders[m.channel.id]
            message = _decoded(m, decode) if decode else None
            messages.add(m.channel.id, m.channel.topic, message, m.log_time, m.part)
        lost = tuple(dict.fromkeys(bag.lost))
    return messages.table(lost, tuple(unread))


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
