"""MCAP -> Log, strictly: every fault is one InputError that names file, place and remedy."""

from __future__ import annotations

import math
import shlex
import zlib
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from mcap.opcode import Opcode
from mcap.records import Attachment, Metadata

from twin.errors import InputError, at
from twin.logs.container import Damaged, Inflation, McapFile, Record, open_chunk, open_mcap
from twin.logs.log import FIELDS, Array, AxisLog, Log
from twin.logs.topics import (
    AXIS_PREFIX,
    TRUTH_PREFIX,
    MessageBlock,
    Series,
    Topic,
    Topics,
    axis_of,
    positive_number,
    seconds,
)

METADATA_NAME = "twin"
CHECKSUM = "checksum"  # entry of the metadata, as their record has none
SCHEMA_VERSION = "1"


@dataclass(frozen=True)
class Wanted:
    """What is read of a log: axes and fields by name, None for all, and the simulator's truth."""

    axes: Sequence[str] | None = None
    fields: Sequence[str] | None = None
    truth: bool = True

    def takes(self, topic: str) -> bool:
        """Whether samples of a topic are wanted."""
        if self.axes is not None and axis_of(topic) not in self.axes:
            return False
        return topic.startswith(AXIS_PREFIX) or (self.truth and topic.startswith(TRUTH_PREFIX))

    def channels(self, file: McapFile) -> Container[int]:
        """The channels that are wanted; all where the summary lists none."""
        listed = file.channels()
        return {c.id for c in listed if self.takes(c.topic)} if listed else range(1 << 16)


EVERYTHING = Wanted()


def read_log(
    path: str | Path,
    axes: Sequence[str] | str | None = None,
    *,
    fields: Sequence[str] | None = None,
    truth: bool = True,
    start: float | None = None,
    stop: float | None = None,
) -> Log:
    """Read an MCAP log, or of it what is asked for.

    axes, fields: by name, None for all. truth: whether the simulator's truth is read too, which
    takes more than half of the memory. start, stop: times in s of the log; the first sample is the
    first from ``start`` on. Of a log with an index only the chunks with what is asked for are read.

    Every checksum of these is verified, and the samples must be complete, evenly spaced and finite.
    Raises InputError otherwise, where no axis has position and one of current and force, and for a
    field that no log has.
    """
    for name in set(fields or ()) - {*FIELDS}:
        raise InputError(f"{path}: no log has a field {name}; give some of {', '.join(FIELDS)}")
    wanted = Wanted([axes] if isinstance(axes, str) else axes, fields, truth)
    first, last = start or 0.0, math.inf if stop is None else stop
    if not first < last:
        raise InputError(f"{path}: start = {first:g} s is not before stop = {last:g} s")
    with _opened(path) as file:
        if start is None and stop is None:
            everything = wanted == EVERYTHING
            records = file.records() if everything else file.selected(wanted.channels(file))
            return next(log_parts(file, records, wanted, None))
        run = Decoding(file, wanted)
        span = round(first * 1e9), min(last * 1e9, 2.0**63)
        for _ in run.fed(file.selected(wanted.channels(file), *span)):
            pass
        return run.between(first, last)


def read_parts(
    path: str | Path, samples: int, *, fields: Sequence[str] | None = None
) -> Iterator[Log]:
    """The same log without truth in parts of ``samples`` or a few more, one after the other.

    So that a long one need not be held in memory. Raises InputError as read_log does. A log that
    does not state its sample rate, that has no statistics, or whose topics do not lie side by side,
    is one part.
    """
    wanted = Wanted(None, fields, truth=False)
    with _opened(path) as file:
        yield from log_parts(file, file.selected(wanted.channels(file)), wanted, samples)


def require_intact(path: str | Path) -> None:
    """Raise InputError where any byte of a log is not what was written, whoever reads it."""
    with _opened(path) as file:
        for _ in file.records():
            pass


def samples_by_axis(path: str | Path) -> dict[str, int]:
    """Samples of each axis as the file's statistics announce them; nothing where there are none."""
    with _opened(path) as file:
        axes = [c for c in file.channels() if c.topic.startswith(AXIS_PREFIX)]
        return {axis_of(c.topic): (file.counts or {}).get(c.id, 0) for c in axes}


def log_metadata(path: str | Path) -> dict[str, str]:
    """What the writer of a log said of it, without its samples. Raises InputError as read_log."""
    with _opened(path) as file:
        extras = Extras()
        for record in file.selected(()):
            if record.opcode == Opcode.METADATA:
                extras.add(record)
        return extras.metadata


@contextmanager
def _opened(path: str | Path) -> Iterator[McapFile]:
    """The file, with a remedy in the errors that tell of damage."""
    try:
        with open_mcap(Path(path)) as file:
            yield file
    except Damaged as error:
        raise Damaged(
            f"{error}; copy the file again, or keep what is intact: "
            f"twin recover {shlex.quote(str(path))} -o GOOD"
        ) from error


def log_parts(
    file: McapFile, records: Iterator[Record], wanted: Wanted, samples: int | None
) -> Iterator[Log]:
    """The log in parts of ``samples`` or a few more; whole where None."""
    run, told = Decoding(file, wanted, samples), False
    for _ in run.fed(records):
        if samples is not None and run.holds(samples):
            yield run.log()
            told = True
    run.require_counts()
    if not (told and run.is_empty):
        yield run.log()


@dataclass
class Extras:
    """Metadata and attachments. proved: whether a checksum of its own proves the metadata."""

    metadata: dict[str, str] = field(default_factory=dict)
    attachments: dict[str, bytes] = field(default_factory=dict)
    proved: bool = False

    def add(self, record: Record) -> None:
        """Take metadata or an attachment from a record; raises Damaged, InputError."""
        if record.opcode == Opcode.METADATA:
            metadata = record.parsed(Metadata)
            if metadata.name != METADATA_NAME:
                return
            entries = dict(metadata.metadata)
            stated = entries.pop(CHECKSUM, None)
            if stated not in (None, checksum(entries)):
                raise Damaged(f"metadata at byte {record.offset}: wrong checksum")
            version = entries.get("schema_version", SCHEMA_VERSION)
            if version != SCHEMA_VERSION:
                raise InputError(
                    f"log schema version is {version!r}, this program reads {SCHEMA_VERSION!r}; "
                    "install a newer proton-twin"
                )
            self.metadata, self.proved = entries, stated is not None
        elif record.opcode == Opcode.ATTACHMENT:
            attachment = record.parsed(Attachment)
            crc = int.from_bytes(record.content[-4:], "little")
            if crc not in (0, zlib.crc32(record.content[:-4])):
                raise Damaged(f"attachment at byte {record.offset}: wrong checksum")
            self.attachments[attachment.name] = attachment.data


def checksum(metadata: Mapping[str, str]) -> str:
    """CRC-32, eight digits, of all keys and values of metadata, sorted, each behind its length."""
    crc = 0
    for text in (t for entry in sorted(metadata.items()) for t in entry):
        data = text.encode()
        crc = zlib.crc32(data, zlib.crc32(len(data).to_bytes(8, "little"), crc))
    return f"{crc:08x}"


class Decoding:
    """The samples of a file as they arrive, of a topic so many at once (None: all), and extras."""

    def __init__(self, file: McapFile, wanted: Wanted, samples: int | None = None) -> None:
        self._extras = Extras()
        self._topics = Topics()
        self._size = file.size
        for record in file.definitions:  # chunks that hold them as well may never be read
            self._topics.register(record.opcode, record.content)
        self._wanted = wanted
        self._counts = file.counts
        self._expected = {
            c.id for c in file.channels()
            if (file.counts or {}).get(c.id, 0) and wanted.takes(c.topic)
        }  # fmt: skip
        # room for no more samples than bytes in the file, whatever its statistics say
        self._room = file.size if samples is None else min(file.size, samples + (samples >> 4))
        self._series: dict[int, Series] = {}

    def fed(self, records: Iterable[Record]) -> Iterator[None]:
        """Take what is in records, chunk by chunk; raises Damaged, InputError."""
        budget = Inflation(self._size)
        for record in records:
            if record.opcode == Opcode.CHUNK:
                data, proved = open_chunk(record, budget)
                with at(record.place):
                    if data and not proved:
                        raise Damaged("states no checksum of its samples")
                    for block in self._topics.blocks(data):
                        series = self._series.get(block.channel) or self._open(block)
                        if series is not None:
                            series.append(block)
                yield
            elif record.opcode == Opcode.MESSAGE:
                raise InputError(
                    f"a message at byte {record.offset} is outside the chunks; convert the log "
                    "with: twin import"
                )
            else:
                self._extras.add(record)

    def _open(self, block: MessageBlock) -> Series | None:
        topic = self._topics.topic(block.channel)
        if topic is None or not self._wanted.takes(topic.name):
            return None
        if any(s.topic.name == topic.name for s in self._series.values()):
            raise InputError(f"two channels have the topic {topic.name}; write one a topic")
        with at(topic.name):
            room = min((self._counts or {}).get(block.channel, 0), self._room)
            fields = None if topic.is_truth else self._wanted.fields
            self._series[block.channel] = Series(topic, room, fields)
        return self._series[block.channel]

    def _opened(self) -> list[Series]:
        return [series for _, series in sorted(self._series.items())]

    @property
    def is_empty(self) -> bool:
        """Whether no samples are held."""
        return not any(s.held for s in self._series.values())

    def holds(self, samples: int) -> bool:
        """Whether all topics that the file announces hold so many or more, to the same time."""
        series = self._series.values()
        whole = self._series.keys() == self._expected and len({s.span for s in series}) == 1
        return whole and all(s.held >= samples for s in series)

    def require_counts(self) -> None:
        """Raise Damaged where there are not as many samples as the file announces."""
        for channel, series in self._series.items():
            if self._counts is not None and series.count != self._counts.get(channel, 0):
                raise Damaged(
                    f"{series.topic.name}: {series.count} samples where the statistics announce "
                    f"{self._counts.get(channel, 0)}"
                )

    def log(self) -> Log:
        """The log of what is held; raises InputError where topics differ in time, ..."""
        rate, common = self._rate(), self._common
        for one in self._opened():
            if one.span != common:
                end = one.start + (one.count - 1) * 1e9 / one.rate
                raise InputError(
                    f"{one.topic.name} has {one.count} samples from {seconds(one.start)} to "
                    f"{seconds(end)}, other topics differ; keep what they have in common with: "
                    "twin recover"
                )
        return assembled(((s.topic, s.taken()) for s in self._opened()), rate, self._extras)

    def between(self, start: float, stop: float) -> Log:
        """The log of the samples from ``start`` to before ``stop`` (s); raises InputError."""
        if not self._series:
            raise InputError(f"has no samples from {start:g} to {stop:g} s")
        rate, common = self._rate(), self._common
        zero = max(s.start for s in self._series.values()) * 1e-9
        early = 0.1  # of a period: how much before a sample a range may begin to hold it
        first, last = (
            common.start + math.ceil(min(max((t - zero) * rate - early, 0), len(common)))
            for t in (start, stop)
        )
        if first == last:
            raise InputError(
                f"has no samples from {start:g} to {stop:g} s; it goes on from {zero:g} s to "
                f"{zero + len(common) / rate:g} s"
            )
        columns = []
        for series in self._opened():
            span = slice(first - series.span.start, last - series.span.start)
            columns.append((series.topic, {f: c[span] for f, c in series.taken().items()}))
        return assembled(columns, rate, self._extras)

    @property
    def _common(self) -> range:
        """The numbers of the samples that all topics have."""
        spans = [s.span for s in self._series.values()]
        return range(max(s.start for s in spans), min(s.stop for s in spans))

    def _rate(self) -> float:
        """The rate of all topics, Hz; raises InputError where an axis lacks anything."""
        topics = self._topics.names()
        there = f"topics in the file: {', '.join(topics) or 'none'}"
        names = [s.topic.axis for s in self._opened() if not s.topic.is_truth]
        for wanted in self._wanted.axes or ():
            if wanted not in names:
                axes = ", ".join(axis_of(t) for t in topics if t.startswith(AXIS_PREFIX)) or "none"
                raise InputError(
                    f"no samples on topic {AXIS_PREFIX}{wanted}; {there}; name an axis of these: "
                    f"{axes}"
                )
        if not names and any(topic.startswith("/measured/") for topic in topics):
            raise InputError(
                "is a comparison for viewers (of `twin compare`), not a log: its force is "
                "averaged; give the log that was compared"
            )
        if not names:
            raise InputError(
                f"no samples on a topic {AXIS_PREFIX}<name>; {there}; rename them, or convert the "
                "log with: twin import"
            )
        for one in self._opened():
            one.topic.require_fields()
        return common_rate([s.topic for s in self._opened()], self._extras)


def common_rate(topics: Iterable[Topic], extras: Extras) -> float:
    """The sample rate of all topics, Hz; raises InputError where they or the metadata differ."""
    rates = {topic.name: topic.sample_rate for topic in topics}
    stated = positive_number(extras.metadata, "sample_rate_hz")
    if stated is not None:
        rates["the metadata"] = stated
    first, rate = next(iter(rates.items()))
    for name, other in rates.items():
        if abs(other - rate) > 1e-9 * rate:
            raise InputError(
                f"{first} is sampled at {rate:.9g} Hz, {name} says {other:.9g} Hz; "
                "write all axes at one rate, or convert with: twin import"
            )
    return rate


def assembled(topics: Iterable[tuple[Topic, dict[str, Array]]], rate: float, extras: Extras) -> Log:
    """The log of topics with their columns, sampled at ``rate`` (Hz); raises InputError."""
    axes, truth = {}, {}
    for topic, own in topics:
        if topic.is_truth:
            truth[topic.axis] = own
            continue
        with at(topic.name):
            axes[topic.axis] = AxisLog(own, topic.units, topic.force_constant)
    return Log(rate, axes, extras.metadata, truth, extras.attachments)


OneLog = Log | str | Path
GivenLogs = OneLog | Sequence[OneLog] | Mapping[str, OneLog]


class LogsByName(Mapping[str, Log]):
    """Logs by name; a file is read each time that it is asked for, so that nobody holds it."""

    def __init__(self, given: Mapping[str, OneLog]) -> None:
        self._given = given

    def __getitem__(self, name: str) -> Log:
        found = self._given[name]
        return found if isinstance(found, Log) else read_log(found)

    def __iter__(self) -> Iterator[str]:
        return iter(self._given)

    def __len__(self) -> int:
        return len(self._given)


def logs_by_name(given: GivenLogs | None, role: str = "log") -> Mapping[str, Log]:
    """The logs by name: of a file its path, of a log without one its role and number.

    given: a log, the path of one, a list of them or a dict with a name for each. Raises InputError
    for what is no log, and for a file that is given twice.
    """
    if given is None:
        return {}
    if isinstance(given, Mapping):
        if type(given) is dict:  # another mapping may read a file for each of its values
            for name, log in given.items():
                _require_log(log, f"{role} {name!r}")
        return LogsByName(given)
    logs = [given] if isinstance(given, OneLog) else given
    if not isinstance(logs, Sequence):
        _require_log(logs, role)
    named: dict[str, OneLog] = {}
    for number, log in enumerate(logs, start=1):
        _require_log(log, role)
        name = f"{role} {number}" if isinstance(log, Log) else str(log)
        if name in named:
            raise InputError(f"{role}: {name} is given twice; give each log once")
        named[name] = log
    return LogsByName(named)


def some_logs(given: GivenLogs | None, role: str = "log") -> Mapping[str, Log]:
    """The same of what cannot do without logs; raises InputError where none is given."""
    logs = logs_by_name(given, role)
    if not logs:
        raise InputError(f"{role}: none is given; give a Log, the path of one, or several of them")
    return logs


def _require_log(log: object, what: str) -> None:
    if not isinstance(log, OneLog):
        raise InputError(
            f"{what}: a {type(log).__name__} is no log; give a Log, the path of one, a list of "
            "them or a dict with a name for each"
        )
