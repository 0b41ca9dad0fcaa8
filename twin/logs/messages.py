"""Messages of doubles in protobuf, as they lie in a chunk: all of a topic have the same size.

A message record is opcode u1, length u8, channel u2, sequence u4, log_time u8, publish_time u8
(little-endian), then the payload: for each field its tag and 8 bytes. Every field is written, also
those that are 0, in the order of the schema. So one packed NumPy structure describes a message, or
a row of one of each channel, and a chunk is written and read column by column.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from google.protobuf.descriptor_pb2 import FieldDescriptorProto as Field
from google.protobuf.descriptor_pb2 import FileDescriptorProto, FileDescriptorSet
from google.protobuf.message import DecodeError
from mcap.opcode import Opcode
from mcap.records import Channel, Schema
from numpy.typing import NDArray

from twin.errors import InputError
from twin.logs.log import FIELDS, Array

AXIS_SAMPLE = "twin.AxisSample"
AXIS_TRUTH = "twin.AxisTruth"


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
        kind, label = Field.TYPE_DOUBLE, Field.LABEL_OPTIONAL
        descriptor.field.add(name=field, number=number, type=kind, label=label)
    return FileDescriptorSet(file=[file]).SerializeToString(deterministic=True)


def field_numbers(channel: Channel, schema: Schema | None) -> dict[str, int]:
    """Name -> number of the doubles in a channel's messages; InputError for anything else."""
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
    fields = found[0].field if found else ()
    doubles = [f for f in fields if f.type == Field.TYPE_DOUBLE and f.name.isidentifier()]
    numbers = {f.name: f.number for f in doubles if f.number > 0}
    if not found or len(numbers) != len(fields):
        raise InputError(
            f"the protobuf schema {schema.name!r} is not of doubles alone; convert the log with: "
            "twin import"
        )
    return numbers


def tag(number: int) -> bytes:
    """The bytes before the double of a field: 7 bits each, the low ones first."""
    double_on_wire = 1  # the type of a field, in the low three bits of its tag
    value, out = number << 3 | double_on_wire, bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes([*out, value])


# A column is an identifier, so no column can be called like one of these.
_HEAD = [
    (".opcode", "u1"),
    (".length", "<u8"),
    (".channel", "<u2"),
    (".sequence", "<u4"),
    (".log_time", "<u8"),
    (".publish_time", "<u8"),
]
_VARYING = (".sequence", ".log_time", ".publish_time")


def sample_times(first: int, count: int, sample_rate: float) -> NDArray[np.int64]:
    """(count,) times in ns of the samples from number ``first``: round(k dt)."""
    k = np.arange(first, first + count, dtype=np.float64)
    return np.rint(k * 1e9 / sample_rate).astype(np.int64)


@dataclass(frozen=True)
class Block:
    """Consecutive samples of one channel: sequence, log_time (ns) and columns by name, (n,)."""

    channel: int
    sequence: NDArray[np.uint32]
    log_time: NDArray[np.uint64]
    columns: Mapping[str, Array]


@dataclass(frozen=True)
class MessageLayout:
    """The message record of one channel; numbers: field -> its number, in the order written."""

    channel: int
    numbers: Mapping[str, int]

    @cached_property
    def dtype(self) -> np.dtype:
        """Packed structure of the record; the tag of a field is called "field.tag"."""
        payload = []
        for name, number in self.numbers.items():
            size = len(tag(number))
            # one number is compared faster than its bytes
            of_tag = f"<u{size}" if size in (1, 2, 4) else f"V{size}"
            payload += [(f"{name}.tag", of_tag), (name, "<f8")]
        return np.dtype(_HEAD + payload)

    @cached_property
    def template(self) -> np.ndarray:
        """(1,) record with every constant filled in, everything else 0."""
        record = np.zeros(1, self.dtype)
        record[".opcode"] = Opcode.MESSAGE
        outside_length = 9  # opcode and length, which the record's length does not count
        record[".length"] = self.dtype.itemsize - outside_length
        record[".channel"] = self.channel
        for name, number in self.numbers.items():
            record[f"{name}.tag"] = np.frombuffer(tag(number), self.dtype[f"{name}.tag"])
        return record


def blocks_of(layouts: Sequence[MessageLayout], data: bytes, offset: int) -> list[Block] | None:
    """The samples from ``offset`` on, as views; None unless they are rows of every channel."""
    row = np.dtype([(str(layout.channel), layout.dtype) for layout in layouts])
    count, rest = divmod(len(data) - offset, row.itemsize)
    if rest:
        return None
    rows = np.frombuffer(data, row, count, offset)
    blocks = []
    for layout in layouts:
        records = rows[str(layout.channel)]
        fixed = [n for n in layout.dtype.names or () if "." in n and n not in _VARYING]
        if not all((records[name] == layout.template[name]).all() for name in fixed):
            return None
        columns = {name: records[name] for name in layout.numbers}
        blocks.append(Block(layout.channel, records[".sequence"], records[".log_time"], columns))
    return blocks
