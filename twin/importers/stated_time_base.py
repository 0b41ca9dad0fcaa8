"""What a file says of its time base, as lines of a proposed map: found, or asked for.

A column of times tells it best, then what the file states in words. A counter of the samples tells
no time: how long one is must be given, and no number stands in its place.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from twin.errors import InputError
from twin.importers.stated_rate import SAME, StatedRate, stated_rate
from twin.importers.table import SignalTable, key_in_turns, mixed_rows
from twin.importers.time_base import (
    order_of,
    parts_of,
    rate_of,
    rate_of_rounded,
    repeated_rows,
    rows_a_stamp,
    simple_rate,
)
from twin.importers.time_columns import Times, candidates, continued, counts, is_time
from twin.importers.units import find_unit
from twin.logs.log import Array

_BRIDGED = "# resample = ? # Hz: what is lost is bridged by straight lines"
NOMINAL = 1e-3  # s a sample, where it is not known: what is compared then is the course alone


@dataclass(frozen=True)
class StatedTimeBase:
    """The time base of a file.

    lines: of a map. step: s a sample, NOMINAL where it is not known. used: the columns that tell
    times or count, and are no signals. missing: what must be given, a sentence each. asking: the
    line that asks for the sample rate, empty where none does.
    """

    lines: tuple[str, ...]
    step: float
    used: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()
    asking: str = ""


def find_time_base(table: SignalTable, columns: Mapping[str, Array]) -> StatedTimeBase:
    """The time base of a table; columns: those of numbers (n,), all as long."""
    if (key := _text_key(table)) is not None:
        return StatedTimeBase((f"# {key}",), NOMINAL, (), (key,))
    counters = [name for name, column in columns.items() if counts(name, column)]
    called, even = candidates(table, columns, counters)
    if table.sample_rate is not None and not _are_otherwise(called, table.sample_rate):
        line = f"# the file states its sample rate: {table.sample_rate:g} Hz"
        return StatedTimeBase(
            (line,), 1.0 / table.sample_rate, tuple(n for n in columns if is_time(n))
        )
    stated = stated_rate([*table.notes, *_scalars(table)])
    rated = stated.rate if stated is not None else None
    found = called or _agreeing(even, rated, [*columns], counters)
    dates = (n for n in columns if np.asarray(table.columns[n]).dtype.kind == "M")
    used = tuple(dict.fromkeys([*(n for f in found for n in f.columns), *counters, *dates]))
    if found:
        base = _of_times(found, columns, stated, used)
        apart = _disagreeing_times(found, [*columns])
        return base if apart is None else replace(base, missing=(*base.missing, apart))
    if stated is not None and stated.rate is not None:
        lines = _of_rate(columns, counters, stated.rate, f"the file states {stated.text!r}")
        return StatedTimeBase(lines, 1.0 / stated.rate, used)
    return _asked(columns, counters, stated, used)


def _are_otherwise(times: Sequence[Times], rate: float) -> bool:
    """Whether even times tell another rate than the one (Hz) that a file states."""
    fine = [one for one in times if not one.is_coarse and _has_rate(one.seconds)]
    return bool(fine) and all(abs(one.step * rate - 1.0) > SAME for one in fine)


def _text_key(table: SignalTable) -> str | None:
    """That a column of words tells rows of several axes apart, where one does."""
    texts = {n: c.tolist() for n, c in table.columns.items() if np.asarray(c).dtype.kind in "OUS"}
    keys = (key_in_turns(name, cells) for name, cells in texts.items())
    return next((key for key in keys if key is not None), None)


def _disagreeing_times(found: Sequence[Times], names: Sequence[str]) -> str | None:
    """That a later column of times, with signals before and behind it, is another clock of these.

    Of messages each has stamps of its own, which may be late.
    """
    first, *others = sorted(found, key=lambda one: names.index(one.name))
    for other in others:
        place = names.index(other.name)
        between = place - names.index(first.name) > 1 and place + 1 < len(names)
        apart = float(np.abs(other.seconds - first.seconds).max())
        if between and "." not in other.name and apart > 0.5 * first.step:
            return (
                f"'{other.name}' is up to {apart:.4g} s from '{first.name}': each is the clock of "
                "the columns behind it; export them with one, or give the file twice, with a table "
                "[[files]] and its time for each"
            )
    return None


def _agreeing(
    even: Sequence[Times], stated: float | None, names: Sequence[str], counters: Sequence[str]
) -> list[Times]:
    """Of columns that nothing but even steps tells to be times the one that may be believed.

    One whose rate the file states; else the first column of all, where none counts the samples.
    """
    if stated is not None:
        return [one for one in even if abs(one.step * stated - 1.0) < SAME][:1]
    return [one for one in even if one.name == names[0] and not counters]


def _of_times(
    found: Sequence[Times], columns: Mapping[str, Array], stated: StatedRate | None,
    used: tuple[str, ...],
) -> StatedTimeBase:  # fmt: skip
    """The time base by the best of several columns of times."""
    time, why = _best(found)
    lines = []
    coarse = rows_a_stamp(time.seconds)
    if coarse is not None:
        of_each = coarse * time.step
        if (key := _key(columns, round(of_each))) is not None:
            return StatedTimeBase((f"# {key}",), 1.0 / coarse, used, (key,))
        rows = f"each time of {time.name} is that of {of_each:.4g} rows"
        lines.append(f"sample_rate = {coarse:.6g} # Hz: {rows}")
        return StatedTimeBase(tuple(lines), 1.0 / coarse, used)
    if (rounded := rate_of_rounded(time.seconds)) is not None:
        line = f"sample_rate = {rounded:.9g} # Hz: so many rows a second by {time.name}, which is"
        return StatedTimeBase((f"{line} rounded",), 1.0 / rounded, used)
    step = time.step / find_unit(time.unit, "s").size
    times = " x " if time.unit[0].isdigit() else " "
    rises = f"rises by {step:.6g}{times}{time.unit}"
    lines.append(f"time = {time.entry} # {rises}: {time.reason}{why}")
    lines += [f"# {text}" for text in time.said]
    lines += [f"# or: time = {other.entry} # rises by {other.step:.6g} s"
              for other in found if other is not time and other.duration > 0.0]  # fmt: skip
    order = order_of(time.seconds)
    steps = np.diff(time.seconds if order is None else time.seconds[order])
    first, last, missing = 1, len(time.seconds), tuple[str, ...]()
    if order is None and len(parts := parts_of(time.seconds)) > 1:
        first, last = max(parts, key=lambda part: part[1] - part[0])
        told = " and ".join(f"[{a}, {b}]" for a, b in parts if b > a != first)
        lines.append(
            f"rows = [{first}, {last}] # the longest of {len(parts)} parts; the others: {told}"
        )
        steps = steps[first - 1 : last - 1]
        if last - first < 0.1 * len(time.seconds):
            missing = (f"{time.name} leaps in {len(parts) - 1} places, so that no part is of use",)
    again = repeated_rows({n: c for n, c in columns.items() if n != time.name}, time.seconds)
    again = again[(again >= first) & (again < last)] - (first - 1)  # of the part that is taken
    off = np.abs(np.delete(steps, again - 1) - time.step)
    whole = len(steps) == len(time.seconds) - 1 and order is None and not len(again)
    if len(off) and (off.max() > 0.01 * time.step or (whole and not _has_rate(time.seconds))):
        rate = simple_rate(1.0 / time.step)
        spread = f"{steps.min() / time.step * step:.4g} to {steps.max() / time.step * step:.4g}"
        lines.append(
            f"resample = {rate:g} # Hz, because the steps are uneven: {spread} {time.unit}"
        )
    if stated and stated.rate and abs(stated.rate * time.step - 1.0) > SAME:
        lines.append(f"# the file states {stated.text!r}, its times give {1.0 / time.step:.6g} Hz")
    return StatedTimeBase(tuple(lines), time.step, used, missing)


def _key(columns: Mapping[str, Array], rows: int) -> str | None:
    """That a column tells the rows of one time apart, where it goes through so many values."""
    for name, column in columns.items():
        once = column[:rows]
        if len({*once.tolist()}) == rows > 1 and (column[rows:] == column[:-rows]).all():
            return mixed_rows(name, [f"{value:g}" for value in once])
    return None


def _has_rate(times: Array) -> bool:
    """Whether times (n,) in s are even enough to be imported as they are."""
    try:
        rate_of(times)
    except InputError:
        return False
    return True


def _best(found: Sequence[Times]) -> tuple[Times, str]:
    """The column of times to take, and why where another is wrong.

    Of a message the stamp is that of its measurement, and its log time when it was recorded: where
    the stamps stand still, or take another time in all, the recorder is right.
    """
    first = found[0]
    recorded = [f for f in found if f.name.endswith(".log_time")]
    stamps = [f for f in found if f not in recorded]
    if not recorded or not stamps:
        return first, ""
    clock = recorded[0]
    for stamp in stamps:
        rising = float((np.diff(stamp.seconds) > 0.0).mean())
        if rising > 0.9 and abs(stamp.duration / max(clock.duration, 1e-9) - 1.0) < SAME:
            return stamp, ""
    what = f"take {stamps[0].duration:.4g} s" if stamps[0].duration > 0.0 else "stand still"
    return clock, f"; the times of {stamps[0].name} {what}, these {clock.duration:.4g} s"


def _scalars(table: SignalTable) -> Iterator[str]:
    """The values beside the columns of a file, as text."""
    for name, column in table.columns.items():
        if len(column) == 1 and np.asarray(column).dtype.kind in "fiu":
            stem = name.removesuffix(".value")  # {"value": 2, "unit": "kHz"}
            units = (
                table.columns.get(f"{stem}{word}", ()) for word in ("_unit", "_units", ".unit")
            )
            unit = next((str(u[0]) for u in units if len(u) == 1), "")
            yield f"{re.split(r'[./]', stem)[-1]} = {float(column[0]):.12g} {unit}"


def _asked(
    columns: Mapping[str, Array], counters: Sequence[str], stated: StatedRate | None,
    used: tuple[str, ...],
) -> StatedTimeBase:  # fmt: skip
    """The lines that ask for a time base."""
    unit = "" if stated is None else f"; the file states {stated.text!r} {stated.unsure}"
    lines = []
    for name in counters[:1]:
        count = _count_of(columns[name])
        why = count.why(name)
        if count.lost or count.by != 1.0:
            column = json.dumps(name, ensure_ascii=False)
            lines = [
                f"# time = {{column = {column}, step = ?}} # s a count: NOT KNOWN, {why}{unit}"
            ]
            if count.lost:
                lines.append(_BRIDGED)
            said = f"{why}{unit}; give step (s a count): time = {{column = {column}, step = ...}}"
            return StatedTimeBase(tuple(lines), NOMINAL, used, (said,))
        break
    else:
        why = "no column rises as times do"
    line = f"# sample_rate = ? # Hz: NOT KNOWN, {why}{unit}"
    missing = (f"{why}{unit}; give sample_rate (Hz)",)
    return StatedTimeBase((line,), NOMINAL, used, missing, asking=line)


def _of_rate(
    columns: Mapping[str, Array], counters: Sequence[str], rate: float, why: str
) -> tuple[str, ...]:
    """The lines of a rate (Hz) that a file states: of its counter, where that lacks samples."""
    for name in counters[:1]:
        count = _count_of(columns[name])
        if count.lost:
            column, step = json.dumps(name, ensure_ascii=False), 1.0 / (rate * count.by)
            line = f"time = {{column = {column}, step = {step:.9g}}} # s a count: {count.why(name)}"
            return f"{line}; {why}", _BRIDGED
    return (f"sample_rate = {rate:.9g} # Hz: {why}",)


@dataclass(frozen=True)
class _Count:
    """What a counter of samples counts: so many at a time; how many it lacks, the first of them."""

    by: float
    lost: int
    first: str

    def why(self, name: str) -> str:
        """Why a column of that name is the time, in words."""
        gap = f" and lacks {self.lost} of them, the first {self.first}" if self.lost else ""
        many = "" if self.by == 1.0 else f", {self.by:g} at a time"
        return f"'{name}' counts the {'samples' if self.lost else 'rows'}{many}{gap}"


def _count_of(column: Array) -> _Count:
    steps = np.diff(continued(column))
    by = float(np.median(steps))
    lost = int(np.sum(np.maximum(steps / by - 1.0, 0.0)))
    k = int(np.argmax(np.diff(column) > by))
    first, last = column[k] + 1, column[k + 1] - 1
    return _Count(by, lost, f"{first:g}" if first == last else f"{first:g} to {last:g}")
