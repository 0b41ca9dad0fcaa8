"""Logs against the stock MCAP library: the same samples, the same compression and checksums."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message_factory import GetMessages
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from mcap_protobuf.decoder import DecoderFactory

from benchmarks.figures import Figure, Target
from benchmarks.timing import Array, interleaved, ratio
from twin.logs import AxisLog, Log, read_log, write_log
from twin.logs.topics import AXIS_SAMPLE, file_descriptor_set

SAMPLES = 200_000
SIGNALS = ("setpoint_position", "setpoint_velocity", "position", "force")
TITLE = f"MCAP logs: {SAMPLES / 1e6:g} million samples of 2 axes x {len(SIGNALS)} signals"
RATE = 10_000.0  # Hz
ROUNDS = 2
NUMBERS = {name: number for number, name in enumerate(SIGNALS, 1)}  # as anyone would


def measure() -> list[Figure]:
    """How many times faster than the stock writer with protobuf objects and the stock reader."""
    rng = np.random.default_rng(3)
    axes = {a: AxisLog({s: rng.standard_normal(SAMPLES) for s in SIGNALS}) for a in "xy"}
    log = Log(RATE, axes)
    with tempfile.TemporaryDirectory() as folder:
        own, stock = Path(folder) / "own.mcap", Path(folder) / "stock.mcap"
        jobs = [
            lambda: write_log(log, own),
            lambda: _stock_write(log, stock),
            lambda: read_log(own),
            lambda: _stock_read(stock),
        ]
        write, stock_write, read, stock_read = interleaved(jobs, ROUNDS).T
        _require_same(log, read_log(own), _stock_read(own))
        sizes = own.stat().st_size / stock.stat().st_size
    return [
        Figure(
            "write, times faster than the stock writer", ratio(stock_write, write), "1",
            Target(low=1.0), f"{np.median(write):.2f} s against {np.median(stock_write):.2f} s",
        ),
        Figure(
            "read, times faster than the stock reader", ratio(stock_read, read), "1",
            Target(low=1.0), f"{np.median(read):.2f} s against {np.median(stock_read):.2f} s",
        ),
        Figure("file size over that of the stock writer", sizes, "1", Target(high=1.0)),
    ]  # fmt: skip


def _stock_write(log: Log, path: Path) -> None:
    schema = file_descriptor_set(AXIS_SAMPLE, NUMBERS)
    message = GetMessages(FileDescriptorSet.FromString(schema).file, DescriptorPool())[AXIS_SAMPLE]
    with open(path, "wb") as stream:
        writer = Writer(stream, compression=CompressionType.ZSTD, enable_data_crcs=True)
        writer.start()
        schema_id = writer.register_schema(AXIS_SAMPLE, "protobuf", schema)
        channels = [writer.register_channel(f"/axis/{a}", "protobuf", schema_id) for a in log.axes]
        rows = [np.stack([a.columns[s] for s in SIGNALS], 1).tolist() for a in log.axes.values()]
        for k in range(len(log)):
            time = round(k * 1e9 / RATE)
            for channel, samples in zip(channels, rows, strict=True):
                data = message(**dict(zip(SIGNALS, samples[k], strict=True))).SerializeToString()
                writer.add_message(channel, time, data, time, k)
        writer.finish()


def _stock_read(path: Path) -> dict[str, Array]:
    """(n, n_signals) of every topic."""
    topics: dict[str, list[tuple[float, ...]]] = {}
    with open(path, "rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        for _, channel, _, m in reader.iter_decoded_messages():
            row = tuple(getattr(m, s) for s in SIGNALS)
            topics.setdefault(channel.topic, []).append(row)
    return {topic: np.array(rows) for topic, rows in topics.items()}


def _require_same(log: Log, own: Log, stock: dict[str, Array]) -> None:
    for name, axis in log.axes.items():
        wanted = np.stack([axis.columns[s] for s in SIGNALS], 1)
        for read in (own.axes[name].columns, dict(zip(SIGNALS, stock[f"/axis/{name}"].T))):  # noqa: B905
            np.testing.assert_array_equal(np.stack([read[s] for s in SIGNALS], 1), wanted)
