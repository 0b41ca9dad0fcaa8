"""Protobuf messages of doubles: the schema stored in the file, and how a payload is read."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Protocol

from google.protobuf.descriptor_pb2 import (
    DescriptorProto,
    FieldDescriptorProto,
    FileDescriptorProto,
    FileDescriptorSet,
)
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message import DecodeError
from google.protobuf.message_factory import GetMessages

from twin.errors import InputError
from twin.log.container import Damaged
from twin.log.layout import Segments
from twin.log.log import FIELDS

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
