"""A log whose every column is distinct, as written bytes, and what those hold."""

import numpy as np
import zstandard
from mcap.records import (
    Chunk,
    Message,
)
from mcap_bytes import (
    CHUNK,
    MESSAGE,
    parsed,
    parsed_message,
    pieces,
    records,
)

from twin.logs import FIELDS, AxisLog, Log

RATE, COUNT = 3000.0, 45
TRUTH = tuple(f"state{k}" for k in range(18))


def distinct(name: str, axis: str) -> np.ndarray:
    """A column whose values occur in no other column."""
    number = 100.0 * (1 + (*FIELDS, *TRUTH).index(name)) + 10_000.0 * (1 + "xyzt".index(axis))
    return number + np.arange(COUNT) / 64.0


LOG = Log(
    RATE,
    {
        "x": AxisLog({f: distinct(f, "x") for f in FIELDS}, force_constant=7.25),
        "y": AxisLog({f: distinct(f, "y") for f in ("position", "current")}, force_constant=3.5),
        "z": AxisLog({f: distinct(f, "z") for f in ("position", "current")}, force_constant=2.0),
    },
    {"source": "a test"},
    {"x": {f: distinct(f, "t") for f in TRUTH}},
    {"model.toml": b"mass = 1\n", "stage.xml": b"<mujoco/>", "raw": bytes(range(200))},
)
FIRST_NUMBER = 1 << 18  # of the fields: their tags have four bytes
ROW = (31 + 7 * 12) + 2 * (31 + 2 * 12) + (31 + 18 * 12)  # bytes of a sample on four topics
PER_CHUNK = 7


def of(data: bytes, opcode: int):
    return [p for p in records(data) if p.opcode == opcode]


def payload(chunk: Chunk) -> bytes:
    return zstandard.ZstdDecompressor().decompress(chunk.data)


def in_chunks(data: bytes) -> list[list]:
    """(record, bytes) of every chunk's content, chunk by chunk."""
    contents = [payload(parsed(Chunk, p)) for p in of(data, CHUNK)]
    return [pieces(content, 0, len(content)) for content in contents]


def messages(data: bytes) -> dict[int, list[Message]]:
    found: dict[int, list[Message]] = {}
    for chunk in in_chunks(data):
        for piece in chunk:
            if piece.opcode == MESSAGE:
                message = parsed_message(piece)
                found.setdefault(message.channel_id, []).append(message)
    return found
