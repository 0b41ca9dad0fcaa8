"""Every topic has chunks of its own: one is read, or lost, without the others."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from log_cases import assert_same_samples, two_axes, write_together
from mcap.records import ChunkIndex
from mcap_bytes import CHUNK, CHUNK_INDEX, Piece, parsed, records

from twin.errors import InputError
from twin.logs import FIELDS, AxisLog, Log, read_log, recover_log, write_log
from twin.logs import container as chunks
from twin.logs import writer as encode
from twin.logs.container import McapFile
from twin.logs.decode import read_parts, verified_parts
from twin.logs.outline import outline

COUNT, PER_CHUNK = 100, 13
LOG = two_axes(COUNT)
CHANNELS = {1: LOG.axes["x"].columns, 2: LOG.axes["y"].columns, 3: LOG.truth["x"]}


@pytest.fixture
def path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(encode, "CHUNK_BYTES", PER_CHUNK * outline(LOG).row_bytes)
    write_log(LOG, tmp_path / "a.mcap")
    return tmp_path / "a.mcap"


@pytest.fixture
def decompressed(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Places of the chunks that were decompressed."""
    places: list[int] = []
    inner = chunks.open_chunk
    monkeypatch.setattr(
        chunks, "open_chunk",
        lambda record, budget: places.append(record.offset) or inner(record, budget),
    )  # fmt: skip
    return places


def chunks_of(path: Path) -> dict[int, list[Piece]]:
    """The chunks of each channel."""
    pieces = records(path.read_bytes())
    at = {p.start: p for p in pieces if p.opcode == CHUNK}
    out: dict[int, list[Piece]] = {}
    for index in (parsed(ChunkIndex, p) for p in pieces if p.opcode == CHUNK_INDEX):
        (channel,) = index.message_index_offsets
        out.setdefault(channel, []).append(at[index.chunk_start_offset])
    return out


def test_only_chunks_of_what_is_asked_for_are_read(path, decompressed, monkeypatch):
    """Not even from the disk, if it is not the whole that is read in parts."""
    of, read = chunks_of(path), []
    inner = McapFile._record
    monkeypatch.setattr(
        McapFile, "_record",
        lambda self, offset, end: read.append(found := inner(self, offset, end)) or found,
    )  # fmt: skip
    for asked, channels in (
        ({"axes": ("x",), "truth": False}, [1]), ({"axes": ("y",)}, [2]),
        ({"truth": False}, [1, 2]), ({"axes": ("x",)}, [1, 3]),
    ):  # fmt: skip
        read.clear()
        decompressed.clear()
        got = read_log(path, **asked)
        assert sorted(decompressed) == sorted(p.start for c in channels for p in of[c])
        first = min(p.start for own in of.values() for p in own)  # ends what is before the chunks
        assert {r.offset for r in read if r.opcode == CHUNK} <= {first, *decompressed}
        truth = {"x": LOG.truth["x"]} if 3 in channels else {}
        axes = {a: LOG.axes[a] for n, a in ((1, "x"), (2, "y")) if n in channels}
        assert_same_samples(got, Log(LOG.sample_rate, axes, truth=truth))
    decompressed.clear()
    assert sum(len(part) for part in read_parts(path, 20)) == COUNT
    assert sorted(decompressed) == sorted(p.start for c in (1, 2) for p in of[c])


def test_a_flipped_bit_in_what_is_not_asked_for_is_found_by_a_check_alone(path):
    chunk = chunks_of(path)[3][2]
    data = bytearray(path.read_bytes())
    data[chunk.end - 5] ^= 1
    path.write_bytes(data)
    assert len(read_log(path, truth=False)) == COUNT
    assert sum(map(len, read_parts(path, 20))) == COUNT
    for read in (read_log, lambda p: list(verified_parts(p, 20))):
        with pytest.raises(InputError, match="twin recover"):
            read(path)


@pytest.mark.parametrize("seed", range(4))
def test_what_damage_did_not_touch_comes_back_whatever_else_is_lost(path, seed):
    """Every sample of every channel, in the log or in those beside it; and each is as written."""
    rng = np.random.default_rng(seed)
    of, data = chunks_of(path), bytearray(path.read_bytes())
    hit = {c: {int(i) for i in rng.integers(0, len(own), 1 + seed % 2)} for c, own in of.items()}
    for channel, numbers in hit.items():
        for i in numbers:
            data[of[channel][i].end - 1 - int(rng.integers(20))] ^= 1 << int(rng.integers(8))
    path.write_bytes(data)
    log, recovery = recover_log(path)
    found: dict[int, set[int]] = {1: set(), 2: set(), 3: set()}
    for part in (log, *recovery.others):
        first = round(float(part.metadata["recovered"].split(" from ")[1].split()[0]) * 1e4)
        where = range(first, first + len(part))
        columns = {n: part.axes[a].columns for n, a in ((1, "x"), (2, "y")) if a in part.axes}
        columns |= {3: part.truth["x"]} if part.truth else {}
        for channel, own in columns.items():
            found[channel] |= set(where)
            for name, column in own.items():
                assert column.tobytes() == CHANNELS[channel][name][where].tobytes()
    whole = {
        c: {k for i in range(len(own)) if i not in hit[c]
            for k in range(i * PER_CHUNK, min((i + 1) * PER_CHUNK, COUNT))}
        for c, own in of.items()
    }  # fmt: skip
    assert (found[1], found[2]) == (whole[1], whole[2])
    assert found[3] == whole[3] & (whole[1] | whole[2])  # truth alone is no log


def test_the_longest_part_is_the_one_with_most_samples_of_all_topics(path):
    of, data = chunks_of(path), bytearray(path.read_bytes())
    data[of[2][6].end - 9] ^= 1
    path.write_bytes(data)
    log, recovery = recover_log(path)
    assert_same_samples(log, LOG, slice(6 * PER_CHUNK))
    alone, behind = recovery.others
    assert (list(alone.axes), len(alone), len(behind)) == (["x"], PER_CHUNK, COUNT - 7 * PER_CHUNK)
    assert any("/axis/y has no samples there" in loss for loss in recovery.lost)


def test_logs_with_all_topics_in_one_chunk_are_read_too(tmp_path):
    """As older versions wrote them: whole, in part, and in parts."""
    fields = ("position", "force")
    axes = {
        a: AxisLog({f: LOG.axes["x"].columns[f] + n for f in fields}) for n, a in enumerate("xy")
    }
    old = Log(LOG.sample_rate, axes)
    write_together(tmp_path / "a.mcap", old, rows=11)
    got = read_log(tmp_path / "a.mcap")
    for name in axes:
        one = read_log(tmp_path / "a.mcap", axes=(name,))
        assert list(one.axes) == [name]
        for field, column in axes[name].columns.items():
            np.testing.assert_array_equal(got.axes[name].columns[field], column)
            np.testing.assert_array_equal(one.axes[name].columns[field], column)
    ends = np.cumsum([0, *(len(part) for part in read_parts(tmp_path / "a.mcap", 20))])
    assert ends[-1] == COUNT
    assert all(b - a >= 20 for a, b in pairwise(ends[:-1]))


def test_a_log_is_smaller_than_the_stock_writers(tmp_path):
    """Though that has all topics in one chunk, whose messages repeat the head of the one before."""
    count, rng = 4000, np.random.default_rng(1)
    t = np.arange(count) / LOG.sample_rate

    def axis(phase: float) -> AxisLog:
        motion = 0.1 * np.sin(9.0 * t + phase)
        noisy = {"position": 1e-9, "force": 0.05, "current": 1e-3}
        read = {n: motion + size * rng.standard_normal(count) for n, size in noisy.items()}
        return AxisLog({f: read.get(f, motion) for f in FIELDS if f != "velocity"})

    log = Log(LOG.sample_rate, {"x": axis(0.0), "y": axis(1.0)})
    write_log(log, tmp_path / "own.mcap")
    write_together(tmp_path / "stock.mcap", log, rows=4000)
    own, stock = ((tmp_path / f"{n}.mcap").stat().st_size for n in ("own", "stock"))
    assert own < stock
