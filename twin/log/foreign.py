"""Payloads of other writers: JSON, and CDR of flat ROS 2 messages of doubles."""

from __future__ import annotations

import json
import re
import struct
from collections.abc import Sequence
from typing import Any

from mcap.records import Channel, Schema

from twin.errors import InputError
from twin.log.container import Damaged
from twin.log.layout import Segments
from twin.log.schema import Codec, ProtobufCodec

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
