"""What columns say of each other: which follows which, which is the rate of which, which are sums.

All is told in samples, or in units of the columns themselves, so that nothing needs the times.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np

from twin.importers.proposal.motion import Explained, thinned
from twin.signals import Array, between

ALIKE = 0.95  # correlation of a position and its setpoint, at the lag of the loop
SAME = 0.9999  # of two readings of one thing
CHANCE = 0.1  # correlation of its noise with that of a force, of a column that nothing answers
ENOUGH = 50_000  # rows that tell what the noise of a column is


@dataclass(frozen=True)
class TableColumn:
    """A column (n,) and what is asked of it again and again."""

    name: str
    values: Array

    @cached_property
    def wraps(self) -> float | None:
        """The period at which it jumps back, as counters and angles do; None if it does not."""
        jump = float(np.max(np.abs(np.diff(self.values)), initial=0.0))
        span = float(np.ptp(self.values))
        bits = 2.0 ** np.ceil(np.log2(max(span, 1.0)))
        for period in (bits, 360.0, 2.0 * np.pi):
            counted = period != bits or (self.counts and period >= 256.0)
            nearly = 0.9  # of a period, of what comes round
            if counted and nearly * period < span <= period and jump > nearly * period:
                return float(period)
        return None

    @cached_property
    def smooth(self) -> Array:
        """The same (n,) without the jumps of what wraps."""
        if self.wraps is None:
            return self.values
        return np.unwrap(self.values, period=self.wraps)

    @cached_property
    def short(self) -> Array:
        """At most some ten thousand means over blocks (m,)."""
        return thinned(self.smooth)

    @cached_property
    def lively(self) -> slice:
        """The rows, of very many some, in which it moves most: enough to see its noise."""
        pieces = np.array_split(self.smooth, -(-len(self.values) // ENOUGH))
        best = int(np.argmax([np.ptp(piece) for piece in pieces]))
        first = sum(len(piece) for piece in pieces[:best])
        return slice(first, first + len(pieces[best]))

    @cached_property
    def spread(self) -> float:
        return float(np.std(self.short))

    @property
    def samples(self) -> float:
        """Rows of a block of ``short``."""
        return len(self.values) / len(self.short)

    @cached_property
    def rises(self) -> bool:
        """Whether it never falls, as times and numbers of rows do."""
        return bool(np.all(np.diff(self.values) >= 0.0))

    @cached_property
    def whole(self) -> bool:
        """Whether it is of whole numbers alone, and of several."""
        some = self.values[:: max(len(self.values) // 20_000, 1)]
        return bool(np.all(some == np.rint(some)) and np.ptp(some) >= 3.0)

    @property
    def counts(self) -> bool:
        """Whether it counts: whole numbers alone, and many of them."""
        return self.whole and float(np.ptp(self.values)) >= 50.0

    @cached_property
    def held(self) -> int:
        """Rows for which each value is held, as of a command that comes more seldom; 1 if none."""
        at = np.flatnonzero(np.diff(self.values[:100_000]))
        if len(at) < 30:
            return 1
        apart = np.diff(at)
        usual = int(np.median(apart))
        return usual if usual > 1 and np.mean(apart % usual == 0) > 0.95 else 1

    def rough(self, every: int) -> tuple[float, bool]:
        """What differs from row to row, as a part of the spread, and whether it is noise.

        every: rows of which one is looked at. Fourth differences of white noise go to and fro, with
        a correlation of -0.8 from one to the next; those of a motion do not.
        """
        ripple = np.diff(self.smooth[self.lively][every - 1 :: every], 4)
        size = float(np.std(ripple))
        return size / self.spread, size > 0.0 and likeness(ripple[1:], ripple[:-1]) < -0.5

    def rate(self, other: TableColumn, samples: int) -> tuple[float, float]:
        """How well a column goes with the rate of this one, 0 to 1, and one of it in that rate.

        The rate is that of a row. samples: rows over which both are averaged. A rate is 0 at rest,
        so it is told without an offset.
        """
        every = max(samples, len(self.values) // ENOUGH)
        whole = (len(self.values) - 1) // every * every
        rate = between(self.smooth[: whole + 1 : every], float(every))
        mean = other.smooth[:whole].reshape(-1, every).mean(axis=1)
        power, product = float(mean @ mean), float(rate @ mean)
        size = float(np.sqrt(power * float(rate @ rate)))
        if size == 0.0:
            return 0.0, 0.0
        return min(abs(product) / size, abs(likeness(rate, mean))), product / power


@dataclass(frozen=True)
class ColumnCourse:
    """A column beside a position, of its course.

    slope: how much of it is one of the position, negative where it is reversed. behind: samples by
    which the position follows it. likeness: their correlation then.
    """

    column: TableColumn
    slope: float
    behind: float
    likeness: float


def likeness(a: Array, b: Array) -> float:
    """Correlation of two columns (n,); 0 where one is constant."""
    a, b = a - a.mean(), b - b.mean()
    size = float(np.sqrt((a @ a) * (b @ b)))
    return float(a @ b) / size if size > 0.0 else 0.0


def course(position: TableColumn, other: TableColumn) -> ColumnCourse | None:
    """Another column as one of the course of a position; None where it goes elsewhere."""
    own, its = position.short, other.short
    loop = min(len(own) // 8, 512)  # samples, by which a loop follows at all
    size = 1 << (2 * len(own) - 1).bit_length()
    a, b = own - own.mean(), its - its.mean()
    power = float(np.sqrt((a @ a) * (b @ b)))
    if power == 0.0:
        return None
    lags = np.fft.irfft(np.fft.rfft(a, size) * np.conj(np.fft.rfft(b, size)), size)
    near = np.concatenate([lags[-loop:], lags[: loop + 1]]) / power
    at = int(np.argmax(np.abs(near)))
    if abs(near[at]) < ALIKE:
        return None
    slope = float(np.sign(near[at])) * other.spread / position.spread
    return ColumnCourse(
        other, slope, _lag(position, other) * position.samples, float(abs(near[at]))
    )


def _lag(position: TableColumn, setpoint: TableColumn) -> float:
    """Samples by which the rate of a position follows that of its setpoint, and parts of one."""
    a, b = (np.diff(c.short) for c in (position, setpoint))
    size = 1 << (2 * len(a) - 1).bit_length()
    a, b = a - a.mean(), b - b.mean()
    lags = np.abs(np.fft.irfft(np.fft.rfft(a, size) * np.conj(np.fft.rfft(b, size)), size))
    loop = min(len(a) // 8, 512)
    near = np.concatenate([lags[-loop:], lags[: loop + 1]])
    at = int(np.argmax(near))
    if not 0 < at < len(near) - 1:
        return float(at - loop)
    left, top, right = near[at - 1 : at + 2]
    bend = left - 2.0 * top + right
    return float(at - loop + (0.5 * (left - right) / bend if bend < 0.0 else 0.0))


def follows(
    position: TableColumn, setpoint: TableColumn, force: TableColumn | None = None, sign: int = 1
) -> int:
    """How surely a column is measured and the other its setpoint; below 0, the other way round.

    A reading has steps and noise where a setpoint is smooth, and it comes later: 1 each. A
    controller answers the noise of a reading by a force against it, that of a setpoint by one along
    it: 1, or 3 where that is most of the force's own noise. sign: -1 where the force is reversed.
    """
    every = max(position.held, setpoint.held)
    one, other = position.rough(every), setpoint.rough(every)
    told = 2.0  # times as rough, times as much in the force
    votes = int(one[1] and one[0] > told * other[0]) - int(other[1] and other[0] > told * one[0])
    behind = _lag(position, setpoint) * position.samples
    least = 0.3  # samples, from which a lag is none of rounding
    votes += int(np.sign(behind)) if abs(behind) > least else 0
    if force is not None:
        own, its = (sign * answer(force, c) for c in (position, setpoint))
        if (most := max(abs(own), abs(its))) > CHANCE:
            weight = 3 if most > 0.3 else 1
            votes -= weight * int(np.sign(own)) * int(abs(own) > told * abs(its))
            votes += weight * int(np.sign(its)) * int(abs(its) > told * abs(own))
    return votes


def answer(force: TableColumn, reading: TableColumn) -> float:
    """The largest correlation of the noise of a column with that of a force, up to 7 rows later.

    0 where there is no noise to answer. It is there all along, so that the median of some parts is
    taken: a start at speed makes more of both than all noise, for some samples.
    """
    if not reading.rough(1)[1]:
        return 0.0
    a, b = (np.diff(c.smooth[reading.lively], 4) for c in (reading, force))
    parts = max(min(9, len(a) // 50), 1)  # of 50 rows at least, which tell a correlation
    found = []
    for k in range(8):  # rows, as a bus has it late
        pairs = zip(*(np.array_split(c, parts) for c in (a[: len(a) - k], b[k:])), strict=True)
        found.append(float(np.median([likeness(*pair) for pair in pairs])))
    return max(found, key=abs)


def sign_of(motion: Explained, position: TableColumn, force: TableColumn) -> int:
    """The sign with which a force moves an axis; -1 where it is reversed.

    By its inertia; where that is not sure by what it answers to the noise of the reading, which a
    controller answers against it; where it answers nothing by friction alone.
    """
    if not motion.is_turned:
        return 1
    if motion.accelerates:
        return motion.accelerates
    answered = answer(force, position)
    return -1 if abs(answered) < CHANCE else -int(np.sign(answered))


def same(a: TableColumn, b: TableColumn) -> bool:
    """Whether two columns are one reading, in units of their own."""
    return abs(likeness(a.short, b.short)) > SAME


def sums(columns: Sequence[TableColumn]) -> Iterator[tuple[TableColumn, TableColumn, TableColumn]]:
    """A column, and the two others whose sum it is, row by row."""
    for one, two in combinations(columns, 2):
        for total in columns:
            if total is one or total is two:
                continue
            left = total.short - one.short - two.short
            rounding = 1e-3  # of the smaller part
            if float(np.std(left)) < rounding * min(one.spread, two.spread):
                yield total, one, two


def distinct(columns: Sequence[TableColumn]) -> list[list[TableColumn]]:
    """Columns by what they read: those that are the same together."""
    groups: list[list[TableColumn]] = []
    for column in columns:
        group = next((g for g in groups if same(g[0], column)), None)
        if group is None:
            groups.append([column])
        else:
            group.append(column)
    return groups


def columns_of(values: Mapping[str, Array]) -> dict[str, TableColumn]:
    return {name: TableColumn(name, v) for name, v in values.items()}
