"""How payloads are read: protobuf messages of doubles with their schema, JSON, and flat CDR."""

from __future__ import annotations

import json
import re
import struct
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Protocol

from google.protobuf.descriptor_pb2 import (
    DescriptorProto,
    FieldDescriptorProto,
    FileDescriptorProto,
    FileDescriptorSet,
)
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message import DecodeError
from google.protobuf.message_factory import GetMessages
from mcap.records import Channel, Schema

from twin.errors import InputError
from twin.logs.container import Damaged
from twin.logs.layout import Segments
from twin.logs.log import FIELDS

AXIS_SAMPLE = "twin.AxisSample"
AXIS_TRUTH = "twin.AxisTruth"

_DOUBLE_ON_WIRE = 1
_NUMBERS = {
    getattr(FieldDescriptorProto, f"TYPE_{kind}")
    for kind in ("DOUBLE", "FLOAT", "INT32", "INT64", "UINT32", "UINT64", "SINT32", "SINT64")
}


class Codec(Protocol):
    """Reads the payloads of one channel."""

    fields: tuple[str, ...]

    def segments(self, payload: bytes) -> Segments | None:
        """The payload as literals and doubles, or None where it is not made of them alone."""

    def values(self, payload: bytes) -> Sequence[float]:
        """The value of each of ``fields``; raises Damaged or InputError."""


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
    for field, number in numbers.items():
        descriptor.field.add(
            name=field,
            number=number,
            type=FieldDescriptorProto.TYPE_DOUBLE,
            label=FieldDescriptorProto.LABEL_OPTIONAL,
        )
    return FileDescriptorSet(file=[file]).SerializeToString(deterministic=True)


def protobuf_segments(numbers: Mapping[str, int]) -> Segments:
    """A payload that holds every field, also those that are 0, in the order given."""
    return tuple(s for name, n in numbers.items() for s in (_varint(n << 3 | 1), name))


class ProtobufCodec:
    """Messages of a protobuf schema; ``fields`` are its singular numbers."""

    def __init__(self, message: str, descriptor_set: bytes) -> None:
        try:
            files = FileDescriptorSet.FromString(descriptor_set).file
            self._message = GetMessages(files, DescriptorPool())[message]
        except (DecodeError, TypeError, KeyError, ValueError) as error:
            raise InputError(f"the protobuf schema {message!r} cannot be used") from error
        descriptor = DescriptorProto()
        self._message.DESCRIPTOR.CopyToProto(descriptor)
        numbers = _numbers(descriptor.field)
        self.fields = tuple(f.name for f in numbers)
        self._doubles = {
            f.number: f.name for f in numbers if f.type == FieldDescriptorProto.TYPE_DOUBLE
        }

    def segments(self, payload: bytes) -> Segments | None:
        """See Codec. A field may be missing: it is 0."""
        segments: list[bytes | str] = []
        position = 0
        while position < len(payload):
            tag, end = _read_varint(payload, position)
            name = self._doubles.get(tag >> 3)
            if tag & 7 != _DOUBLE_ON_WIRE or name is None or name in segments:
                return None
            segments += [payload[position:end], name]
            position = end + 8
        return tuple(segments) if position == len(payload) else None

    def values(self, payload: bytes) -> list[float]:
        """See Codec."""
        try:
            message = self._message.FromString(payload)
        except DecodeError as error:
            raise Damaged("a message is not valid protobuf") from error
        return [float(getattr(message, field)) for field in self.fields]


def _numbers(fields: Iterable[FieldDescriptorProto]) -> list[FieldDescriptorProto]:
    repeated = FieldDescriptorProto.LABEL_REPEATED
    return [f for f in fields if f.type in _NUMBERS and f.label != repeated]


def _varint(value: int) -> bytes:
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    out.append(value)
    return bytes(out)


def _read_varint(data: bytes, position: int) -> tuple[int, int]:
    value = shift = 0
    while position < len(data):
        byte = data[position]
        value |= (byte & 0x7F) << shift
        position, shift = position + 1, shift + 7
        if byte < 0x80:
            break
    return value, position


_ENCAPSULATION = 4  # bytes before the first CDR value: representation and options


def open_codec(channel: Channel, schema: Schema | None, payload: bytes) -> Codec:
    """Codec of a channel whose first payload is given; raises InputError where there is none."""
    match channel.message_encoding, schema:
        case "protobuf", Schema(encoding="protobuf"):
            return ProtobufCodec(schema.name, schema.data)
        case "json", _:
            return JsonCodec(payload)
        case "cdr", Schema(encoding="ros2msg"):
            return CdrCodec(schema, r"float64\s+(\w+)", "\n")
        case "cdr", Schema(encoding="ros2idl"):
            return CdrCodec(schema, r"double\s+(\w+)", ";")
    raise InputError(
        f"messages are encoded as {channel.message_encoding!r} with "
        f"{schema.encoding if schema else 'no'!r} schema; protobuf, json and cdr "
        "(ros2msg, ros2idl) are read; convert the log with: twin import"
    )


class JsonCodec:
    """JSON objects; the numbers of the first one are the fields of all."""

    def __init__(self, payload: bytes) -> None:
        first = self._load(payload)
        self.fields = tuple(k for k, v in first.items() if type(v) in (int, float))

    def segments(self, payload: bytes) -> Segments | None:
        """See Codec: text has no fixed layout."""
        return None

    def values(self, payload: bytes) -> list[float]:
        """See Codec."""
        message = self._load(payload)
        try:
            return [float(message[field]) for field in self.fields]
        except KeyError as error:
            raise InputError(f"a JSON message has no {error}; write every field") from error
        except (TypeError, ValueError, OverflowError) as error:
            raise InputError("a JSON message has a field that is no number") from error

    @staticmethod
    def _load(payload: bytes) -> dict[str, Any]:
        try:
            message = json.loads(payload)
        except (ValueError, RecursionError) as error:
            raise Damaged("a message is not valid JSON") from error
        if not isinstance(message, dict):
            raise InputError("a JSON message is not an object of named numbers")
        return message


class CdrCodec:
    """CDR structures that hold doubles and nothing else."""

    def __init__(self, schema: Schema, member: str, separator: str) -> None:
        text = re.sub(r"//.*|#.*", "", schema.data.decode(errors="replace"))
        if separator == ";":
            text = text[text.rfind("{") + 1 :].partition("}")[0]
        members = [m.strip() for m in text.split(separator) if m.strip()]
        matches = [re.fullmatch(member, m) for m in members]
        if not members or not all(matches):
            raise InputError(
                f"the CDR message {schema.name!r} does not consist of float64 fields alone; "
                "convert the log with: twin import"
            )
        self.fields = tuple(m[1] for m in matches if m)

    def segments(self, payload: bytes) -> Segments | None:
        """See Codec."""
        self._check(payload)
        return (payload[:_ENCAPSULATION], *self.fields) if payload[1] & 1 else None

    def values(self, payload: bytes) -> Sequence[float]:
        """See Codec."""
        self._check(payload)
        order = "<" if payload[1] & 1 else ">"
        return struct.unpack_from(f"{order}{len(self.fields)}d", payload, _ENCAPSULATION)

    def _check(self, payload: bytes) -> None:
        expected = _ENCAPSULATION + 8 * len(self.fields)
        if len(payload) != expected:
            raise Damaged(f"a CDR message has {len(payload)} bytes where {expected} are expected")
