"""The samples of one topic as they arrive, block by block, and the times that they must have."""

from __future__ import annotations

from collections.abc import Collection
from datetime import UTC, datetime

import numpy as np

from twin.errors import InputError
from twin.logs.layout import Block, sample_times
from twin.logs.log import Array
from twin.logs.topics import Topic
from twin.numbers import first_not_finite

EARLIEST, LATEST = 5e8, 5e9  # s since 1970, between which a time is that of a calendar


def is_calendar(seconds: float) -> bool:
    """Whether a time in s counts since 1970."""
    return EARLIEST < seconds < LATEST


def seconds(nanoseconds: float) -> str:
    """A time in ns for a message."""
    if is_calendar(nanoseconds * 1e-9):
        whole, rest = divmod(round(nanoseconds), 10**9)
        day = datetime.fromtimestamp(whole, UTC).strftime("%Y-%m-%d %H:%M:%S")
        fraction = f".{rest:09d}".rstrip("0").rstrip(".")
        return f"{day}{fraction} UTC"
    return f"{nanoseconds * 1e-9:.9f}".rstrip("0").rstrip(".") + " s"


def instant(time: float) -> str:
    """A time in s for a message, to the microsecond where it counts since 1970."""
    return seconds(round(time * 1e6) * 1000) if is_calendar(time) else f"{time:.9g} s"


ROUNDING = 2.0  # ns: how far a time may be off that of its number, of which both are rounded
LATEST_TIME = 1 << 62  # ns


class Series:
    """Columns of one topic; ``append`` refuses what is not evenly spaced and finite.

    capacity: samples expected; more are taken too. wanted: the fields that are kept, None for all.
    start: time of the first sample in ns; ``count`` samples were taken; rate in Hz.
    """

    def __init__(self, topic: Topic, capacity: int, wanted: Collection[str] | None = None) -> None:
        self.topic = topic
        self.rate = topic.sample_rate
        self.start = 0
        self.count = 0
        self._first_sequence = 0
        fields = [f for f in topic.fields if wanted is None or f in wanted]
        self._columns = {name: np.empty(capacity) for name in fields}

    def append(self, block: Block) -> None:
        """Take the next samples; raises InputError for a gap, a NaN or a time out of place."""
        if self.count == 0:
            self.start = int(block.log_time[0])
            self._first_sequence = int(block.sequence[0])
        first = self._first_sequence + self.count
        require_even(self.topic.name, block, first, self.start, self.count, self.rate)
        self._reserve(len(block.log_time))
        span = slice(self.count, self.count + len(block.log_time))
        for name, column in self._columns.items():
            column[span] = block.columns[name]
            require_finite(self.topic.name, block, name, self.count)
        self.count += len(block.log_time)

    def require_behind(self, before: Series) -> None:
        """Raise InputError where there is a gap behind the samples of the part before."""
        end = before.start + int(sample_times(before.count, 1, before.rate)[0])
        if abs(self.start - end) > ROUNDING:
            last = before.start + int(sample_times(before.count - 1, 1, before.rate)[0])
            raise _misplaced(self.topic.name, 0, last, self.start, self.rate)

    def columns(self, span: slice) -> dict[str, Array]:
        """The samples in ``span`` of every field; releases the buffers."""
        out = {}
        for name in list(self._columns):
            column = self._columns.pop(name)
            part = column[span]
            out[name] = part if len(part) == len(column) else part.copy()
        return out

    def _reserve(self, more: int) -> None:
        need = self.count + more
        for name, column in self._columns.items():
            if need > len(column):
                grown = np.empty(max(need, 2 * len(column)))
                grown[: self.count] = column[: self.count]
                self._columns[name] = grown


def require_even(
    name: str, block: Block, sequence: int, start: int, count: int, rate: float
) -> None:
    """Raise InputError where samples of a topic are not those behind ``count`` others.

    sequence: number that their first must have; start: time of the topic's first sample in ns;
    rate: Hz.
    """
    expected = np.arange(sequence, sequence + len(block.sequence)).astype(np.uint32)
    wrong = block.sequence != expected
    if wrong.any():
        i = int(np.argmax(wrong))
        raise InputError(
            f"{name}: message {count + i} has sequence number {block.sequence[i]}, "
            f"expected {expected[i]}: messages are missing or out of order"
        )
    time = block.log_time.astype(np.int64)
    if time.min() < 0:
        latest = int(block.log_time.max())
        raise InputError(f"{name}: a message has the time {latest} ns, which no clock shows")
    last = (count + len(expected)) * 1e9 / rate
    if not last < LATEST_TIME:
        raise InputError(f"{name}: at {rate:g} Hz {len(expected)} samples would last {last:g} ns")
    elapsed = time - start
    times = sample_times(count, len(elapsed), rate)
    off = np.abs(elapsed - times) > ROUNDING
    if off.any():
        i = int(np.argmax(off))
        before = int(elapsed[i - 1]) if i else times[0] - 1e9 / rate
        raise _misplaced(name, count + i, start + before, start + int(elapsed[i]), rate)


def _misplaced(name: str, sample: int, before: float, time: float, rate: float) -> InputError:
    """The error for a sample whose time (ns) is not a period behind that of the one before."""
    period = 1e9 / rate
    times = f"{seconds(before)} is followed by {seconds(time)}"
    if time <= before:
        fault = f"time does not increase: {times}"
    elif time - before > 1.5 * period:
        fault = f"gap: {times}"
    else:
        fault = f"uneven time: {times}"
    return InputError(
        f"{name}: {fault} at sample {sample}, expected a sample every "
        f"{period / 1e9:.9g} s ({rate:.9g} Hz); keep the longest even part with: twin recover, or "
        "convert the log with: twin import"
    )


def require_finite(topic: str, block: Block, name: str, count: int) -> None:
    """Raise InputError where a column of the samples behind ``count`` others is not a number."""
    column = block.columns[name]
    if (i := first_not_finite(column)) is not None:
        raise InputError(
            f"{topic}: {name} is {column[i]} at {seconds(float(block.log_time[i]))} "
            f"(sample {count + i}); leave out a signal that was not recorded, "
            "or keep the longest part without it with: twin recover"
        )
