"""Log -> MCAP: chunks laid out by NumPy, every index and checksum written, all or nothing."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from itertools import chain
from pathlib import Path
from typing import BinaryIO, TypeVar

import numpy as np

from twin.files import recording, replacing
from twin.log.assemble import CHECKSUM, METADATA_NAME, checksum
from twin.log.layout import sample_times
from twin.log.log import Array, Log
from twin.log.outline import (
    Outline,
    Planned,
    Samples,
    outline,
    outline_of_topics,
    samples_of,
)
from twin.log.writer import McapWriter, PackedChunk, encoded, pack

CHUNK_BYTES = 1 << 20
WORKERS = 2

S = TypeVar("S")
T = TypeVar("T")

Progress = Callable[[int, int], None]
"""Called with the samples written so far and their total."""


def write_log(log: Log, path: str | Path, progress: Progress | None = None) -> None:
    """Write ``log`` as MCAP; the same log gives the same bytes.

    ``path`` appears only when it is complete. Raises InputError for a log that could not be read
    back (a NaN, columns of different length, no position, ...) and where writing fails.
    """
    plan, samples = outline(log), samples_of(log)
    with replacing(Path(path)) as stream:
        for written in _written(stream, plan, [samples], log.sample_rate, log.attachments):
            if progress is not None:
                progress(written, len(log))


def record_log(parts: Iterable[Log], path: str | Path) -> int:
    """Write a log part by part while it is being recorded; returns the number of samples.

    The parts follow each other without a gap. The bytes are those that ``write_log`` writes of the
    whole. ``path`` appears only when it is complete; until then the file is called
    ``path.unfinished``, and what a killed run leaves of it can be recovered up to the last chunk.
    Raises InputError as write_log does.
    """
    with recording(Path(path)) as stream:
        return _recorded(stream, parts)


def write_parts(parts: Iterable[Log], path: str | Path) -> int:
    """``record_log`` for what is there already: nothing is left of it where it is not finished."""
    with replacing(Path(path)) as stream:
        return _recorded(stream, parts)


def _recorded(stream: BinaryIO, parts: Iterable[Log]) -> int:
    coming = iter(parts)
    first = next(coming)
    samples = _counted(chain([first], coming))
    written = _written(stream, outline(first), samples, first.sample_rate, first.attachments)
    return deque(written, maxlen=1).pop()


def write_topics(
    topics: Mapping[str, Mapping[str, Array]],
    units: Mapping[str, str],
    sample_rate: float,
    path: str | Path,
) -> None:
    """Write columns (n,) of any topics, "/model/x" -> name -> column, for other programs to show.

    units: "/model/x/force" -> unit. Raises InputError as write_log does.
    """
    plan, samples = outline_of_topics(topics, units, sample_rate)
    with replacing(Path(path)) as stream:
        for _ in _written(stream, plan, [samples], sample_rate, {}):
            pass


def _counted(parts: Iterable[Log]) -> Iterator[Samples]:
    """The samples of parts that follow each other."""
    first = 0
    for part in parts:
        yield samples_of(part, first)
        first += len(part)


def _written(
    stream: BinaryIO,
    plan: Outline,
    parts: Iterable[Samples],
    sample_rate: float,
    attachments: Mapping[str, bytes],
) -> Iterator[int]:
    """Write a whole file; yields the number of samples written after each stretch of them.

    Of a stretch every topic has a chunk of its own, so that one can be read without the others.
    Every chunk begins with its schema and channel: any one of them can be read alone.
    """
    writer = McapWriter(stream)
    proof = {CHECKSUM: checksum(plan.metadata)}
    writer.add_metadata(METADATA_NAME, {**plan.metadata, **proof})
    for name, data in attachments.items():
        writer.add_attachment(name, data)
    most = max(1, CHUNK_BYTES // plan.row_bytes)
    stretches = _in_chunks(parts, most)
    # The axes come last, so that what a killed run leaves of a stretch is seldom some axes alone.
    chunks = (
        (topic, first, columns)
        for first, samples in stretches
        for topic, columns in reversed(list(zip(plan.topics, samples, strict=True)))
    )

    def chunk(item: tuple[Planned, int, Mapping[str, Array]]) -> PackedChunk:
        return _packed(*item, sample_rate)

    written = 0
    for packed in _ordered(chunk, chunks):
        writer.add_chunk(packed)
        if packed.channel == plan.topics[0].channel.id:
            written += len(packed.times)
            yield written
    writer.finish(plan.schemas, [topic.channel for topic in plan.topics])


def _in_chunks(parts: Iterable[Samples], most: int) -> Iterator[tuple[int, Samples]]:
    """The samples in chunks of ``most``, each with the number of its first; the last is shorter."""
    first, held = 0, None
    for part in parts:
        samples = part if held is None else _behind(held, part)
        whole = _count(samples) // most * most
        for start in range(0, whole, most):
            yield first + start, _cut(samples, start, start + most)
        first += whole
        held = _cut(samples, whole, _count(samples))
    if held is not None and _count(held):
        yield first, held


def _count(samples: Samples) -> int:
    return len(next(iter(samples[0].values())))


def _cut(samples: Samples, start: int, stop: int) -> Samples:
    return tuple({name: c[start:stop] for name, c in columns.items()} for columns in samples)


def _behind(before: Samples, after: Samples) -> Samples:
    return tuple(
        {name: np.concatenate([column, new[name]]) for name, column in columns.items()}
        for columns, new in zip(before, after, strict=True)
    )


def _packed(
    topic: Planned, first: int, columns: Mapping[str, Array], sample_rate: float
) -> PackedChunk:
    """The chunk of a topic's samples from number ``first`` on."""
    head, layout = encoded([topic.schema, topic.channel]), topic.layout
    times = sample_times(first, len(next(iter(columns.values()))), sample_rate)
    size = layout.dtype.itemsize
    buffer = np.empty(len(head) + len(times) * size, np.uint8)
    buffer[: len(head)] = np.frombuffer(head, np.uint8)
    messages = buffer[len(head) :].view(layout.dtype)
    messages[:] = layout.template
    messages[".sequence"] = np.arange(first, first + len(messages))
    messages[".log_time"] = messages[".publish_time"] = times
    for name, column in columns.items():
        messages[name] = column
    offsets = len(head) + size * np.arange(len(times))
    return pack(buffer.data, times, topic.channel.id, offsets)


def _ordered(function: Callable[[S], T], items: Iterable[S]) -> Iterator[T]:
    """Results in the order of ``items``, a few of them computed ahead on other threads."""
    with ThreadPoolExecutor(WORKERS) as pool:
        pending: deque[Future[T]] = deque()
        for item in items:
            pending.append(pool.submit(function, item))
            if len(pending) > WORKERS:
                yield pending.popleft().result()
        while pending:
            yield pending.popleft().result()
