"""The times of a table: their rate where they are even, else an even time base to resample to."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from twin.errors import InputError
from twin.importers.counters import and_more, stamp_jumps, without_jumps
from twin.importers.mapping import ImportMap
from twin.importers.table import MOST_NAMED, numbers
from twin.logs.log import Array
from twin.logs.topics import instant
from twin.numbers import first_not_finite

_HOUR, _DAY = 3600.0, 86400.0  # s
_TIMERS = (2.0**32, 2.0**24, 2.0**16)  # counts of a timer before it begins again


def times_of(name: str, raw: NDArray, unit: float) -> tuple[Array, tuple[str, ...]]:
    """The times (n,) in s of a column as it is in its file, and sentences about what its clock did.

    unit: one of its numbers, s. A clock that begins again, after 2^32 counts or a day, or is put by
    an hour for summer time, goes on. Raises InputError where the column is not one of numbers.
    """
    times = unit * numbers(name, raw)
    calendar = raw.dtype.kind in "Mm"
    sizes = (_HOUR, _DAY, 0.5 * _DAY) if calendar else (*(n * unit for n in _TIMERS), _DAY)
    if not np.isfinite(times).all() or (jumps := stamp_jumps(times, sizes)) is None:
        return times, ()
    row = int(jumps.rows[0])
    shown = [_shown(raw[k]) for k in (row - 2, row - 1)]
    which = f"in row {row} ({shown[0]} is followed by {shown[1]}){and_more(len(jumps.rows))}"
    if jumps.size == _HOUR:
        what = f"is put by {_HOUR:g} s {which}: summer time; the hour is taken out"
    elif calendar or jumps.size == _DAY:
        what = f"begins again after {jumps.size / 3600.0:g} h {which}: the time goes on"
    else:
        bits = round(np.log2(jumps.size / unit))
        what = f"begins again {which}: the roll-over of a counter of {bits} bits is taken out"
    return without_jumps(times, jumps), (f"column '{name}': the clock {what}",)


def _shown(value: np.generic) -> str:
    """A time as its file has it, for a sentence."""
    if value.dtype.kind == "M":
        return str(value.astype("datetime64[us]").item().time())
    if value.dtype.kind == "m":
        return str(value.astype("timedelta64[us]").item())
    return f"{value:.12g}"


def order_of(times: Array) -> NDArray[np.intp] | None:
    """The rows (n,) by their times (n,) in s, where they are but out of order; None where not.

    In order they are as even as they are where they rise; two recordings that lie over each other,
    or a clock that was put back, are not.
    """
    steps = np.diff(times)
    if not np.isfinite(times).all() or (steps >= 0.0).all() or not (steps > 0.0).any():
        return None
    order = np.argsort(times, kind="stable")
    usual, sorted_ = float(np.median(steps[steps > 0.0])), np.diff(times[order])
    few, near = 0.1, 5.0  # share of rows out of place; steps by which two may differ that are even
    moved = np.mean(order != np.arange(len(order)))
    even = bool((sorted_ > 0.5 * usual).all()) and sorted_.max() < near * usual
    return order if even and moved < few else None


def _require_no_return(times: Array) -> None:
    """Raise InputError that names every place where times (n,) in s fall back by far."""
    steps = np.diff(times)
    if not (steps > 0.0).any():
        return
    far = 20.0  # usual steps; by less the rows of a recorder that was busy fall back
    rows = np.flatnonzero(steps < -far * np.median(steps[steps > 0.0])) + 1
    if not len(rows):
        return
    places = [
        f"row {k + 1} ({instant(times[k - 1])} is followed by {instant(times[k])})"
        for k in rows[:MOST_NAMED]
    ]
    more = f" and {len(rows) - MOST_NAMED} more" if len(rows) > MOST_NAMED else ""
    raise InputError(
        f"the time falls back in {', '.join(places)}{more}: the clock was put back, or several "
        f"recordings are in one file; {_as_rows(_parts(rows, len(times)))}"
    )


def repeated_rows(columns: Mapping[str, Array], time: Array) -> NDArray[np.intp]:
    """The indices of rows that say once more what the row before them does, the time included."""
    same = np.append(False, np.diff(time) == 0.0)
    for column in columns.values():
        same &= np.append(False, np.diff(column) == 0.0)
    return np.flatnonzero(same)


def simple_rate(rate: float, share: float = 0.01) -> float:
    """The number with the fewest digits that differs from a rate by less than so large a share."""
    plain = (float(f"{rate:.{digits}g}") for digits in range(1, 9))
    return next((p for p in plain if abs(p / rate - 1.0) < share), rate)


def rows_a_stamp(time: Array) -> float | None:
    """How many rows have the same time, where each time is that of as many; None where not.

    Of a recorder whose clock is coarser than its samples.
    """
    edges = np.flatnonzero(np.diff(time) != 0.0)
    lengths = np.diff(edges)
    few, even = 2, 0.1  # whole stretches; share by which they may differ, and one row
    if len(lengths) < few or np.median(lengths) < 2.0 or (np.diff(time) < 0.0).any():
        return None
    mean = float(np.mean(lengths))
    off = np.abs(lengths - mean).max() > max(1.0, even * mean)
    if off:
        return None
    rate = len(lengths) * mean / float(time[edges[-1] + 1] - time[edges[0] + 1])
    return simple_rate(rate, 1.0 / len(time))  # a row may be before or behind the edges


def rate_of_rounded(time: Array) -> float | None:
    """The rate in Hz of times (n,) in s that are even, but printed with few digits; else None.

    None too where they have all digits that they need, so that nothing is rounded.
    """
    elapsed = time - time[0]
    if not (np.diff(elapsed) >= 0.0).all() or elapsed[-1] <= 0.0:
        return None
    mean = float(elapsed[-1]) / (len(time) - 1)
    for digits in range(7):
        scaled = elapsed * 10.0**digits
        if np.abs(scaled - np.rint(scaled)).max() < 1e-3:
            break
    else:
        return None
    digit = 10.0**-digits
    finest = 0.01  # of a period, that a time may be off; coarser digits than these are rounded
    steps = np.diff(scaled)
    longer = np.rint(steps) > np.floor(mean / digit + 1e-9)
    few = 5  # steps of each of two lengths; one alone is a row that is lost or there twice
    if digit < finest * mean or min(longer.sum(), (~longer).sum()) < few:
        return None
    for rate in dict.fromkeys((float(round(1.0 / mean)) or 1.0, 1.0 / mean)):
        off = elapsed - np.arange(len(time)) / rate
        if np.ptp(off) < 1.001 * digit and abs(1.0 / rate / mean - 1.0) * elapsed[-1] < digit:
            return rate
    return None


def rate_of(time: Array) -> float:
    """Sample rate in Hz of times (n,) in s.

    It is the nearest whole number where the times allow that. Raises InputError that names row and
    time where they do not increase, have a gap, or are off the even grid by more than 1 %.
    """
    jitter = 0.01  # of a period: how far a time may be off the even grid
    _require_finite(time)
    _require_no_return(time)
    elapsed = time - time[0]
    steps = np.diff(elapsed)
    if len(steps) and (steps < 0.0).all():
        raise InputError(
            f"the time runs backwards, from {instant(time[0])} in the first row to "
            f"{instant(time[-1])} in the last; sort the rows by their time"
        )
    period = float(np.median(steps))
    rate = len(steps) / max(float(elapsed[-1]), 1e-9)  # less than none is refused below
    if abs(round(rate) / rate - 1.0) * len(steps) < jitter:
        rate = float(round(rate))
    off = np.abs(elapsed * rate - np.arange(len(time)))
    if (off > jitter).any() and (rounded := rate_of_rounded(time)) is not None:
        return rounded
    for fault, wrong in (
        ("does not increase", np.append(False, steps <= 0.0)),
        ("has a gap", np.append(False, steps > 1.5 * period)),
        (f"is off the even grid by up to {100.0 * off.max():.3g} % of a sample", off > jitter),
    ):
        if wrong.any():
            require_no_hole(time)  # which a clock would not mend
            row = int(np.argmax(wrong))
            if (coarse := rows_a_stamp(time)) is not None:
                raise InputError(
                    f"the time is the same in several rows each, {instant(time[row])} in row "
                    f"{row + 1} and before; give sample_rate = {coarse:.6g} (Hz) in place of time"
                )
            raise InputError(
                f"the time {fault}: {instant(time[row - 1])} is followed by {instant(time[row])} "
                f"in row {row + 1}, usual are {period:.6g} s a sample; give resample = "
                f"{1.0 / max(period, 1e-9):.6g} (Hz) in the map, or sample_rate in place of time "
                "where only the printed times are inexact"
            )
    return rate


def _require_finite(time: Array) -> None:
    if (k := first_not_finite(time)) is not None:
        raise InputError(f"the time in row {k + 1} is {time[k]}; give every row a time")


def parts_of(time: Array) -> list[tuple[int, int]]:
    """The first and the last row, from 1, of each part of times (n,) in s.

    Between two is a hole, or the clock begins again.
    """
    steps = np.diff(time)
    longest = 20.0  # usual steps, over which a line is no measurement
    usual = float(np.median(steps)) if len(steps) else 0.0
    holes = np.flatnonzero(np.abs(steps) > longest * usual) + 1 if usual > 0.0 else []
    return _parts(holes, len(time))


def _parts(ends: Iterable[int], count: int) -> list[tuple[int, int]]:
    """The first and the last row of each part, by the last rows of all but the last."""
    return [(a + 1, b) for a, b in pairwise([0, *map(int, ends), count])]


def _as_rows(parts: Sequence[tuple[int, int]]) -> str:
    """The entries of a map that take a part each."""
    shown = " or ".join(f"rows = [{a}, {b}]" for a, b in parts[:MOST_NAMED] if a < b)
    return f"import each part as a log of its own, with {shown} in the map"


def require_no_hole(time: Array) -> None:
    """Raise InputError where times (n,) in s have a hole over which a line is no measurement."""
    parts = parts_of(time)
    if len(parts) > 1:
        gap = parts[0][1]
        raise InputError(
            f"there is nothing between {instant(time[gap - 1])} and {instant(time[gap])}"
            f"{and_more(len(parts) - 1)}; {_as_rows(parts)}"
        )


def even_times(begin: float, end: float, rate: float) -> Array:
    """Times in s from ``begin`` to ``end``, of which there are ``rate`` a second."""
    return begin + np.arange(int((end - begin) * rate * (1.0 + 1e-12)) + 1) / rate


@dataclass(frozen=True)
class TimeBase:
    """rows: those kept, in the order of time; times: (n,) s of them; grid: (m,) s, even."""

    rows: NDArray[np.intp]
    times: Array
    grid: Array
    dropped: int

    def resampled(self, column: Array) -> Array:
        """A column (rows of the file,) on the even time base, by straight lines."""
        return np.asarray(np.interp(self.grid, self.times, column[self.rows]))

    @property
    def leaves_all(self) -> bool:
        """Whether the even time base has every row that it spans where it was."""
        places = np.interp(self.grid, self.times, np.arange(float(len(self.times))))
        near = 1e-6  # of a step, that a time in s has lost by rounding
        each = np.rint(places[:1]) + np.arange(len(places))  # row after row
        return not self.dropped and bool(np.all(np.abs(places - each) < near))

    def costs(self, mapping: ImportMap, columns: Mapping[str, Array]) -> str:
        """What was resampled, and the RMS error of the straight lines in each signal of a map."""
        steps, each = np.diff(self.times) * 1e3, []
        for axis, entry in mapping.axes.items():
            for field, c in entry.columns.items():
                kept = columns[c.name][self.rows]
                between = np.interp(self.times[1:-1:2], self.times[::2], kept[::2])
                # Of a smooth signal lines twice as long are four times as far off.
                rms = float(np.sqrt(np.mean((between - kept[1:-1:2]) ** 2))) / 4.0
                size = c.si.size * abs(float(c.scale)) * rms
                each.append(f"{axis}.{field} {size:.2g} {entry.units[field]}")
        rows = "row" if self.dropped == 1 else "rows"
        dropped = f", {self.dropped} {rows} with a time that does not increase left out"
        spread = " to ".join(dict.fromkeys(f"{step:.3g}" for step in (steps.min(), steps.max())))
        return (
            f"steps of {spread} ms were resampled to "
            f"{np.median(np.diff(self.grid)) * 1e3:.4g} ms{dropped if self.dropped else ''}; "
            f"error rms about {', '.join(each)}"
        )


def time_base_of(time: Array, rate: float) -> TimeBase:
    """The even time base of ``rate`` Hz over the times (n,) in s; raises InputError."""
    _require_finite(time)
    _require_no_return(time)
    increasing = time > np.maximum.accumulate(np.concatenate([[-np.inf], time[:-1]]))
    rows = np.flatnonzero(increasing)
    kept = time[rows]
    if len(kept) < 3 or 2 * len(kept) < len(time):
        raise InputError(f"the time increases in {len(kept)} of {len(time)} rows only")
    steps = np.diff(kept)
    usual = float(np.median(steps))
    # 2 times as fast, but for rounding, or 100 times as slow
    if rate * usual > 2.001 or rate * usual < 0.01:
        raise InputError(
            f"resample = {rate:g} Hz, but the rows come at about {1.0 / usual:.4g} Hz; give that"
        )
    require_no_hole(kept)
    return TimeBase(rows, kept, even_times(kept[0], kept[-1], rate), len(time) - len(kept))
