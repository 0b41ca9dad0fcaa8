"""The samples of one topic as they arrive, block by block, and the times that they must have."""

from __future__ import annotations

from collections.abc import Collection
from datetime import UTC, datetime

import numpy as np

from twin.errors import InputError
from twin.logs.log import Array
from twin.logs.messages import Block, sample_times
from twin.logs.topics import Topic
from twin.numbers import first_not_finite


def is_calendar(seconds: float) -> bool:
    """Whether a time in s counts since 1970."""
    earliest, latest = 5e8, 5e9  # s since 1970, between which a time is that of a calendar
    return earliest < seconds < latest


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


class Series:
    """Columns of one topic; ``append`` refuses what is not evenly spaced and finite.

    capacity: samples expected at once; more are taken too. wanted: the fields that are kept, None
    for all. start: time of the first sample in ns; ``count`` samples were taken, of which the last
    ``held`` are in the columns; rate in Hz.
    """

    def __init__(self, topic: Topic, capacity: int, wanted: Collection[str] | None = None) -> None:
        self.topic = topic
        self.rate = topic.sample_rate
        self.start = self.count = self.held = 0
        self._first_sequence = 0
        self._capacity = capacity
        self._fields = [f for f in topic.fields if wanted is None or f in wanted]
        self._columns: dict[str, Array] = {}

    @property
    def span(self) -> range:
        """The numbers of all its samples: where the periods since time 0 have them."""
        first = round(self.start * 1e-9 * self.rate)
        return range(first, first + self.count)

    def append(self, block: Block) -> None:
        """Take the next samples; raises InputError for a gap, a NaN or a time out of place."""
        if self.count == 0:
            self.start = int(block.log_time[0])
            self._first_sequence = int(block.sequence[0])
        first = self._first_sequence + self.count
        require_even(self.topic, block, first, self.start, self.count)
        size = len(block.log_time)
        need = self.held + size
        if not self._columns:
            self._columns = {name: np.empty(max(need, self._capacity)) for name in self._fields}
        for name, column in self._columns.items():
            if need > len(column):
                self._columns[name] = np.empty(max(need, 2 * len(column)))
                self._columns[name][: self.held] = column[: self.held]
            self._columns[name][self.held : need] = block.columns[name]
            require_finite(self.topic, block, name, self.count)
        self.count += size
        self.held = need

    def taken(self) -> dict[str, Array]:
        """The samples that are held, of every field; from here on only new ones are."""
        columns = self._columns
        for name, column in columns.items():  # one by one, so that one alone is held twice
            columns[name] = column if len(column) == self.held else column[: self.held].copy()
        self._columns, self.held = {}, 0
        return columns


def require_even(topic: Topic, block: Block, sequence: int, start: int, count: int) -> None:
    """Raise InputError where samples of a topic are not those behind ``count`` others.

    sequence: number that their first must have; start: time of the topic's first sample in ns.
    """
    name, rate = topic.name, topic.sample_rate
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
    if not last < 1 << 62:  # ns, 146 years: no clock of a machine, and no sum of two overflows
        raise InputError(f"{name}: at {rate:g} Hz {len(expected)} samples would last {last:g} ns")
    elapsed = time - start
    times = sample_times(count, len(elapsed), rate)
    rounding = 2.0  # ns: how far a time may be off that of its number, of which both are rounded
    off = np.abs(elapsed - times) > rounding
    if off.any():
        i = int(np.argmax(off))
        before, now = (int(elapsed[i - 1]) if i else times[0] - 1e9 / rate), int(elapsed[i])
        fault = "gap" if now - before > 1.5e9 / rate else "uneven time"
        raise InputError(
            f"{name}: {fault if now > before else 'time does not increase'}: "
            f"{seconds(start + before)} is followed by {seconds(start + now)} at sample "
            f"{count + i}, expected a sample every {1.0 / rate:.9g} s ({rate:.9g} Hz); keep the "
            "longest even part with: twin recover, or convert the log with: twin import"
        )


def require_finite(topic: Topic, block: Block, name: str, count: int) -> None:
    """Raise InputError where a column of the samples behind ``count`` others is not a number."""
    column = block.columns[name]
    if (i := first_not_finite(column)) is not None:
        raise InputError(
            f"{topic.name}: {name} is {column[i]} at {seconds(float(block.log_time[i]))} "
            f"(sample {count + i}); leave out a signal that was not recorded, "
            "or keep the longest part without it with: twin recover"
        )
