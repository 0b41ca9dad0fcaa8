"""Protobuf messages of doubles: the schema stored in the file, and the order in a payload."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from google.protobuf.descriptor_pb2 import (
    FieldDescriptorProto,
    FileDescriptorProto,
    FileDescriptorSet,
)
from google.protobuf.message import DecodeError
from mcap.records import Channel, Schema

from twin.errors import InputError
from twin.logs.layout import Segments
from twin.logs.log import FIELDS

AXIS_SAMPLE = "twin.AxisSample"
AXIS_TRUTH = "twin.AxisTruth"

_DOUBLE_ON_WIRE = 1


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


def fields_of(channel: Channel, schema: Schema | None) -> dict[int, str]:
    """The doubles of a channel's messages, by number; raises InputError where there are others."""
    if schema is None or (channel.message_encoding, schema.encoding) != ("protobuf", "protobuf"):
        raise InputError(
            f"messages are encoded as {channel.message_encoding!r} with "
            f"{schema.encoding if schema else 'no'!r} schema; only logs of this program are read, "
            "in protobuf; convert the log with: twin import"
        )
    try:
        files = FileDescriptorSet.FromString(schema.data).file
    except DecodeError as error:
        raise InputError(f"the protobuf schema {schema.name!r} cannot be used") from error
    found = [m for f in files for m in f.message_type if f"{f.package}.{m.name}" == schema.name]
    if not found or any(f.type != FieldDescriptorProto.TYPE_DOUBLE for f in found[0].field):
        raise InputError(
            f"the protobuf schema {schema.name!r} is not of doubles alone; convert the log with: "
            "twin import"
        )
    return {field.number: field.name for field in found[0].field}


def segments_of(payload: bytes, fields: Mapping[int, str]) -> Segments | None:
    """A payload as tags and doubles; None where it is not each of the fields once."""
    segments: list[bytes | str] = []
    position = 0
    while position < len(payload):
        tag, end = _read_varint(payload, position)
        name = fields.get(tag >> 3)
        if tag & 7 != _DOUBLE_ON_WIRE or name is None or name in segments:
            return None
        segments += [payload[position:end], name]
        position = end + 8
    whole = position == len(payload) and len(segments) == 2 * len(fields)
    return tuple(segments) if whole else None


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
