"""Log -> MCAP: chunks laid out by NumPy, every index and checksum written, all or nothing."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

import numpy as np

from twin.errors import InputError
from twin.log.layout import sample_times
from twin.log.log import Log
from twin.log.outline import Outline, outline
from twin.log.writer import McapWriter, encoded

CHUNK_BYTES = 1 << 20

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
        for written in _write_chunks(writer, plan, log.sample_rate):
            if progress is not None:
                progress(written, plan.count)
        writer.finish(plan.schemas, plan.channels)


def _write_chunks(writer: McapWriter, plan: Outline, sample_rate: float) -> Iterator[int]:
    """Write all samples; yields the number written after each chunk.

    Every chunk begins with all schemas and channels: any one of them can be read alone.
    """
    head = encoded([*plan.schemas, *plan.channels])
    size = plan.layout.dtype.itemsize
    most = min(max(1, CHUNK_BYTES // size), plan.count)
    buffer = np.empty(len(head) + most * size, np.uint8)
    buffer[: len(head)] = np.frombuffer(head, np.uint8)
    rows = buffer[len(head) :].view(plan.layout.dtype)
    plan.layout.fill_constants(rows)
    for first in range(0, plan.count, most):
        count = min(most, plan.count - first)
        times = sample_times(first, count, sample_rate)
        _fill(rows[:count], plan, first, times)
        row_starts = len(head) + size * np.arange(count)
        offsets = {
            message.channel: row_starts + plan.layout.offset(i)
            for i, message in enumerate(plan.layout.messages)
        }
        writer.add_chunk(buffer[: len(head) + count * size].data, times, offsets)
        yield first + count


def _fill(rows: np.ndarray, plan: Outline, first: int, times: np.ndarray) -> None:
    span = slice(first, first + len(rows))
    for (_, records), columns in zip(plan.layout.parts(rows), plan.columns, strict=True):
        records[".sequence"] = np.arange(span.start, span.stop)
        records[".log_time"] = records[".publish_time"] = times
        for name, column in columns.items():
            records[name] = column[span]


@contextmanager
def replacing(path: Path) -> Iterator[BinaryIO]:
    """A stream whose bytes become ``path`` at the end, or nothing where anything fails.

    Raises InputError where the folder or the disk refuses.
    """
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        with open(part, "wb") as stream:
            yield stream
        os.replace(part, path)
    except OSError as error:
        raise InputError(
            f"{path}: cannot be written: {error.strerror}; check folder, rights and free space"
        ) from error
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)
