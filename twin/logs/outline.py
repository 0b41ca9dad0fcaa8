"""What a file holds of a log: schemas, channels, layouts and columns; verifies the log as well."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from mcap.records import Channel, Schema
from mcap.well_known import MessageEncoding, SchemaEncoding

from twin.errors import InputError, at
from twin.logs.decode import CHECKSUM, SCHEMA_VERSION
from twin.logs.log import Array, AxisLog, Log
from twin.logs.messages import (
    AXIS_SAMPLE,
    AXIS_TRUTH,
    FIELD_NUMBERS,
    MessageLayout,
    file_descriptor_set,
    numbered,
)
from twin.logs.series import seconds
from twin.logs.topics import AXIS_PREFIX, IDENTIFIER, TRUTH_PREFIX, complete_units
from twin.numbers import first_not_finite

_TRUTH_UNITS = ("position", "velocity")  # truth columns of these names have the axis' units


@dataclass(frozen=True)
class Signals:
    """One topic to be written: numbers gives field -> protobuf number, in the order written."""

    topic: str
    message: str
    columns: Mapping[str, Array]
    numbers: Mapping[str, int]
    metadata: Mapping[str, str]


@dataclass(frozen=True)
class Planned:
    """One topic of a file: its schema, channel and the layout of its messages."""

    schema: Schema
    channel: Channel
    layout: MessageLayout


@dataclass(frozen=True)
class Outline:
    """Everything of a file but the samples. sample_rate: Hz."""

    topics: tuple[Planned, ...]
    sample_rate: float
    metadata: Mapping[str, str]
    attachments: Mapping[str, bytes]

    @classmethod
    def of(
        cls, topics: Iterable[Signals], sample_rate: float, metadata: Mapping[str, str],
        attachments: Mapping[str, bytes],
    ) -> Outline:  # fmt: skip
        """The file of these topics; equal schemas are written once."""
        schemas: dict[bytes, Schema] = {}
        planned = []
        for number, signals in enumerate(topics, 1):
            data = file_descriptor_set(signals.message, signals.numbers)
            new = Schema(len(schemas) + 1, data, SchemaEncoding.Protobuf, signals.message)
            schema = schemas.setdefault(data, new)
            channel = Channel(
                number, signals.topic, MessageEncoding.Protobuf, dict(signals.metadata), schema.id
            )
            planned.append(Planned(schema, channel, MessageLayout(number, signals.numbers)))
        return cls(tuple(planned), sample_rate, metadata, attachments)


def outline_of(log: Log) -> Outline:
    """The file of a log; raises InputError for one that could not be read back."""
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
    rate, axes = repr(float(log.sample_rate)), ",".join(log.axes)
    own = {"schema_version": SCHEMA_VERSION, "sample_rate_hz": rate, "axes": axes}
    given = {key: value for key, value in log.metadata.items() if key != CHECKSUM}
    return Outline.of(signals_of(log), log.sample_rate, {**given, **own}, log.attachments)


def signals_of(log: Log) -> Iterator[Signals]:
    """The topics of a log, or of a part of one; raises InputError where an axis lacks anything."""
    rate = {"sample_rate_hz": repr(float(log.sample_rate))}
    for name, axis in log.axes.items():
        topic = AXIS_PREFIX + name
        with at(topic):
            _check_axis(axis)
            units = complete_units(axis.units)
        numbers = {field: n for field, n in FIELD_NUMBERS.items() if field in axis.columns}
        known = {f"unit.{field}": units[field] for field in numbers}
        metadata = {"axis": name, **rate, **known}
        if axis.force_constant is not None:
            metadata["force_constant"] = repr(float(axis.force_constant))
        yield Signals(topic, AXIS_SAMPLE, axis.columns, numbers, metadata)
    for name, columns in log.truth.items():
        units = complete_units(log.axes[name].units) if name in log.axes else {}
        known = {f"unit.{c}": units[c] for c in _TRUTH_UNITS if c in columns and c in units}
        metadata = {"axis": name, **rate, **known}
        yield Signals(TRUTH_PREFIX + name, AXIS_TRUTH, columns, numbered(columns), metadata)


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


def require_samples(signals: Signals, count: int, sample_rate: float, first: int) -> None:
    """Raise InputError where a column is not one finite number for each of ``count`` samples.

    first: number of the first of them in the log.
    """
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
