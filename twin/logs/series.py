"""The samples of one topic as they arrive, block by block, and where they lie in time."""

from __future__ import annotations

from collections.abc import Collection
from datetime import UTC, datetime

import numpy as np
from numpy.typing import NDArray

from twin.errors import InputError
from twin.logs.layout import Block, sample_times
from twin.logs.log import Array
from twin.logs.topics import Topic

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


JITTER = 0.1  # of a period: how far a time may be off the even grid


class Spacing:
    """Numbers and times of the samples of one topic, evenly spaced; ``count`` were taken.

    start: time of the first sample in ns.
    """

    def __init__(self, topic: Topic) -> None:
        self.topic = topic
        self.start = 0
        self.count = 0
        self._first_sequence = 0
        self._rate = topic.sample_rate
        self._elapsed: list[NDArray[np.int64]] = []  # ns, kept only where the rate is not stated

    def check(self, block: Block) -> None:
        """Raise InputError where samples do not go on where the last ended."""
        if self.count == 0:
            self.start = int(block.log_time[0])
            self._first_sequence = int(block.sequence[0])
        self._check_sequence(block.sequence)
        elapsed = block.log_time.astype(np.int64) - self.start
        if self._rate:
            self._check_times(elapsed, self.count, self._rate)
        elif self.count > 1:
            self._check_step(float(elapsed[0]))

    def take(self, block: Block) -> None:
        """Count samples that were checked."""
        if self._rate is None:
            self._elapsed.append(block.log_time.astype(np.int64) - self.start)
        self.count += len(block.log_time)

    @property
    def rate_is_stated(self) -> bool:
        """Whether the sample rate is known without the times."""
        return self._rate is not None

    def sample_rate(self) -> float:
        """Sample rate in Hz, stated or counted; raises InputError where times are uneven."""
        if self._rate is None:
            elapsed = np.concatenate(self._elapsed)
            rate = self._counted_rate(elapsed)
            self._check_times(elapsed, 0, rate)
            self._rate = rate
        return self._rate

    def require_behind(self, before: Spacing) -> None:
        """Raise InputError where there is a gap behind the samples of the part before."""
        rate = before.sample_rate()
        end = before.start + int(sample_times(before.count, 1, rate)[0])
        if abs(self.start - end) > JITTER * 1e9 / rate:
            last = before.start + int(sample_times(before.count - 1, 1, rate)[0])
            self._refuse_time(0, float(last - self.start), 0.0, rate)

    def _check_sequence(self, sequence: NDArray[np.uint32]) -> None:
        """Sequence numbers count the samples, or are 0 where the writer does not use them."""
        first = self._first_sequence + self.count
        expected = np.arange(first, first + len(sequence)).astype(np.uint32)
        wrong = sequence != expected
        if wrong.any() and sequence.any():
            i = int(np.argmax(wrong))
            raise InputError(
                f"{self.topic.name}: message {self.count + i} has sequence number {sequence[i]}, "
                f"expected {expected[i]}: messages are missing or out of order"
            )

    def _check_times(self, elapsed: NDArray[np.int64], first: int, rate: float) -> None:
        """``elapsed``: ns since the start, of the samples from number ``first``."""
        expected = sample_times(first, len(elapsed), rate)
        off = np.abs(elapsed - expected) > JITTER * 1e9 / rate
        if off.any():
            i = int(np.argmax(off))
            before = elapsed[i - 1] if i else expected[0] - 1e9 / rate
            self._refuse_time(first + i, float(before), float(elapsed[i]), rate)

    def _check_step(self, elapsed: float) -> None:
        """The step from the last sample to the next, where the rate is not known yet."""
        last = float(self._elapsed[-1][-1])
        period = last / (self.count - 1)
        if elapsed - last > 1.5 * period > 0.0:
            self._refuse_time(self.count, last, elapsed, 1e9 / period)

    def _refuse_time(self, sample: int, before: float, elapsed: float, rate: float) -> None:
        period = 1e9 / rate
        times = f"{seconds(self.start + before)} is followed by {seconds(self.start + elapsed)}"
        if elapsed <= before:
            fault = f"time does not increase: {times}"
        elif elapsed - before > 1.5 * period:
            fault = f"gap: {times}"
        else:
            fault = f"uneven time: {times}"
        raise InputError(
            f"{self.topic.name}: {fault} at sample {sample}, expected a sample every "
            f"{period / 1e9:.9g} s ({rate:.9g} Hz); correct the rate or the times, "
            "or keep the longest even part with: twin recover"
        )

    def _counted_rate(self, elapsed: NDArray[np.int64]) -> float:
        """Rate from first and last time; the integer nearest to it where jitter allows that."""
        steps = np.diff(elapsed)
        if not (steps > 0).any():
            raise InputError(
                f"{self.topic.name}: {len(elapsed)} samples do not determine the sample rate; "
                "state sample_rate_hz (Hz) in the channel metadata"
            )
        period = float(np.median(steps[steps > 0]))
        bad = (steps <= 0) | (steps > 1.5 * period)
        if bad.any():
            i = int(np.argmax(bad))
            self._refuse_time(i + 1, float(elapsed[i]), float(elapsed[i + 1]), 1e9 / period)
        rate = len(steps) * 1e9 / float(elapsed[-1])
        nearest = round(rate)
        return float(nearest) if abs(nearest - rate) * len(steps) < JITTER * rate else rate


class Series(Spacing):
    """Columns of one topic; ``append`` refuses what is not evenly spaced and finite.

    capacity: samples expected; more are taken too. wanted: the fields that are kept, None for all.
    """

    def __init__(self, topic: Topic, capacity: int, wanted: Collection[str] | None = None) -> None:
        super().__init__(topic)
        fields = [f for f in topic.fields if wanted is None or f in wanted]
        self._columns = {name: np.empty(capacity) for name in fields}

    def append(self, block: Block) -> None:
        """Take the next samples; raises InputError for a gap, a NaN or a time out of place."""
        self.check(block)
        self._reserve(len(block.log_time))
        span = slice(self.count, self.count + len(block.log_time))
        for name, column in self._columns.items():
            column[span] = block.columns.get(name, 0.0)
            require_finite(self, block, name, column[span])
        self.take(block)

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


def require_finite(samples: Spacing, block: Block, name: str, column: Array) -> None:
    """Raise InputError where a column of the next samples is not a number."""
    finite = np.isfinite(column)
    if not finite.all():
        i = int(np.argmin(finite))
        raise InputError(
            f"{samples.topic.name}: {name} is {column[i]} at {seconds(float(block.log_time[i]))} "
            f"(sample {samples.count + i}); leave out a signal that was not recorded, "
            "or keep the longest part without it with: twin recover"
        )
