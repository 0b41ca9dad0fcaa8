"""A small file may not cost much time or memory, whatever it announces."""

import resource
import struct
import time
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import zstandard
from log_cases import RATE, two_axes
from mcap.records import Channel, Chunk, Message
from mcap_bytes import MAGIC, joined, json_channel, plain_file

from twin.errors import InputError
from twin.logs import Log, read_log, recover_log, write_log

SECONDS = 5.0
MEGABYTES = 256.0
GIGABYTE = 1 << 30


def bomb(content: bytes, size: int, behind: bytes = b"") -> bytes:
    """A file with one chunk that repeats the content up to that size."""
    compressor = zstandard.ZstdCompressor(level=3).compressobj(
        size=size // len(content) * len(content)
    )
    block = content * max((1 << 20) // len(content), 1)
    left, crc, parts = size // len(content) * len(content), 0, []
    while left:
        part = block[:left]
        parts.append(compressor.compress(part))
        crc, left = zlib.crc32(part, crc), left - len(part)
    parts.append(compressor.flush())
    chunk = Chunk("zstd", b"".join(parts), 0, 0, crc, size // len(content) * len(content))
    return plain_file([chunk]) + behind


def claims(size: int) -> bytes:
    """A chunk of a few bytes that claims to be that large."""
    return plain_file([Chunk("lz4", b"\x04\x22\x4d\x18@@\xc0", 0, 0, 1, size)])


def heads(count: int) -> bytes:
    """What looks like so many chunks, each as large as most of the file."""
    size = 27 * count
    head = struct.pack("<BQQQQII", 6, size + 44, 0, 1, size, 1, 4) + b"zstd"
    return MAGIC + (head + size.to_bytes(8, "little")) * count


CHANNEL = joined([json_channel(1, "/axis/x")])
OTHER = joined([Message(7, 0, b"{}", 0, 0)])
DEEP = joined([json_channel(1, "/axis/x"), Message(1, 0, b"[" * 100_000, 0, 0)])
MANY = plain_file([Channel(i % 65536, f"/axis/a{i}", "json", {}, 0) for i in range(20_000)])

NOISE = bytes(np.random.default_rng(1).integers(0, 256, 1 << 20, np.uint8))

CASES: dict[str, Callable[[], bytes]] = {
    "zeros": lambda: bomb(bytes(1000), GIGABYTE // 2),
    "records of no content": lambda: bomb(b"\x80" + bytes(8), 8 << 20),
    "one channel again and again": lambda: bomb(CHANNEL, 15 << 20),
    "messages of no channel": lambda: bomb(OTHER, 15 << 20),
    "one channel in a larger file": lambda: bomb(CHANNEL, 200 << 20, b"\x09" + NOISE),
    "a claim": lambda: claims(1 << 60),
    "deep nesting": lambda: bomb(DEEP, len(DEEP)),
    "many channels": lambda: MANY,
    "heads of large chunks": lambda: heads(100_000),
}


@pytest.mark.parametrize("case", CASES)
def test_an_answer_takes_seconds_and_little_memory(case: str, tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    path.write_bytes(CASES[case]())
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for read in (read_log, recover_log):
        began = time.process_time()
        with pytest.raises(InputError) as refused:
            read(path)
        assert time.process_time() - began < SECONDS
        assert "\n" not in str(refused.value)
    grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024
    assert grown < MEGABYTES + path.stat().st_size / 2**20


def test_a_bomb_beside_a_log_costs_none_of_its_samples(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    write_log(Log(RATE, {"x": two_axes(200).axes["x"]}), path)
    chunk = bomb(bytes(1000), GIGABYTE // 4)[8 + 25 : -60]
    path.write_bytes(path.read_bytes()[:-8] + chunk)
    assert len(recover_log(path)[0]) == 200
