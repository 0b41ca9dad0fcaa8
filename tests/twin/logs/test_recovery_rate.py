"""How much comes back of a damaged log: of chunks that the damage did not touch, everything.

Ten kinds of damage. No sample that comes back may differ from the one that
was written, and what no checksum proves comes back only on request.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from log_cases import RATE, two_axes
from mcap_bytes import CHUNK, MESSAGE_INDEX, Piece, records

from twin.errors import InputError
from twin.logs import Log, recover_log, write_log, writer

COUNT, PER_CASE = 400, 6
LOG = Log(RATE, {"x": two_axes(COUNT).axes["x"]})
_CRC_AT = 9 + 24  # of a chunk record


@dataclass(frozen=True)
class File:
    """A log in bytes, with its chunks and the samples in each."""

    data: bytes
    chunks: list[Piece]
    samples: list[range]

    def behind(self, number: int) -> int:
        """Where the message indexes of a chunk end."""
        following = [r for r in records(self.data) if r.start >= self.chunks[number].end]
        return next(r.start for r in following if r.opcode != MESSAGE_INDEX)


Damage = tuple[bytes, set[int]]  # the damaged bytes, and the chunks that the damage touched


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> File:
    path = tmp_path_factory.mktemp("log") / "a.mcap"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(writer, "CHUNK_BYTES", 4000)
        write_log(LOG, path)
    data = path.read_bytes()
    chunks = [r for r in records(data) if r.opcode == CHUNK]
    starts = [round(int.from_bytes(c.body[:8], "little") * 1e-9 * RATE) for c in chunks]
    return File(
        data, chunks, [range(a, b) for a, b in zip(starts, [*starts[1:], COUNT], strict=True)]
    )


def overwritten(file: File, start: int, new: bytes) -> Damage:
    end = start + len(new)
    touched = {i for i, c in enumerate(file.chunks) if c.start < end and start < c.end}
    return file.data[:start] + new + file.data[end:], touched


def anywhere(file: File, rng: np.random.Generator) -> int:
    return int(rng.integers(file.chunks[0].start, file.chunks[-1].end))


def a_bit(file: File, rng: np.random.Generator) -> Damage:
    place = anywhere(file, rng)
    return overwritten(file, place, bytes([file.data[place] ^ 1 << int(rng.integers(8))]))


def zeros(file: File, rng: np.random.Generator) -> Damage:
    return overwritten(file, anywhere(file, rng), bytes(int(rng.integers(1, 600))))


def noise(file: File, rng: np.random.Generator) -> Damage:
    return overwritten(file, anywhere(file, rng), rng.bytes(int(rng.integers(1, 600))))


def a_length(file: File, rng: np.random.Generator) -> Damage:
    place = file.chunks[int(rng.integers(len(file.chunks)))].start + 1 + int(rng.integers(8))
    return overwritten(file, place, rng.bytes(1))


def a_cut(file: File, rng: np.random.Generator) -> Damage:
    place = anywhere(file, rng)
    return file.data[:place], {i for i, c in enumerate(file.chunks) if c.end > place}


def bytes_gone(file: File, rng: np.random.Generator) -> Damage:
    start, size = anywhere(file, rng), int(rng.integers(1, 300))
    _, touched = overwritten(file, start, bytes(size))
    return file.data[:start] + file.data[start + size :], touched


def bytes_more(file: File, rng: np.random.Generator) -> Damage:
    start = anywhere(file, rng)
    touched = {i for i, c in enumerate(file.chunks) if c.start < start < c.end}
    return file.data[:start] + rng.bytes(int(rng.integers(1, 300))) + file.data[start:], touched


def swapped(file: File, rng: np.random.Generator) -> Damage:
    i, j = sorted(rng.choice(len(file.chunks), 2, replace=False))
    a, b = file.chunks[i].start, file.behind(i)
    c, d = file.chunks[j].start, file.behind(j)
    data = file.data
    return data[:a] + data[c:d] + data[b:c] + data[a:b] + data[d:], set()


def doubled(file: File, rng: np.random.Generator) -> Damage:
    i = int(rng.integers(len(file.chunks)))
    start, end = file.chunks[i].start, file.behind(i)
    return file.data[:end] + file.data[start:end] + file.data[end:], set()


def no_checksum(file: File, rng: np.random.Generator) -> Damage:
    i = int(rng.integers(len(file.chunks)))
    chunk = file.chunks[i]
    data = bytearray(file.data)
    data[chunk.start + _CRC_AT : chunk.start + _CRC_AT + 4] = bytes(4)
    data[int(rng.integers(chunk.start + 60, chunk.end))] ^= 1 << int(rng.integers(8))
    return bytes(data), {i}


KINDS: tuple[Callable[[File, np.random.Generator], Damage], ...] = (
    a_bit, zeros, noise, a_length, a_cut, bytes_gone, bytes_more, swapped, doubled, no_checksum,
)  # fmt: skip


def returned(path: Path, **options: bool) -> set[int]:
    """Numbers of the samples that came back; each must be the one that was written."""
    try:
        log, recovery = recover_log(path, **options)
    except InputError:
        return set()
    numbers: set[int] = set()
    for part in (log, *recovery.others):
        text = part.metadata.get("recovered", "0 from 0 s")
        first = round(float(text.split(" from ")[1].split()[0]) * RATE)
        where = np.arange(first, first + len(part))
        for name, column in part.axes["x"].columns.items():
            np.testing.assert_array_equal(column, LOG.axes["x"].columns[name][where])
        numbers |= set(where)
    return numbers


@pytest.mark.parametrize("kind", KINDS, ids=lambda k: k.__name__)
def test_chunks_that_the_damage_did_not_touch_come_back_whole(
    file: File, kind: Callable[[File, np.random.Generator], Damage], tmp_path: Path
) -> None:
    rng = np.random.default_rng(1)
    path, untouched, back = tmp_path / "a.mcap", 0, 0
    for _ in range(PER_CASE):
        data, touched = kind(file, rng)
        path.write_bytes(data)
        wanted = {s for i, r in enumerate(file.samples) if i not in touched for s in r}
        untouched += len(wanted)
        back += len(wanted & returned(path))
    assert back >= 0.999 * untouched, f"{back} of {untouched}"


def test_what_no_checksum_proves_comes_back_only_on_request(file: File, tmp_path: Path) -> None:
    path, chunk = tmp_path / "a.mcap", file.chunks[2]
    data = bytearray(file.data)
    data[chunk.start + _CRC_AT : chunk.start + _CRC_AT + 4] = bytes(4)
    path.write_bytes(data)
    log, recovery = recover_log(path)
    assert len(log) + sum(map(len, recovery.others)) == COUNT - len(file.samples[2])
    assert f"chunk at byte {chunk.start}: has no checksum" in "; ".join(recovery.lost)
    log, recovery = recover_log(path, unproved=True)
    assert len(log) == COUNT
    assert "no checksum" in log.metadata["not_proved"]
    assert f"chunk at byte {chunk.start}: has no checksum" in "; ".join(recovery.unproved)
