"""The layout of a log in the file: schemas, channels and rows; verifies the log as well."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from mcap.records import Channel, Schema
from mcap.well_known import MessageEncoding, SchemaEncoding

from twin.errors import InputError, at
from twin.logs.assemble import CHECKSUM, SCHEMA_VERSION
from twin.logs.layout import MessageLayout
from twin.logs.log import Array, AxisLog, Log
from twin.logs.schema import (
    AXIS_SAMPLE,
    AXIS_TRUTH,
    FIELD_NUMBERS,
    file_descriptor_set,
    numbered,
    protobuf_segments,
)
from twin.logs.series import seconds
from twin.logs.topics import AXIS_PREFIX, IDENTIFIER, TRUTH_PREFIX, complete_units
from twin.numbers import first_not_finite

SERIES = "twin.Series"  # the message of a topic that no log of a machine has
_TRUTH_UNITS = ("position", "velocity")  # truth columns of these names have the axis' units


@dataclass(frozen=True)
class Signals:
    """One topic to be written: numbers gives field -> protobuf number, in the order written."""

    topic: str
    message: str
    columns: Mapping[str, Array]
    numbers: Mapping[str, int]
    metadata: Mapping[str, str]


Samples = tuple[Mapping[str, Array], ...]
"""The columns (n,) of every topic, in the order of its channels."""


@dataclass(frozen=True)
class Planned:
    """One topic of a file: its schema, channel and the layout of its messages."""

    schema: Schema
    channel: Channel
    layout: MessageLayout


@dataclass(frozen=True)
class Outline:
    """Everything but the samples."""

    metadata: dict[str, str]
    topics: tuple[Planned, ...]

    @property
    def schemas(self) -> tuple[Schema, ...]:
        """Each once."""
        return tuple({topic.schema.id: topic.schema for topic in self.topics}.values())

    @property
    def row_bytes(self) -> int:
        """Size of one message of every topic."""
        return sum(topic.layout.dtype.itemsize for topic in self.topics)


def outline(log: Log) -> Outline:
    """Plan the file; raises InputError for a log that could not be read back."""
    _check_log(log)
    return _planned(_signals(log), _metadata(log))


def samples_of(log: Log, first: int = 0) -> Samples:
    """The columns of a log, or of a part of one that begins with sample ``first``.

    Raises InputError where a column is not one finite number a sample.
    """
    return _checked(_signals(log), len(log), log.sample_rate, first)


def _signals(log: Log) -> list[Signals]:
    return [*_axis_signals(log), *_truth_signals(log)]


def outline_of_topics(
    topics: Mapping[str, Mapping[str, Array]], units: Mapping[str, str], sample_rate: float
) -> tuple[Outline, Samples]:
    """Plan a file of any topics, "/model/x" -> column -> (n,); units: "/model/x/force" -> unit."""
    signals = [
        Signals(
            topic, SERIES, columns, numbered(columns),
            {"sample_rate_hz": repr(float(sample_rate)),
             **{f"unit.{c}": u for c in columns if (u := units.get(f"{topic}/{c}"))}},
        )
        for topic, columns in topics.items()
    ]  # fmt: skip
    count = len(next(iter(signals[0].columns.values())))
    samples = _checked(signals, count, sample_rate)
    return _planned(signals, {"source": "comparison"}), samples


def _checked(topics: Sequence[Signals], count: int, sample_rate: float, first: int = 0) -> Samples:
    for signals in topics:
        with at(signals.topic):
            _check_columns(signals, count, sample_rate, first)
    return tuple(signals.columns for signals in topics)


def _planned(topics: Sequence[Signals], metadata: dict[str, str]) -> Outline:
    schemas: dict[bytes, Schema] = {}
    planned = []
    for number, signals in enumerate(topics, 1):
        data = file_descriptor_set(signals.message, signals.numbers)
        new = Schema(len(schemas) + 1, data, SchemaEncoding.Protobuf, signals.message)
        schema = schemas.setdefault(data, new)
        channel = Channel(
            number, signals.topic, MessageEncoding.Protobuf, dict(signals.metadata), schema.id
        )
        layout = MessageLayout(number, protobuf_segments(signals.numbers))
        planned.append(Planned(schema, channel, layout))
    return Outline(metadata, tuple(planned))


def _axis_signals(log: Log) -> Iterator[Signals]:
    for name, axis in log.axes.items():
        topic = AXIS_PREFIX + name
        with at(topic):
            _check_axis(axis)
            units = complete_units(axis.units)
        numbers = {field: n for field, n in FIELD_NUMBERS.items() if field in axis.columns}
        metadata = {**_common(name, log), **{f"unit.{field}": units[field] for field in numbers}}
        if axis.force_constant is not None:
            metadata["force_constant"] = repr(float(axis.force_constant))
        yield Signals(topic, AXIS_SAMPLE, axis.columns, numbers, metadata)


def _truth_signals(log: Log) -> Iterator[Signals]:
    for name, columns in log.truth.items():
        numbers = numbered(columns)
        units = complete_units(log.axes[name].units) if name in log.axes else {}
        known = {f"unit.{c}": units[c] for c in _TRUTH_UNITS if c in columns and c in units}
        metadata = {**_common(name, log), **known}
        yield Signals(TRUTH_PREFIX + name, AXIS_TRUTH, columns, numbers, metadata)


def _common(axis: str, log: Log) -> dict[str, str]:
    return {"axis": axis, "sample_rate_hz": repr(float(log.sample_rate))}


def _metadata(log: Log) -> dict[str, str]:
    given = {key: value for key, value in log.metadata.items() if key != CHECKSUM}
    return {
        **given,
        "schema_version": SCHEMA_VERSION,
        "sample_rate_hz": repr(float(log.sample_rate)),
        "axes": ",".join(log.axes),
    }


def _check_log(log: Log) -> None:
    if not log.axes or len(log) == 0:
        raise InputError("the log has no samples; record or import at least one")
    if not 0.0 < log.sample_rate < math.inf:
        raise InputError(f"sample rate is {log.sample_rate} Hz; give a number above 0")
    for name in (*log.axes, *log.truth):
        if not IDENTIFIER.fullmatch(name):
            raise InputError(f"axis name {name!r}: use letters, digits and underscores, as in x")
    for key, value in log.metadata.items():
        if not isinstance(value, str):
            raise InputError(f"metadata {key} is {value!r}; metadata values are text")


def _check_axis(axis: AxisLog) -> None:
    unknown = set(axis.columns) - set(FIELD_NUMBERS)
    if unknown:
        raise InputError(
            f"unknown signal {', '.join(sorted(unknown))}; allowed: {', '.join(FIELD_NUMBERS)}"
        )
    if "position" not in axis.columns or not {"current", "force"} & set(axis.columns):
        raise InputError("a log needs position and one of current and force; add what is missing")
    constant = axis.force_constant
    if constant is not None and not 0.0 < constant < math.inf:
        raise InputError(f"force constant is {constant} {axis.kind('N/A')}; give a number above 0")


def _check_columns(signals: Signals, count: int, sample_rate: float, first: int) -> None:
    for name, column in signals.columns.items():
        if not IDENTIFIER.fullmatch(name):
            raise InputError(f"column name {name!r}: use letters, digits and underscores")
        if np.shape(column) != (count,):
            raise InputError(
                f"{name} has shape {np.shape(column)}, expected ({count},): one value a sample"
            )
        if np.asarray(column).dtype.kind not in "fiu":
            raise InputError(f"{name} holds {np.asarray(column).dtype} values; give real numbers")
        if (i := first_not_finite(column)) is not None:
            raise InputError(
                f"{name} is {column[i]} at {seconds((first + i) * 1e9 / sample_rate)} "
                f"(sample {first + i}); "
                "leave out a signal that was not recorded"
            )
