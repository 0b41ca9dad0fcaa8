"""The columns of a table that may be its times: by their names, by how large, how even they are."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from twin.errors import InputError
from twin.importers.counters import find_wraps, unwrapped
from twin.importers.proposal.names import units_of
from twin.importers.stated_rate import SLOWEST
from twin.importers.table import SignalTable
from twin.importers.time_base import rows_a_stamp, times_of
from twin.importers.units import find_unit, is_unit
from twin.logs.log import Array

_WORDS = {
    "time", "timestamp", "timestamps", "stamp", "t", "ts", "zeit", "zeitstempel", "uhrzeit",
    "clock", "temps", "heure", "tiempo", "elapsed", "epoch", "uptime", "millis", "micros", "nanos",
    "ms", "us", "ns", "sec", "secs", "seconds", "datetime",
    "время", "时间", "时间戳", "時間", "時刻",
}  # fmt: skip
_COUNTING = {
    "n", "k", "sample", "samples", "index", "idx", "row", "count", "cnt", "counter", "cycle",
    "cycles", "tick", "ticks", "seq", "sequence", "frame", "nr", "no", "number", "序号",
}  # fmt: skip
# Between which numbers a column counts a unit of time since a known day, from 2000 to 2060: from
# 1990 on nanoseconds since 1970 would be as many as 100 ns since the year 1.
_EPOCHS = (
    (3.6e4, 5.9e4, "day", "days of a spreadsheet"),
    (7.3e5, 7.53e5, "day", "days since the year 0"),
    *(
        (size * 9.4e8, size * 2.9e9, unit, f"{unit} since 1970")
        for unit, size in (("s", 1.0), ("ms", 1e3), ("us", 1e6), ("ns", 1e9))
    ),
    (1.25e17, 1.45e17, "100ns", "100 ns since 1601"),
    (6.3e17, 6.51e17, "100ns", "100 ns since the year 1"),
)
_FASTEST = 100_000.0  # Hz, of a log that a drive is identified from
_SIZES = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}


@dataclass(frozen=True)
class Times:
    """A column that may be that of the times, in s (n,), with its unit and what tells that.

    rest: the column of what is left of each second, and its unit, if another has that.
    """

    name: str
    seconds: Array
    unit: str
    reason: str
    said: tuple[str, ...]
    rest: tuple[str, str] | None = None

    @property
    def step(self) -> float:
        """The usual step, s."""
        return _usual(np.diff(self.seconds))

    @property
    def is_coarse(self) -> bool:
        """Whether many rows have the time of the row before."""
        return float((np.diff(self.seconds) == 0.0).mean()) > 0.1

    @property
    def duration(self) -> float:
        """From its first to its last time, s."""
        return float(self.seconds[-1] - self.seconds[0])

    @property
    def entry(self) -> str:
        """Its entry in a map."""
        rest = "" if self.rest is None else f", plus = {{{_entry(*self.rest)}}}"
        return f"{{{_entry(self.name, self.unit)}{rest}}}"

    @property
    def columns(self) -> tuple[str, ...]:
        """The columns that it is made of."""
        return (self.name,) if self.rest is None else (self.name, self.rest[0])


def _entry(column: str, unit: str) -> str:
    return f'column = {json.dumps(column, ensure_ascii=False)}, unit = "{unit}"'


def is_time(name: str) -> bool:
    """Whether a column is called as one of times."""
    return bool(set(_words(name)) & _WORDS) or _unit_of(name) is not None


def _words(name: str) -> list[str]:
    spaced = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", " ", name)
    return re.findall(r"[^\W\d_]+", spaced.lower())


def _unit_of(name: str) -> str | None:
    """The unit of time that a name ends with, or is."""
    bracketed = re.search(r"[\[(]\s*([^\])]+?)\s*[\])]\s*$", name)
    if bracketed:
        return bracketed[1] if is_unit(bracketed[1], "s") else _unit_of_time(bracketed[1])
    words = _words(name)
    last = words[-1] if words else ""
    if last in ("s", "us", "ms", "ns") and len(words) > 1 and not set(words[:-1]) & _WORDS:
        return None  # pos_ms is no time, as a_s is none
    return _unit_of_time(last)


def _unit_of_time(spelled: str) -> str | None:
    """The unit of time that is spelled so; None where it is none."""
    return next((unit for _, unit in units_of(spelled) if unit in _SIZES), None)


def counts(name: str, column: Array) -> bool:
    """Whether a column (n,) counts the samples, with gaps or begun again, and tells no time."""
    if _unit_of(name) is not None or (column != np.rint(column)).any() or len(column) < 3:
        return False
    if _since_epoch(column) is not None:
        return False
    steps = np.diff(continued(column))
    usual = float(np.median(steps))
    if usual <= 0.0 or (steps <= 0.0).mean() > 0.01 or (steps != usual).mean() > 0.1:
        return False
    return usual == 1.0 or bool(set(_words(name)) & _COUNTING)


def continued(column: Array) -> Array:
    """A counter without its beginning again."""
    wraps = find_wraps(column)
    return column if wraps is None else unwrapped(column, wraps.size)


def candidates(
    table: SignalTable, columns: Mapping[str, Array], counters: Sequence[str]
) -> tuple[list[Times], list[Times]]:
    """The columns that are called as times, and others that rise as evenly as these."""
    even, called = [], [*_in_parts(columns)]
    parts = {name for one in called for name in one.columns}
    for name, column in columns.items():
        if name in parts:
            continue
        raw = np.asarray(table.columns[name])
        if name in counters or raw.dtype == np.dtype("datetime64[D]"):  # a date is in its times
            continue
        calendar = raw.dtype.kind in "Mm"
        unit, reason = _unit(name, column, calendar)
        try:
            times, said = times_of(name, column if not calendar else raw, find_unit(unit, "s").size)
        except InputError:
            continue
        steps = np.diff(times)
        if not (steps > 0.0).any() or ((steps < 0.0).mean() > 0.01 and not calendar):
            continue
        one = Times(name, times, unit, reason, said)
        rising, level = float((steps > 0.0).mean()), float((steps == 0.0).mean())
        if calendar or (is_time(name) and (rising > 0.5 or rows_a_stamp(times))):
            called.append(one)
        elif rising > 0.9 and level == 0.0 and _is_even(steps):
            even.append(one)
    called.sort(key=lambda one: one.is_coarse)
    return called, even


def _in_parts(columns: Mapping[str, Array]) -> Iterator[Times]:
    """Times of which a column has the whole seconds and another, called alike, what is left."""
    for name, whole in columns.items():
        stem, unit = _stem(name)
        if _SIZES.get(unit or "") != 1.0 or (whole != np.rint(whole)).any() or not whole.any():
            continue
        for other, column in columns.items():
            beside, finer = _stem(other)
            if finer is None or finer == unit or beside != stem:
                continue
            rest = column / _SIZES[finer]
            back = np.diff(rest)[np.diff(whole) > 0.0] < 0.0
            if rest.min() >= 0.0 and rest.max() < 1.0 and back.all():
                yield Times(
                    name, whole + rest, "s", f"whole seconds, and the {finer} of '{other}'", (),
                    (other, finer),
                )  # fmt: skip


def _stem(name: str) -> tuple[str, str | None]:
    """A name less its last word, and the unit of time that this is, if any."""
    last = re.findall(r"[^\W\d_]*$", name)[0]
    return name.removesuffix(last).lower(), _unit_of_time(last)


def _is_even(steps: Array) -> bool:
    """Whether steps (n,) are those of a clock: all alike, or off by chance and not as a motion."""
    spread, usual = float(np.ptp(steps)), float(np.median(steps))
    chance = 0.05  # of the spread, by which steps that are off by chance differ from the next one
    exact = spread < 0.01 * usual
    # a program that waits for each sample is late at times, and never early
    late = float(steps.min()) > 0.99 * usual and float((steps < 1.01 * usual).mean()) > 0.5
    return (
        exact
        or late
        or (spread < 0.5 * usual and float(np.mean(np.abs(np.diff(steps)))) > chance * spread)
    )


def _unit(name: str, column: Array, calendar: bool) -> tuple[str, str]:
    """The unit of a column of times, and why."""
    if calendar:
        return "s", "dates and times" if len(column) else ""
    step = _usual_step(column)
    own = _unit_of(name)
    if own is not None and 1.0 / (find_unit(own, "s").size * step) < 5.0 * _FASTEST:
        return own, "its name states the unit"
    if own is None and (epoch := _since_epoch(column)) is not None:
        return epoch
    fits = [u for u, size in _SIZES.items() if SLOWEST <= size / step <= _FASTEST]
    unit = fits[0] if fits else own or "s"
    told = f"that is {_SIZES.get(unit, 1.0) / step:.6g} Hz"
    if own is not None:
        told += (
            f", where the {own} of its name are {1.0 / (find_unit(own, 's').size * step):.6g} Hz"
        )
    seconds = own is None and _SIZES.get(unit, 1.0) == 1.0
    return unit, told if seconds else f"unit ASSUMED: {told}"


def _usual_step(column: Array) -> float:
    steps = np.diff(continued(column))
    return _usual(steps) if (steps > 0.0).any() else 1.0


def _usual(steps: Array) -> float:
    """The usual step: the mean of those that are like the median one.

    Of a clock that counts since long ago each step is rounded.
    """
    middle = np.median(steps[steps > 0.0])
    return float(np.mean(steps[np.abs(steps - middle) <= 0.1 * middle]))


def _since_epoch(column: Array) -> tuple[str, str] | None:
    """The unit of times that count since a known day, and why; None where none is as large."""
    first, step = float(column[0]), _usual_step(column)
    for low, high, unit, since in _EPOCHS:
        rate = 1.0 / (find_unit(unit, "s").size * step)
        if low < first < high and SLOWEST <= rate <= _FASTEST:
            return unit, f"as many {since}, that is {rate:.6g} Hz"
    return None
