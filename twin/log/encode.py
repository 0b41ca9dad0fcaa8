"""Log -> MCAP: chunks laid out by NumPy, every index and checksum written, all or nothing."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from twin.files import replacing
from twin.log.assemble import METADATA_NAME
from twin.log.layout import sample_times
from twin.log.log import Array, Log
from twin.log.outline import Outline, outline, outline_of_topics
from twin.log.writer import McapWriter, PackedChunk, encoded, pack

CHUNK_BYTES = 1 << 20
WORKERS = 2

T = TypeVar("T")

Progress = Callable[[int, int], None]
"""Called with the samples written so far and their total."""


def write_log(log: Log, path: str | Path, progress: Progress | None = None) -> None:
    """Write ``log`` as MCAP; the same log gives the same bytes.

    ``path`` appears only when it is complete. Raises InputError for a log that could not be read
    back (a NaN, columns of different length, no position, ...) and where writing fails.
    """
    _write(outline(log), log.sample_rate, log.attachments, Path(path), progress)


def write_topics(
    topics: Mapping[str, Mapping[str, Array]],
    units: Mapping[str, str],
    sample_rate: float,
    path: str | Path,
) -> None:
    """Write columns (n,) of any topics, "/model/x" -> name -> column, for other programs to show.

    units: "/model/x/force" -> unit. Raises InputError as write_log does.
    """
    _write(outline_of_topics(topics, units, sample_rate), sample_rate, {}, Path(path), None)


def _write(
    plan: Outline,
    sample_rate: float,
    attachments: Mapping[str, bytes],
    path: Path,
    progress: Progress | None,
) -> None:
    with replacing(path) as stream:
        writer = McapWriter(stream)
        writer.add_metadata(METADATA_NAME, plan.metadata)
        for name, data in attachments.items():
            writer.add_attachment(name, data)
        for written in _write_chunks(writer, plan, sample_rate):
            if progress is not None:
                progress(written, plan.count)
        writer.finish(plan.schemas, plan.channels)


def _write_chunks(writer: McapWriter, plan: Outline, sample_rate: float) -> Iterator[int]:
    """Write all samples; yields the number written after each chunk.

    Every chunk begins with all schemas and channels: any one of them can be read alone.
    """
    head = encoded([*plan.schemas, *plan.channels])
    most = max(1, CHUNK_BYTES // plan.layout.dtype.itemsize)

    def chunk(first: int) -> PackedChunk:
        times = sample_times(first, min(most, plan.count - first), sample_rate)
        return _pack_rows(plan, head, first, times)

    written = 0
    for packed in _ordered(chunk, range(0, plan.count, most)):
        writer.add_chunk(packed)
        written += len(packed.times)
        yield written


def _pack_rows(plan: Outline, head: bytes, first: int, times: NDArray[np.int64]) -> PackedChunk:
    size = plan.layout.dtype.itemsize
    buffer = np.empty(len(head) + len(times) * size, np.uint8)
    buffer[: len(head)] = np.frombuffer(head, np.uint8)
    rows = buffer[len(head) :].view(plan.layout.dtype)
    plan.layout.fill_constants(rows)
    _fill(rows, plan, first, times)
    row_starts = len(head) + size * np.arange(len(times))
    offsets = {m.channel: row_starts + o for m, o in plan.layout.offsets()}
    return pack(buffer.data, times, offsets)


def _ordered(function: Callable[[int], T], items: Iterable[int]) -> Iterator[T]:
    """Results in the order of ``items``, a few of them computed ahead on other threads."""
    with ThreadPoolExecutor(WORKERS) as pool:
        pending: deque[Future[T]] = deque()
        for item in items:
            pending.append(pool.submit(function, item))
            if len(pending) > WORKERS:
                yield pending.popleft().result()
        while pending:
            yield pending.popleft().result()


def _fill(rows: np.ndarray, plan: Outline, first: int, times: np.ndarray) -> None:
    span = slice(first, first + len(rows))
    for (_, records), columns in zip(plan.layout.parts(rows), plan.columns, strict=True):
        records[".sequence"] = np.arange(span.start, span.stop)
        records[".log_time"] = records[".publish_time"] = times
        for name, column in columns.items():
            records[name] = column[span]
