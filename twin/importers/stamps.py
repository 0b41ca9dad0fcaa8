"""Dates and times of day as text -> times: dd.mm.yyyy, 12-hour clocks, two columns, any locale.

What a date means is told by all dates of a column: 03/04 is in March or in April, but 13/04 and
03/04 on the day before 04/04 are plain. Dates are parsed by dateutil, each once; a column has few.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import date
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

_NS = 10**9
_BITS = 36  # of a stamp's number for the ns within its minute; above them is which minute
_TIME_OF_DAY = re.compile(
    r"(?:(?P<date>\S.*?)(?:T|_|\s+|,\s*))?"
    r"(?P<hour>\d{1,3}):(?P<minute>\d{2})(?::(?P<second>\d{2}))?(?:[.,;:](?P<fraction>\d{1,9}))?"
    r"\s*(?P<half>[AaPp]\.?\s?[Mm]\.?)?\s*(?P<zone>Z|UTC|GMT|[+-]\d{2}:?\d{2})?"
)
# What of a stamp stands before its seconds, and these: where a zone follows they are others.
_PLAIN, _SECONDS = re.compile(r"[^:+]*(?<!:)\d{1,2}:\d{2}"), re.compile(r"\d{1,2}(?:\.\d*)?\s*")
_NUMERIC_DATE = re.compile(r"(\d{1,4})([-./])(\d{1,2})\2(\d{1,4})")
_DATE = re.compile(
    rf"{_NUMERIC_DATE.pattern}|\d{{1,2}}[-. /]+[A-Za-z]{{3,9}}[-. /]+\d{{2,4}}"
    r"|[A-Za-z]{3,9}\.? \d{1,2},? \d{4}|\d{4}年\d{1,2}月\d{1,2}日"
)


@dataclass(frozen=True)
class _Minute:
    """What stamps of one minute have in common; date: as text, "" for none; seconds: of the day."""

    date: str
    seconds: int
    morning_or_evening: bool


def is_stamp(cell: str) -> bool:
    """Whether a cell is a time of day, with a date or without."""
    if ":" not in cell:
        return False
    try:
        _parsed(cell)
    except ValueError:
        return False
    return True


def is_date(cell: str) -> bool:
    """Whether a cell is a date without a time."""
    try:
        return bool(_DATE.fullmatch(cell.strip())) and bool(_any_date(cell.strip()))
    except ValueError:
        return False


@lru_cache(1 << 10)
def _any_date(text: str) -> date:
    """The date, by whatever order of day and month it has one; raises ValueError."""
    if not _DATE.fullmatch(text):
        raise ValueError(text)
    try:
        return _date(text, True)
    except ValueError:
        return _date(text, False)


def _date(text: str, day_first: bool) -> date:
    """The date in a text; raises ValueError."""
    from dateutil import parser  # for the few files that have dates

    numeric = _NUMERIC_DATE.fullmatch(text)
    year_first = bool(numeric and len(numeric[1]) == 4) or "年" in text
    plain = re.sub("[年月]", "-", text).rstrip("日")
    try:
        return parser.parse(plain, dayfirst=day_first and not year_first).date()
    except OverflowError as error:
        raise ValueError(text) from error


def _parsed(cell: str) -> tuple[_Minute, int]:
    """The minute of a stamp, and the ns within it; raises ValueError."""
    found = _TIME_OF_DAY.fullmatch(cell.strip().strip('"'))
    if found is None:
        raise ValueError(cell)
    hour, minute, second = (int(found[k] or 0) for k in ("hour", "minute", "second"))
    if found["second"] is None and found["fraction"] and "." in cell.rpartition(":")[2]:
        hour, minute, second = 0, hour, minute  # minutes and seconds that have passed
    day = found["date"] or ""
    if minute > 59 or second > 60 or (hour > 24 and (day or found["half"])):
        raise ValueError(cell)
    if day:
        _any_date(day)
    if found["half"]:
        hour = hour % 12 + 12 * found["half"].lower().startswith("p")
    fraction = (found["fraction"] or "").ljust(9, "0")
    whole = hour * 3600 + minute * 60 - _offset(found["zone"])
    return _Minute(day, whole, bool(found["half"])), second * _NS + int(fraction or 0)


def _offset(zone: str | None) -> int:
    """By how many s a zone is ahead of UTC."""
    if not zone or not zone[1:].replace(":", "").isdigit():
        return 0
    digits = zone[1:].replace(":", "")
    seconds = int(digits[:2]) * 3600 + int(digits[2:]) * 60
    return -seconds if zone[0] == "-" else seconds


class Stamps:
    """The stamps of a column as they are read, each as a number; ``kind``: "stamp" or "date"."""

    def __init__(self, kind: str) -> None:
        self._add = self._add_date if kind == "date" else self._add_stamp
        self._is_date = kind == "date"
        self._minutes: list[_Minute] = []
        self._numbers: dict[str, int] = {}
        self.add = self._add

    def _number_of(self, key: str, minute: _Minute) -> int:
        """The number of a minute."""
        self._numbers[key] = number = len(self._minutes) << _BITS
        self._minutes.append(minute)
        return number

    def _add_date(self, cell: str) -> int:
        found = self._numbers.get(cell)
        if found is None:
            _any_date(cell.strip())
            found = self._number_of(cell, _Minute(cell.strip(), 0, False))
        return found

    def _add_stamp(self, cell: str) -> int:
        """The number of a stamp; raises ValueError for what is none."""
        head, _, tail = cell.rpartition(":")
        half = ""
        if tail[-1:] in "mM":  # 09.5 PM
            head, tail, half = head + tail[-2:], tail[:-2], tail[-2:]
        if ";" in tail:  # 03;125
            tail = tail.replace(";", ".")
        found = self._numbers.get(head)
        if found is not None:  # a minute that was met, and seconds: nearly all
            try:
                return found + round(float(tail) * _NS)
            except ValueError:
                pass
        minute, rest = _parsed(cell)
        plain = _PLAIN.fullmatch(head.removesuffix(half)) and _SECONDS.fullmatch(tail)
        key = head if plain else f"\0{minute}"
        known = self._numbers.get(key)
        return (self._number_of(key, minute) if known is None else known) + rest

    def times(self, numbers: NDArray[np.int64]) -> NDArray:
        """The times (n,) of stamps: datetime64, or timedelta64 of the day where no date is known.

        Of a column of dates datetime64[D].
        """
        days, known = self._days()
        if self._is_date:
            return np.array(days, "datetime64[D]")[numbers >> _BITS]
        starts = [
            day.astype(np.int64) * 86400 + m.seconds
            for day, m in zip(np.array(days, "datetime64[D]"), self._minutes, strict=True)
        ]
        ns = np.array(starts, np.int64)[numbers >> _BITS] * _NS + (numbers & ((1 << _BITS) - 1))
        if known:
            return ns.astype("datetime64[ns]")
        return ns.astype("timedelta64[ns]")

    def _days(self) -> tuple[list[date], bool]:
        """The day of each minute, and whether it is known which day it is."""
        texts = list(dict.fromkeys(m.date for m in self._minutes if m.date))
        if not texts:
            return [date(1970, 1, 1)] * len(self._minutes), False
        day_first = _day_first(texts, any(m.morning_or_evening for m in self._minutes))
        dates: Mapping[str, date] = {text: _date(text, day_first is not False) for text in texts}
        first = dates[texts[0]]
        return [dates.get(m.date, first) for m in self._minutes], day_first is not None


def _day_first(texts: Sequence[str], half_days: bool) -> bool | None:
    """Whether the day stands before the month in these dates; None where both may be."""
    found = [m for text in texts if (m := _NUMERIC_DATE.fullmatch(text)) and len(m[1]) < 3]
    if any(m[2] == "." or int(m[1]) > 12 for m in found) or all(m[1] == m[3] for m in found):
        return True
    if half_days or any(int(m[3]) > 12 for m in found):
        return False
    spans = []
    for day_first in (True, False):  # days of one recording follow each other
        days = sorted(_date(m[0], day_first).toordinal() for m in found)
        spans.append(days[-1] - days[0])
    return None if spans[0] == spans[1] else spans[0] < spans[1]


def with_times(columns: Mapping[str, NDArray]) -> dict[str, NDArray]:
    """The same with times where a column (n,) of text holds stamps, or dates, throughout."""
    out = dict(columns)
    for name, column in columns.items():
        if column.ndim != 1 or column.dtype.kind not in "OUS" or not len(column):
            continue
        texts = [v.decode() if isinstance(v, bytes) else v for v in column.tolist()]
        if not isinstance(texts[0], str) or not (is_stamp(texts[0]) or is_date(texts[0])):
            continue
        stamps = Stamps("stamp" if is_stamp(texts[0]) else "date")
        with suppress(ValueError, TypeError, AttributeError):  # what is none stays text
            out[name] = stamps.times(np.array([stamps.add(text) for text in texts], np.int64))
    return joined_with_dates(out)


def joined_with_dates(columns: Mapping[str, NDArray]) -> dict[str, NDArray]:
    """The same with the dates of a column of dates in those that are times of day alone."""
    days = [c for c in columns.values() if c.dtype == np.dtype("datetime64[D]")]
    if not days:
        return dict(columns)
    return {
        name: days[0].astype("datetime64[ns]") + column if column.dtype.kind == "m" else column
        for name, column in columns.items()
    }
