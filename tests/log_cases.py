"""Logs for the tests of the log codec."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
from mcap.writer import Writer

from twin.logs import FIELDS, AxisLog, Log
from twin.logs.log import Array
from twin.logs.topics import file_descriptor_set, tag

RATE = 10_000.0


def column(count: int, seed: int) -> Array:
    """Smooth, noisy, with zeros of either sign: protobuf omits the positive ones."""
    rng = np.random.default_rng(seed)
    values = np.sin(np.arange(count) * 0.01 * (seed + 1)) + 1e-6 * rng.standard_normal(count)
    values[:: seed + 3] = 0.0
    values[1 :: seed + 5] = -0.0
    return values


def two_axes(count: int = 500) -> Log:
    """Two axes that record different fields, truth of one, metadata and attachments."""
    x = AxisLog({f: column(count, i) for i, f in enumerate(FIELDS)})
    y = AxisLog(
        {f: column(count, 10 + i) for i, f in enumerate(("position", "current"))},
        force_constant=53.4,
    )
    truth = {"x": {"position": column(count, 20), **{f"z{i}": column(count, i) for i in range(20)}}}
    return Log(
        RATE,
        {"x": x, "y": y},
        {"source": "simulation", "start_time_unix_ns": "1700000000000000000"},
        truth,
        {"model.toml": b'name = "proton"\n', "model.xml": bytes(range(256))},
    )


def assert_same_samples(got: Log, want: Log, span: slice = slice(None)) -> None:
    """Bit for bit, -0.0 and all."""
    assert got.sample_rate == want.sample_rate
    assert list(got.axes) == list(want.axes)
    assert list(got.truth) == list(want.truth)
    pairs = [(got.axes[n].columns, want.axes[n].columns) for n in want.axes]
    pairs += [(got.truth[n], want.truth[n]) for n in want.truth]
    for columns, expected in pairs:
        assert list(columns) == list(expected)
        for name in expected:
            assert columns[name].tobytes() == expected[name][span].tobytes(), name


def assert_same_log(got: Log, want: Log) -> None:
    """Samples, units, constants, metadata and attachments."""
    assert_same_samples(got, want)
    for name, axis in want.axes.items():
        assert got.axes[name].units == axis.units
        assert got.axes[name].force_constant == axis.force_constant
    assert dict(want.metadata).items() <= dict(got.metadata).items()
    assert got.attachments == want.attachments


def write_together(path: Path, log: Log, *, rows: int = 30, **options: object) -> None:
    """Write the axes as older versions did: rows of all of them in a chunk, by the stock writer.

    Fields are numbered from 1. options: of the stock writer.
    """
    with open(path, "wb") as stream:
        writer = Writer(stream, chunk_size=1 << 30, **options)  # type: ignore[arg-type]
        writer.start()
        channels = {}
        for name, axis in log.axes.items():
            numbers = {f: n for n, f in enumerate(axis.columns, 1)}
            schema = file_descriptor_set("twin.AxisSample", numbers)
            number = writer.register_schema("twin.AxisSample", "protobuf", schema)
            stated = {"sample_rate_hz": repr(log.sample_rate)}
            channel = writer.register_channel(f"/axis/{name}", "protobuf", number, stated)
            channels[name] = channel, numbers
        for k in range(len(log)):
            if k % rows == 0 and k:
                writer.flush()
            time = round(k * 1e9 / log.sample_rate)
            for name, (channel, numbers) in channels.items():
                columns = log.axes[name].columns
                data = b"".join(
                    tag(n) + struct.pack("<d", columns[f][k]) for f, n in numbers.items()
                )
                writer.add_message(channel, time, data, time, k)
        writer.finish()
