"""Log -> MCAP: chunks laid out by NumPy, every index and checksum written, all or nothing."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

import numpy as np
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, ChunkIndex, McapRecord, Schema

from twin.errors import InputError
from twin.log.layout import MessageLayout, RowLayout, sample_times
from twin.log.log import Log
from twin.log.outline import Outline, outline
from twin.log.writer import McapWriter, encoded

CHUNK_BYTES = 1 << 20
COMPRESSION_LEVEL = 3

Progress = Callable[[int, int], None]
"""Called with the samples written so far and their total."""


def write_log(log: Log, path: str | Path, progress: Progress | None = None) -> None:
    """Write ``log`` as MCAP; the same log gives the same bytes.

    ``path`` appears only when it is complete. Raises InputError for a log that could not be read
    back (a NaN, columns of different length, no position, ...) and where writing fails.
    """
    plan = outline(log)
    with replacing(Path(path)) as stream:
        writer = McapWriter(stream)
        writer.add_metadata("twin", plan.metadata)
        for name, data in log.attachments.items():
            writer.add_attachment(name, data)
        for end in _write_chunks(writer, plan, log.sample_rate):
            if progress is not None:
                progress(end, plan.count)
        writer.finish(plan.schemas, plan.channels, plan.count, sample_times(plan.count-1, 1, log.sample_rate))
