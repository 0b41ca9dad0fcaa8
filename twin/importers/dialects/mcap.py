"""MCAP of other writers: protobuf, JSON and ROS 2 messages; ``twin/importers/messages.py``."""

from __future__ import annotations

import json
import struct
from array import array
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from mcap.opcode import Opcode

from twin.errors import InputError
from twin.importers.dialects import Dialect
from twin.importers.mapping import ImportMap
from twin.importers.messages import LOG_TIME, of_message
from twin.importers.table import SignalTable, extra, parsing, require_columns
from twin.logs.container import (
    IN_CHUNKS,
    Damaged,
    FileBytes,
    Inflation,
    McapFile,
    open_chunk,
    record_at,
)
from twin.logs.topics import Topics

_MODULES = {"cdr": "mcap_ros2.decoder", "protobuf": "mcap_protobuf.decoder"}
_MESSAGE_HEAD = struct.Struct("<HIQQ")  # channel, sequence, log time, publish time


def read(path: Path, mapping: ImportMap) -> SignalTable:
    """Columns of an MCAP file; raises InputError."""
    wanted = mapping.column_names()
    held: dict[str, array] = {}
    stamps: set[str] = set()
    seen: dict[str, None] = {}
    with parsing("MCAP"):
        for topic, time, decoded in _messages(path, wanted):
            values = of_message(topic, decoded)
            values[f"{topic}.{LOG_TIME}"] = np.datetime64(time, "ns")
            seen.update(dict.fromkeys(values))
            for name in wanted or values:
                if name in values:
                    value = values[name]
                    if isinstance(value, np.datetime64):
                        stamps.add(name)
                        value = int(value.astype(np.int64))
                    held.setdefault(name, array("q" if name in stamps else "d")).append(value)
                elif name in held and name.startswith(f"{topic}."):
                    raise InputError(f"a message on {topic} at {time} ns has no '{name}'")
    require_columns(wanted, seen)
    kinds = {name: "datetime64[ns]" if name in stamps else None for name in wanted or held}
    return SignalTable({name: np.array(held[name], kind) for name, kind in kinds.items()})


def _messages(path: Path, wanted: Sequence[str]) -> Iterator[tuple[str, int, Any]]:
    """Topic, log time in ns and message; of topics not wanted the first alone. Raises Damaged."""
    topics, shown = Topics(), Counter[int]()
    decoders: dict[int, Callable[[bytes], Any] | None] = {}
    with open(path, "rb") as stream:
        file = McapFile(FileBytes(stream))
        for opcode, content in _records(file):
            if opcode != Opcode.MESSAGE:
                topics.register(opcode, content)
                continue
            number, _, time, _ = _MESSAGE_HEAD.unpack_from(content)
            channel = topics.channels[number]
            shown[number] += 1
            if shown[number] > 1 and not any(
                w.startswith(f"{channel.topic}.") for w in wanted or (f"{channel.topic}.",)
            ):
                continue
            if number not in decoders:
                encoding, schema = channel.message_encoding, topics.schemas.get(channel.schema_id)
                decoders[number] = json.loads if encoding == "json" else None
                if encoding in _MODULES:
                    factory = extra(_MODULES[encoding]).DecoderFactory()
                    decoders[number] = factory.decoder_for(encoding, schema)
            decode = decoders[number]
            yield channel.topic, time, decode(content[_MESSAGE_HEAD.size :]) if decode else None
    # a chunk whose kind is damaged is passed over
    if file.counts is not None and shown.total() != sum(file.counts.values()):
        raise Damaged(
            f"{shown.total()} messages where its statistics announce {sum(file.counts.values())}; "
            "copy the file again"
        )


def _records(file: McapFile) -> Iterator[tuple[int, bytes]]:
    """Opcode and content of schemas, channels and messages, in chunks and outside."""
    budget = Inflation(file.size)
    for record in file.records():
        if record.opcode == Opcode.CHUNK:
            data, _ = open_chunk(record, budget)
            offset = 0
            while offset < len(data):
                opcode, content, offset = record_at(data, offset)
                yield opcode, content
        elif record.opcode in IN_CHUNKS:
            yield record.opcode, record.content


DIALECT = Dialect("MCAP of other writers", (".mcap",), read)
