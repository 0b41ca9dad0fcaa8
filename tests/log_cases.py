"""Logs for the tests of the log codec, and files as other writers make them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from google.protobuf.message_factory import GetMessages
from mcap.writer import CompressionType, Writer

from twin.logs import FIELDS, AxisLog, Log
from twin.logs.codecs import file_descriptor_set
from twin.logs.log import Array

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


Encode = Callable[[Mapping[str, float]], bytes]


def protobuf_encoder(fields: tuple[str, ...]) -> tuple[bytes, Encode]:
    """Schema and encoder with the stock protobuf library, which omits zeros."""
    schema = file_descriptor_set("twin.AxisSample", {f: n for n, f in enumerate(fields, 1)})
    message = GetMessages(FileDescriptorSet.FromString(schema).file)["twin.AxisSample"]
    return schema, lambda values: message(**values).SerializeToString()


def write_foreign(
    path: Path,
    log: Log,
    encode: Encode,
    *,
    schema: tuple[str, str, bytes],
    encoding: str,
    start: int = 0,
    metadata: Mapping[str, str] | None = None,
    times: Callable[[int], int] = lambda k: k * 100_000,
    compression: CompressionType = CompressionType.ZSTD,
    chunk_size: int = 1 << 14,
    use_chunking: bool = True,
    enable_crcs: bool = True,
) -> None:
    """Write the axes with the stock MCAP writer, sequence numbers unused."""
    with open(path, "wb") as stream:
        writer = Writer(
            stream,
            chunk_size=chunk_size,
            compression=compression,
            use_chunking=use_chunking,
            enable_crcs=enable_crcs,
        )
        writer.start()
        schema_id = writer.register_schema(*schema)
        camera = writer.register_channel("/camera", "json", 0)
        channels = {
            name: writer.register_channel(f"/axis/{name}", encoding, schema_id, metadata or {})
            for name in log.axes
        }
        writer.add_message(camera, start, b"{}", start)
        for k in range(len(log)):
            for name, axis in log.axes.items():
                values = {f: float(c[k]) for f, c in axis.columns.items()}
                time = start + times(k)
                writer.add_message(channels[name], time, encode(values), time)
        writer.finish()
