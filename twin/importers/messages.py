"""Messages of a bag -> columns: one column a number in a message.

A column is ``topic.field``, ``topic.field.inner``, or ``topic.field[1]`` for the first of an array;
where a message names the entries of its arrays, as sensor_msgs/JointState does, or an entry has a
name of its own, also ``topic.field.name``. ``topic.log_time`` and time stamps in a message are
times since 1970. Of a topic with several publishers the second is called ``topic#2``.
"""

from __future__ import annotations

import dataclasses
from array import array
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twin.errors import InputError
from twin.importers.table import SignalTable, require_columns
from twin.logs.topics import seconds

LOG_TIME = "log_time"
_STAMPS = (("sec", "nanosec"), ("seconds", "nanos"), ("secs", "nsecs"), ("sec", "nsec"))
_NO_TIME = np.iinfo(np.int64).min  # NumPy's time that is none

Values = dict[str, Any]
Aliases = dict[str, str]  # an entry by its number -> by its name


def of_message(name: str, value: Any, names: Sequence[str], aliases: Aliases) -> Values:
    """The numbers and time stamps in a value, by name; names: of its entries, if it has as many."""
    if isinstance(value, bool | int | float | np.number):
        return {name: float(value)}
    out: Values = {}
    if (fields := _fields(value)) is not None:
        for whole, rest in _STAMPS:
            if fields.keys() == {whole, rest}:
                time = int(fields[whole]) * 10**9 + int(fields[rest])
                return {name: np.datetime64(time, "ns")}
        lists = [v for v in fields.values() if _are_entries(v) and len(v)
                 and all(isinstance(text, str) for text in v)]  # fmt: skip
        for key, inner in fields.items():
            out |= of_message(f"{name}.{key}", inner, lists[0] if lists else (), aliases)
    elif _are_entries(value):
        for k, entry in enumerate(value):
            texts = [v for v in (_fields(entry) or {}).values() if isinstance(v, str)]
            called = names[k : k + 1] if len(names) == len(value) else texts  # as that of a joint
            numbered = f"{name}[{k + 1}]"
            inner = of_message(numbered, entry, (), aliases)
            out |= inner
            if len(called) == 1 and called[0]:
                for key, number in inner.items():
                    aliases[key] = f"{name}.{called[0]}{key.removeprefix(numbered)}"
                    out[aliases[key]] = number
    return out


def _are_entries(value: Any) -> bool:
    """Whether it is a list, of whatever kind a library makes them."""
    return hasattr(value, "__len__") and not isinstance(value, str | bytes | Mapping)


def _fields(value: Any) -> Mapping[str, Any] | None:
    """The fields of a message; None where it is none."""
    if isinstance(value, Mapping):
        return value
    if hasattr(value, "__len__"):
        return None
    if hasattr(value, "DESCRIPTOR"):
        return {f.name: getattr(value, f.name) for f in value.DESCRIPTOR.fields}
    if dataclasses.is_dataclass(value):
        names = (f.name for f in dataclasses.fields(value) if not f.name.startswith("_"))
        return {name: getattr(value, name) for name in names}
    return None


@dataclass
class _Series:
    """The messages of one publisher: columns by name, of which all are as long as their messages.

    parts: the number of the damaged places that each message is behind.
    """

    prefix: str
    columns: dict[str, array] = field(default_factory=dict)
    times: array = field(default_factory=lambda: array("q"))
    parts: array = field(default_factory=lambda: array("q"))
    stamps: set[str] = field(default_factory=set)
    aliases: dict[str, tuple[int, str]] = field(default_factory=dict)
    plain: dict[tuple[str, ...], list[array | None]] = field(default_factory=dict)

    def add_plain(self, messages: Sequence[Any], times: Sequence[int], part: int) -> bool:
        """Take messages of numbers alone as one before was taken; False where they are not so."""
        keys = tuple(messages[0]) if type(messages[0]) is dict else ()
        targets = self.plain.get(keys)
        if targets is None or any(type(m) is not dict or tuple(m) != keys for m in messages):
            return False
        try:
            values = array("d", chain.from_iterable(m.values() for m in messages))
        except (TypeError, OverflowError):
            return False
        count = len(self.times)
        if any(t is not None and len(t) != count for t in targets):
            return False
        for place, target in enumerate(targets):
            if target is not None:
                target.extend(values[place :: len(keys)])
        self.times.extend(times)
        self.parts.extend([part] * len(times))
        return True

    def know_plain(self, message: Mapping[str, Any], values: Values) -> None:
        """Remember where the values of such a message went, if each is a number of its own."""
        names = [f"{self.prefix}.{key}" for key in message]
        numbers = all(type(value) in (int, float) for value in message.values())
        if numbers and values.keys() <= {*names} and not self.stamps:
            own = {*values}
            self.plain[tuple(message)] = [self.columns[n] if n in own else None for n in names]

    def add(self, values: Values, time: int, part: int) -> None:
        """Take a message's numbers; what it lacks is not a number."""
        count = len(self.times)
        for name, value in values.items():
            if isinstance(value, np.datetime64):
                self.stamps.add(name)
                value = int(value.astype(np.int64))
            column = self.columns.get(name)
            if column is None:
                column = self.columns[name] = array("q" if name in self.stamps else "d")
            self._fill(name, column, count)
            column.append(value)
        self.times.append(time)
        self.parts.append(part)

    def _fill(self, name: str, column: array, count: int) -> None:
        if len(column) < count:
            lost = _NO_TIME if name in self.stamps else np.nan
            column.extend(array(column.typecode, [lost]) * (count - len(column)))

    def require_order(self, aliases: Aliases, wanted: Sequence[str]) -> None:
        """Raise InputError where an entry that is asked for by its number is another's one."""
        for key, name in aliases.items():
            number, first = self.aliases.setdefault(key, (len(self.times) + 1, name))
            if first != name and key in wanted:
                raise InputError(
                    f"'{key}' is '{first}' in message {number} and '{name}' in message "
                    f"{len(self.times) + 1}; give these names in the map"
                )

    def arrays(self) -> dict[str, NDArray]:
        """The columns (n,), each as long as there are messages, and the log times."""
        count = len(self.times)
        out: dict[str, NDArray] = {}
        for name, column in self.columns.items():
            self._fill(name, column, count)
            out[name] = np.array(column, "datetime64[ns]" if name in self.stamps else None)
        out[f"{self.prefix}.{LOG_TIME}"] = np.array(self.times, "datetime64[ns]")
        return out


@dataclass
class Messages:
    """The messages of a bag as they are read; ``wanted``: columns, all where none is named."""

    wanted: Sequence[str]

    def __post_init__(self) -> None:
        self._series: dict[object, _Series] = {}
        self._publishers: Counter[str] = Counter()
        self._seen: dict[str, None] = {}

    def is_wanted(self, publisher: object, topic: str) -> bool:
        """Whether a message is read: of a topic that nobody asks for the first alone."""
        if publisher not in self._series:
            return True
        names = (f"{topic}.", f"{topic}#")
        return not self.wanted or any(w.startswith(names) for w in self.wanted)

    def add(self, publisher: object, topic: str, message: Any, time: int, part: int = 0) -> None:
        """Take a message; time: ns, of its recording. message: None where it cannot be read."""
        self.add_all(publisher, topic, [message], [time], part)

    def add_all(
        self, publisher: object, topic: str, messages: Sequence[Any], times: Sequence[int],
        part: int,
    ) -> None:  # fmt: skip
        """Take messages of one publisher that follow each other, as ``add`` does each."""
        series = self._series.get(publisher)
        if series is None:
            self._publishers[topic] += 1
            number = self._publishers[topic]
            series = _Series(topic if number == 1 else f"{topic}#{number}")
            self._series[publisher] = series
        if messages and not series.add_plain(messages, times, part):
            for message, time in zip(messages, times, strict=True):
                if not series.add_plain([message], [time], part):
                    self._add_one(series, message, time, part)

    def _add_one(self, series: _Series, message: Any, time: int, part: int) -> None:
        aliases: Aliases = {}
        values = of_message(series.prefix, message, (), aliases)
        series.require_order(aliases, self.wanted)
        if self.wanted:
            self._seen.update(dict.fromkeys([*values, f"{series.prefix}.{LOG_TIME}"]))
            values = {name: values[name] for name in self.wanted if name in values}
        else:
            for key in aliases:  # who has names needs no numbers, which may be others' ones
                values.pop(key, None)
        series.add(values, time, part)
        if type(message) is dict:
            series.know_plain(message, values)

    def table(self, lost: Sequence[str], unread: Sequence[str]) -> SignalTable:
        """The columns that are wanted; raises InputError where one is missing.

        lost: sentences about what is lost of the bag. unread: about topics that cannot be read.
        """
        columns: dict[str, NDArray] = {}
        said = list(lost)
        for series in self._series.values():
            arrays = series.arrays()
            rows, more = self._rows(series, arrays, bool(lost))
            said += more
            columns |= {name: column[rows] for name, column in arrays.items()}
        try:
            require_columns(self.wanted, {**self._seen, **columns} if self.wanted else columns)
        except InputError as error:
            raise InputError("; ".join([str(error), *unread])) from error
        several = [topic for topic, count in self._publishers.items() if count > 1]
        for topic in several:
            counts = [len(s.times) for s in self._series.values()
                      if s.prefix.partition("#")[0] == topic]  # fmt: skip
            said.append(
                f"{topic} has {len(counts)} publishers, of {', '.join(map(str, counts))} messages: "
                f"{topic}.... is the first, {topic}#2.... the second"
            )
        if unread and not any(c.dtype.kind == "f" for c in columns.values()):
            raise InputError("; ".join(unread))
        return SignalTable(columns, said=(*said, *(unread if not self.wanted else ())))

    def _rows(
        self, series: _Series, arrays: Mapping[str, NDArray], damaged: bool
    ) -> tuple[NDArray, list[str]]:
        """The messages (k,) that are rows of the table, and sentences about others.

        Of what is behind a damaged place the longest part that follows itself, and of messages
        whose entries have names those that have the ones that are wanted.
        """
        said: list[str] = []
        keep = np.ones(len(series.times), bool)
        if damaged and len(keep):
            parts = np.array(series.parts)
            longest = np.bincount(parts).argmax()
            keep = parts == longest
            if not keep.all():
                times = np.array(series.times)[keep]
                said.append(
                    f"{series.prefix}: {keep.sum()} of {len(keep)} messages, the longest part "
                    f"without a gap, {seconds(times[0])} to {seconds(times[-1])}"
                )
        asked = [a for n, a in arrays.items() if a.dtype.kind == "f" and n in self.wanted]
        if asked:
            there = np.any([np.isfinite(a) for a in asked], axis=0)
            few = 0.02  # of the messages: who lacks more is another's
            if there.any() and (keep & ~there).mean() > few:
                keep &= there
        return np.flatnonzero(keep), said
