"""How samples lie in a chunk: messages of fixed size, or rows of them, one of each channel.

A message record is opcode u1, length u8, channel u2, sequence u4, log_time u8, publish_time u8
(little-endian), then the payload: literal bytes and 8-byte values in turn. One packed NumPy
structure describes a message or a row, so a chunk is written and read column by column.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from mcap.opcode import Opcode
from numpy.typing import NDArray

from twin.logs.log import Array

Segments = tuple[bytes | str, ...]
"""A payload in order: literal bytes, and names that stand for a little-endian double each."""

# A column is an identifier, so no column can be called like one of these.
_HEAD = [
    (".opcode", "u1"),
    (".length", "<u8"),
    (".channel", "<u2"),
    (".sequence", "<u4"),
    (".log_time", "<u8"),
    (".publish_time", "<u8"),
]
_HEAD_IN_LENGTH = 22  # what the record's length counts of it: all but opcode and length
_VARYING = (".sequence", ".log_time", ".publish_time")


def sample_times(first: int, count: int, sample_rate: float) -> NDArray[np.int64]:
    """(count,) times in ns of the samples from number ``first``: round(k dt)."""
    k = np.arange(first, first + count, dtype=np.float64)
    return np.rint(k * 1e9 / sample_rate).astype(np.int64)


@dataclass(frozen=True)
class Block:
    """Consecutive samples of one channel.

    sequence, log_time (ns): (n,); columns: name -> (n,).
    """

    channel: int
    sequence: NDArray[np.uint32]
    log_time: NDArray[np.uint64]
    columns: Mapping[str, Array]


@dataclass(frozen=True)
class MessageLayout:
    """The message record of one channel."""

    channel: int
    segments: Segments

    @property
    def names(self) -> tuple[str, ...]:
        """Columns in the order of the payload."""
        return tuple(s for s in self.segments if isinstance(s, str))

    @cached_property
    def dtype(self) -> np.dtype:
        """Packed structure of the record."""
        payload = [
            (s, "<f8") if isinstance(s, str) else (f".literal{i}", *_literal(len(s)))
            for i, s in enumerate(self.segments)
        ]
        return np.dtype(_HEAD + payload)

    @cached_property
    def template(self) -> np.ndarray:
        """(1,) record with every constant filled in, everything else 0."""
        record = np.zeros(1, self.dtype)
        record[".opcode"] = Opcode.MESSAGE
        record[".length"] = self.dtype.itemsize - np.dtype(_HEAD).itemsize + _HEAD_IN_LENGTH
        record[".channel"] = self.channel
        for i, segment in enumerate(self.segments):
            if isinstance(segment, bytes):
                record[f".literal{i}"] = np.frombuffer(segment, _literal(len(segment))[0])
        return record

    def matches(self, records: np.ndarray) -> bool:
        """True where every record has this layout's opcode, length, channel and literals."""
        names = [n for n in self.dtype.names or () if n[0] == "." and n not in _VARYING]
        return all(bool((records[name] == self.template[name]).all()) for name in names)


def _literal(size: int) -> tuple[str, tuple[int, ...]]:
    """The type and shape of so many literal bytes: one number is compared faster than its bytes."""
    return (f"<u{size}", ()) if size in (1, 2, 4, 8) else ("u1", (size,))


@dataclass(frozen=True)
class RowLayout:
    """One message of each channel, in the order they are written for every sample."""

    messages: tuple[MessageLayout, ...]

    @cached_property
    def dtype(self) -> np.dtype:
        """Packed structure of a row; its fields are the message records "0", "1", ..."""
        return np.dtype([(str(i), m.dtype) for i, m in enumerate(self.messages)])

    def parts(self, rows: np.ndarray) -> Iterator[tuple[MessageLayout, np.ndarray]]:
        """Each message layout with its records, a view into ``rows``."""
        return ((m, rows[str(i)]) for i, m in enumerate(self.messages))

    def rows(self, data: bytes, offset: int) -> np.ndarray | None:
        """As many whole rows as ``data`` holds from ``offset``, or None where they differ."""
        count = (len(data) - offset) // self.dtype.itemsize
        if count == 0:
            return None
        rows = np.frombuffer(data, self.dtype, count, offset)
        return rows if all(m.matches(r) for m, r in self.parts(rows)) else None

    def blocks(self, rows: np.ndarray) -> Iterator[Block]:
        """The samples of each channel, as views into ``rows``."""
        for message, records in self.parts(rows):
            columns = {name: records[name] for name in message.names}
            yield Block(message.channel, records[".sequence"], records[".log_time"], columns)
