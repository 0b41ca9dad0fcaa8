"""Series of samples -> Log, with the checks that all topics fit together."""

from __future__ import annotations

import math
import zlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from mcap.opcode import Opcode
from mcap.records import Attachment, Metadata

from twin.errors import InputError, at
from twin.logs.container import Damaged, Record
from twin.logs.layout import Block
from twin.logs.log import Array, AxisLog, Log
from twin.logs.series import Series, seconds
from twin.logs.topics import AXIS_PREFIX, TRUTH_PREFIX, Topic, Topics, axis_of, positive_number

METADATA_NAME = "twin"
CHECKSUM = "checksum"  # entry of the metadata, as their record has none
SCHEMA_VERSION = "1"
EARLY = 0.1  # of a period: how much before a sample a range may begin to hold it


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


EVERYTHING = Wanted()


def checksum(metadata: Mapping[str, str]) -> str:
    """CRC-32, eight digits, of all keys and values of metadata, sorted, each behind its length."""
    crc = 0
    for text in (t for entry in sorted(metadata.items()) for t in entry):
        data = text.encode()
        crc = zlib.crc32(data, zlib.crc32(len(data).to_bytes(8, "little"), crc))
    return f"{crc:08x}"


class Extras:
    """Metadata and attachments."""

    def __init__(
        self,
        metadata: dict[str, str] | None = None,
        attachments: dict[str, bytes] | None = None,
    ) -> None:
        self.metadata = metadata or {}
        self.proved = False  # whether a checksum of its own proves the metadata
        self.attachments = attachments or {}

    def add(self, record: Record) -> None:
        """Take metadata or an attachment from a record; raises Damaged, InputError."""
        if record.opcode == Opcode.METADATA:
            metadata = record.parsed(Metadata)
            if metadata.name == METADATA_NAME:
                entries = dict(metadata.metadata)
                stated = entries.pop(CHECKSUM, None)
                if stated is not None and stated != checksum(entries):
                    raise Damaged(f"metadata at byte {record.offset}: wrong checksum")
                self._check_version(entries)
                self.metadata, self.proved = entries, stated is not None
        elif record.opcode == Opcode.ATTACHMENT:
            attachment = record.parsed(Attachment)
            crc = int.from_bytes(record.content[-4:], "little")
            if crc not in (0, zlib.crc32(record.content[:-4])):
                raise Damaged(f"attachment at byte {record.offset}: wrong checksum")
            self.attachments[attachment.name] = attachment.data

    @staticmethod
    def _check_version(metadata: Mapping[str, str]) -> None:
        version = metadata.get("schema_version", SCHEMA_VERSION)
        if version != SCHEMA_VERSION:
            raise InputError(
                f"log schema version is {version!r}, this program reads {SCHEMA_VERSION!r}; "
                "install a newer proton-twin"
            )


class Run:
    """Samples of all topics without a gap between them.

    capacities: channel -> samples expected.
    """

    def __init__(
        self,
        topics: Topics,
        wanted: Wanted = EVERYTHING,
        capacities: Mapping[int, int] | None = None,
    ) -> None:
        self._topics = topics
        self._wanted = wanted
        self._capacities = capacities or {}
        self._series: dict[int, Series | None] = {}

    def append(self, block: Block) -> None:
        """Take the next samples of one channel; raises InputError."""
        if block.channel not in self._series:
            self._series[block.channel] = self._open(block.channel)
        series = self._series[block.channel]
        if series is not None:
            series.append(block)

    def extend(self, blocks: Iterable[Block]) -> None:
        """Take the next samples of several channels; raises InputError."""
        for block in blocks:
            self.append(block)

    def _open(self, channel: int) -> Series | None:
        topic = self._topics.topic(channel)
        if topic is None or not self._wanted.takes(topic.name):
            return None
        if any(s.topic.name == topic.name for s in self._opened()):
            raise InputError(f"two channels have the topic {topic.name}; write one a topic")
        with at(topic.name):
            fields = None if topic.is_truth else self._wanted.fields
            return Series(topic, self._capacities.get(channel, 0), fields)

    def _opened(self) -> list[Series]:
        return [s for _, s in sorted(self._series.items()) if s is not None]

    @property
    def counts(self) -> dict[int, int]:
        """Samples by channel."""
        return {c: series.count for c, series in self._series.items() if series is not None}

    def holds(self, samples: int, topics: int) -> bool:
        """Whether so many topics have so many samples or more, all from one time to the same."""
        series = self._opened()
        alike = {(s.start, s.count) for s in series}
        if len(series) != topics or len(alike) != 1:
            return False
        return series[0].count >= samples

    def spans(self) -> dict[str, slice]:
        """Topic -> the samples of it that all topics have in common."""
        series = self._opened()
        if not series:
            return {}
        rate, zero = series[0].rate, min(s.start for s in series)
        first = [round((s.start - zero) * 1e-9 * rate) for s in series]
        begin = max(first)
        end = max(begin, min(f + s.count for f, s in zip(first, series, strict=True)))
        return {s.topic.name: slice(begin - f, end - f) for f, s in zip(first, series, strict=True)}

    def require_behind(self, before: Run) -> None:
        """Raise InputError where this does not begin where the run before ended."""
        for one, other in zip(before._opened(), self._opened(), strict=False):
            if one is not other:
                other.require_behind(one)

    def between(self, extras: Extras, start: float, stop: float) -> Log:
        """The log of the samples from ``start`` to before ``stop`` (s); raises InputError."""
        series = self._opened()
        if not series:
            raise InputError(f"has no samples from {start:g} to {stop:g} s")
        rate = series[0].rate
        zero = max(s.start for s in series) * 1e-9
        log = self.trimmed_log(extras)
        first, last = (
            math.ceil(min(max((t - zero) * rate - EARLY, 0), len(log))) for t in (start, stop)
        )
        if first == last:
            raise InputError(
                f"has no samples from {start:g} to {stop:g} s; it goes on from {zero:g} s to "
                f"{zero + len(log) / rate:g} s"
            )
        return log.part(first, last)

    def log(self, extras: Extras) -> Log:
        """The log; raises InputError where topics differ in time or something is missing."""
        self._check_axes()
        self._rate(extras)
        spans = self.spans()
        for series in self._opened():
            if spans[series.topic.name] != slice(0, series.count):
                end = series.start + (series.count - 1) * 1e9 / series.rate
                raise InputError(
                    f"{series.topic.name} has {series.count} samples from "
                    f"{seconds(series.start)} to {seconds(end)}, other topics differ; "
                    "keep what they have in common with: twin recover"
                )
        return self.trimmed_log(extras)

    def trimmed_log(self, extras: Extras) -> Log:
        """The log of the samples all topics have in common; raises InputError."""
        self._check_axes()
        rate = self._rate(extras)
        spans = self.spans()
        columns = ((s.topic, s.columns(spans[s.topic.name])) for s in self._opened())
        return assembled(columns, rate, extras)

    def _rate(self, extras: Extras) -> float:
        return common_rate({s.topic.name: s.rate for s in self._opened()}, extras)

    def _check_axes(self) -> None:
        axes = [s for s in self._opened() if not s.topic.is_truth and s.count]
        names = [s.topic.axis for s in axes]
        for wanted in self._wanted.axes or ():
            if wanted not in names:
                self._refuse_axis(wanted)
        if not axes:
            every = sorted(c.topic for c in self._topics.channels.values())
            if any(topic.startswith("/measured/") for topic in every):
                raise InputError(
                    "is a comparison for viewers (`twin compare --mcap`), not a log: its force is "
                    "averaged; give the log that was compared"
                )
            topics = ", ".join(every) or "none"
            raise InputError(
                f"no samples on a topic {AXIS_PREFIX}<name>; topics in the file: {topics}; "
                "rename them, or convert the log with: twin import"
            )
        for series in axes:
            require_fields(series.topic)

    def _refuse_axis(self, wanted: str) -> None:
        topics = sorted(c.topic for c in self._topics.channels.values())
        axes = [t.removeprefix(AXIS_PREFIX) for t in topics if t.startswith(AXIS_PREFIX)]
        raise InputError(
            f"no samples on topic {AXIS_PREFIX}{wanted}; topics in the file: "
            f"{', '.join(topics) or 'none'}; name an axis of these: {', '.join(axes) or 'none'}"
        )


def require_fields(topic: Topic) -> None:
    """Raise InputError where an axis has no position, or neither current nor force."""
    fields = topic.fields
    if "position" in fields and ("current" in fields or "force" in fields):
        return
    missing = "position" if "position" not in fields else "current or force"
    raise InputError(
        f"{topic.name} has no {missing}; fields in its messages: "
        f"{', '.join(topic.numbers.values()) or 'none'}; rename or add the field, "
        "or convert the log with: twin import"
    )


def common_rate(topics: Mapping[str, float], extras: Extras) -> float:
    """The sample rate of all topics, Hz; raises InputError where they or the metadata differ."""
    rates = dict(topics)
    stated = positive_number(extras.metadata, "sample_rate_hz")
    if stated is not None:
        rates["the metadata"] = stated
    rate = next(iter(rates.values()))
    for name, other in rates.items():
        if abs(other - rate) > 1e-9 * rate:
            raise InputError(
                f"{next(iter(rates))} is sampled at {rate:.9g} Hz, {name} says {other:.9g} Hz; "
                "write all axes at one rate, or convert with: twin import"
            )
    return rate


def assembled(
    columns: Iterable[tuple[Topic, dict[str, Array]]], rate: float, extras: Extras
) -> Log:
    """The log of topics with their columns, sampled at ``rate`` (Hz); raises InputError."""
    axes, truth = {}, {}
    for topic, own in columns:
        if topic.is_truth:
            truth[topic.axis] = own
            continue
        with at(topic.name):
            axes[topic.axis] = AxisLog(own, topic.units, topic.force_constant)
    return Log(rate, axes, extras.metadata, truth, extras.attachments)
