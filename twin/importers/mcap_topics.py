"""MCAP of other writers: protobuf, JSON and ROS 2 messages, one column a number in a message.

A column is ``topic.field``, ``topic.field.inner``, or ``topic.field[1]`` for the first of an array;
where a message names the entries of its arrays, as sensor_msgs/JointState does, or an entry has a
name of its own, also ``topic.field.name``. ``topic.log_time`` and time stamps in a message are
times since 1970.
"""

from __future__ import annotations

import json
import struct
from array import array
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from mcap.opcode import Opcode
from mcap.records import Schema
from numpy.typing import NDArray

from twin.errors import InputError
from twin.importers.mapping import ImportMap
from twin.importers.table import Table, chosen, extra, parsing, require_columns
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

LOG_TIME = "log_time"
_STAMPS = (("sec", "nanosec"), ("seconds", "nanos"))  # ROS 2, protobuf

Decode = Callable[[bytes], Any]
_MESSAGE_HEAD = struct.Struct("<HIQQ")  # channel, sequence, log time, publish time


def read(path: Path, mapping: ImportMap) -> Table:
    """Columns of an MCAP file; raises InputError."""
    wanted = mapping.column_names()
    with parsing("MCAP"):
        columns = _columns(path, wanted)
    return Table({name: columns[name] for name in chosen(wanted, columns)})


def _columns(path: Path, wanted: Sequence[str]) -> dict[str, NDArray]:
    held: dict[str, array] = {}
    stamps: set[str] = set()
    seen: dict[str, None] = {}
    for topic, time, decoded in _messages(path, wanted):
        values = _flat(f"{topic}.", decoded) if decoded is not None else {}
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
    return {
        name: np.array(column, "datetime64[ns]") if name in stamps else np.array(column)
        for name, column in held.items()
    }


def _messages(path: Path, wanted: Sequence[str]) -> Iterator[tuple[str, int, Any]]:
    """Topic, log time in ns and message; of topics that are not wanted the first alone.

    Raises Damaged where there are not as many as the file announces.
    """
    topics, shown = Topics(), Counter[int]()
    decoders: dict[int, Decode | None] = {}
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
                schema = topics.schemas.get(channel.schema_id)
                decoders[number] = _decoder_for(channel.message_encoding, schema)
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


def _decoder_for(encoding: str, schema: Schema | None) -> Decode | None:
    if encoding == "json":
        return json.loads
    modules = {"cdr": "mcap_ros2.decoder", "protobuf": "mcap_protobuf.decoder"}
    if encoding not in modules:
        return None
    return extra(modules[encoding]).DecoderFactory().decoder_for(encoding, schema)


def _flat(prefix: str, message: Any) -> dict[str, Any]:
    """The numbers and time stamps of a message by name."""
    fields = _fields(message)
    names = _names_of_entries(fields)
    out: dict[str, Any] = {}
    for name, value in fields.items():
        out |= _values(f"{prefix}{name}", value, names)
    return out


def _values(name: str, value: Any, names: Sequence[str]) -> dict[str, Any]:
    """The numbers and time stamps in a field; names: of its entries, where it has as many."""
    if isinstance(value, bool | int | float | np.number):
        return {name: float(value)}
    if _is_message(value):
        stamp = _stamp(_fields(value))
        return _flat(f"{name}.", value) if stamp is None else {name: stamp}
    if isinstance(value, str | bytes) or not hasattr(value, "__len__"):
        return {}
    out: dict[str, Any] = {}
    for k, entry in enumerate(value):
        called = names[k] if len(names) == len(value) else _name_of(entry)
        for key in (f"{name}[{k + 1}]", *((f"{name}.{called}",) if called else ())):
            out |= _values(key, entry, ())
    return out


def _is_message(value: Any) -> bool:
    if isinstance(value, Mapping):
        return True
    return not hasattr(value, "__len__") and (
        hasattr(value, "__slots__") or hasattr(value, "DESCRIPTOR")
    )


def _name_of(entry: Any) -> str | None:
    """The one text in a message of a list, such as the name of a joint."""
    if not _is_message(entry):
        return None
    texts = [value for value in _fields(entry).values() if isinstance(value, str)]
    return texts[0] if len(texts) == 1 and texts[0] else None


def _fields(message: Any) -> Mapping[str, Any]:
    if isinstance(message, Mapping):
        return message
    if hasattr(message, "DESCRIPTOR"):
        return {f.name: getattr(message, f.name) for f in message.DESCRIPTOR.fields}
    return {name: getattr(message, name) for name in getattr(message, "__slots__", ())}


def _names_of_entries(fields: Mapping[str, Any]) -> list[str]:
    """The one list of texts in a message; nothing where there is none."""
    for value in fields.values():
        if isinstance(value, str | bytes) or not hasattr(value, "__len__") or not len(value):
            continue
        if not isinstance(value, Mapping) and all(isinstance(v, str) for v in value):
            return list(value)
    return []


def _stamp(fields: Mapping[str, Any]) -> np.datetime64 | None:
    for seconds, rest in _STAMPS:
        if set(fields) == {seconds, rest}:
            return np.datetime64(int(fields[seconds]) * 10**9 + int(fields[rest]), "ns")
    return None
