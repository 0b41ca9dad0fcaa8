"""A log of five chunks, the ways in which it is damaged, and what a recovery tells of it."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from mcap.opcode import Opcode
from mcap_bytes import Piece, of

from twin.errors import InputError
from twin.logs import AxisLog, Log, Recovery, read_log, recover_log

RATE, COUNT, PER_CHUNK = 500.0, 33, 7
CHUNKS = -(-COUNT // PER_CHUNK)
ROW = 31 + 4 * 12
NAMES = ("position", "velocity", "current", "force")
LOG = Log(
    RATE,
    {"x": AxisLog({n: 1e3 * i + np.arange(COUNT) for i, n in enumerate(NAMES, 1)})},
    {"source": "a test"},
    attachments={"model.toml": b"mass = 1.0\n"},
)
CRC_AT = 9 + 24  # of a chunk record


@dataclass(frozen=True)
class Case:
    """The bytes of the log and its records."""

    data: bytes
    records: list[Piece]

    @property
    def chunks(self) -> list[Piece]:
        """Its chunk records."""
        return [r for r in self.records if r.opcode == Opcode.CHUNK]

    def behind(self, number: int) -> int:
        """End of the message indexes behind a chunk."""
        following = [r for r in self.records if r.start >= self.chunks[number].end]
        return next(r.start for r in following if r.opcode != Opcode.MESSAGE_INDEX)


def samples_of(*chunks: int) -> set[int]:
    """Numbers of the samples in chunks."""
    return {k for k in range(COUNT) if k // PER_CHUNK in chunks}


def span(count: str, seconds: str) -> set[int]:
    """Numbers of so many samples from a time on."""
    first = round(float(seconds) * RATE)
    return set(range(first, first + int(count)))


@dataclass(frozen=True)
class Account:
    """Samples by what became of them, as the sentences of a recovery state it."""

    kept: set[int]
    left_out: list[set[int]]
    damaged: set[int]

    @property
    def all(self) -> set[int]:
        """Every sample that is spoken of."""
        return self.kept.union(self.damaged, *self.left_out)


def account(case: Case, recovery: Recovery) -> Account:
    """Read the sentences; a chunk is damaged where it or bytes of it are named."""
    left_out, damaged = [], set()
    for sentence in recovery.lost:
        if found := re.match(
            r"(\d+) intact samples from (\S+) s are in a log of their own", sentence
        ):
            left_out.append(span(*found.groups()))
        for number, chunk in enumerate(case.chunks):
            if re.search(rf"[Cc]hunk (record )?at byte {chunk.start}: ", sentence):
                damaged |= samples_of(number)
            if found := re.match(r"bytes (\d+) to (\d+): ", sentence):
                first, last = (int(g) for g in found.groups())
                if first < chunk.end and last >= chunk.start:
                    damaged |= samples_of(number)
        if found := re.match(r"/axis/x: (\d+) samples are missing, from (\S+) s to", sentence):
            damaged |= span(*found.groups())
    return Account(kept(recovery.kept), left_out, damaged)


def kept(text: str) -> set[int]:
    """The samples of a sentence."""
    match = re.fullmatch(r"(\d+) samples from (\S+) s", text)
    assert match or text == f"all {COUNT} samples", text
    return span(*match.groups()) if match else set(range(COUNT))


def recovered(path: Path, data: bytes) -> tuple[Log, Recovery]:
    """The file is refused by strict reading; what is recovered is what was written."""
    path.write_bytes(data)
    with pytest.raises(InputError) as caught:
        read_log(path)
    log, recovery = recover_log(path)
    assert recovery.lost
    assert all("\n" not in loss for loss in recovery.lost)
    assert str(caught.value).removeprefix(f"{path}: ").startswith(recovery.lost[0])
    assert log.metadata["recovered"] == recovery.kept
    for part in (log, *recovery.others):
        where = sorted(kept(part.metadata["recovered"]))
        assert len(part) == len(where)
        for field, column in LOG.axes["x"].columns.items():
            np.testing.assert_array_equal(part.axes["x"].columns[field], column[where])
    return log, recovery


def spoilt(case: Case, *chunks: int) -> bytes:
    """Flip a bit of the compressed samples of some chunks."""
    return flipped(case.data, *(case.chunks[number].end - 20 for number in chunks), mask=0x40)


def without(case: Case, data: bytes, gone: set[int]) -> Case:
    """Changed bytes of the log less some chunks, and where in them the others are."""
    cuts = [case.chunks[number] for number in sorted(gone)]
    left = bytearray(data)
    for chunk in reversed(cuts):
        del left[chunk.start : chunk.end]
    moved = []
    for number, chunk in enumerate(case.chunks):
        shift = sum(c.end - c.start for c in cuts if c.start < chunk.start)
        place = (-1, -1) if number in gone else (chunk.start - shift, chunk.end - shift)
        moved.append(replace(chunk, start=place[0], end=place[1]))
    return Case(bytes(left), moved)


def flipped(data: bytes, *places: int, mask: int = 1) -> bytes:
    """The bytes with these bits flipped at some places."""
    out = bytearray(data)
    for place in places:
        out[place] ^= mask
    return bytes(out)


def damage(path: Path, *chunks: int) -> None:
    """Flip a bit of the samples in some chunks of a file."""
    ends = [r.end for r in of(path.read_bytes(), Opcode.CHUNK)]
    path.write_bytes(flipped(path.read_bytes(), *(ends[number] - 50 for number in chunks)))


def runs_without(*missing: int) -> list[set[int]]:
    """Samples of the stretches of chunks between those missing."""
    runs: list[set[int]] = [set()]
    for number in range(CHUNKS):
        if number in missing:
            runs.append(set())
        else:
            runs[-1] |= samples_of(number)
    return [r for r in runs if r]


# Damage drawn at random: the bytes, and the chunks that it touched

Damage = tuple[bytes, set[int]]


def _overwritten(case: Case, start: int, new: bytes) -> Damage:
    end = start + len(new)
    touched = {i for i, c in enumerate(case.chunks) if c.start < end and start < c.end}
    return case.data[:start] + new + case.data[end:], touched


def _anywhere(case: Case, rng: np.random.Generator) -> int:
    return int(rng.integers(case.chunks[0].start, case.chunks[-1].end))


def zeros(case: Case, rng: np.random.Generator) -> Damage:
    return _overwritten(case, _anywhere(case, rng), bytes(int(rng.integers(1, 600))))


def noise(case: Case, rng: np.random.Generator) -> Damage:
    return _overwritten(case, _anywhere(case, rng), rng.bytes(int(rng.integers(1, 600))))


def bytes_gone(case: Case, rng: np.random.Generator) -> Damage:
    start, size = _anywhere(case, rng), int(rng.integers(1, 300))
    _, touched = _overwritten(case, start, bytes(size))
    return case.data[:start] + case.data[start + size :], touched


def bytes_more(case: Case, rng: np.random.Generator) -> Damage:
    start = _anywhere(case, rng)
    touched = {i for i, c in enumerate(case.chunks) if c.start < start < c.end}
    return case.data[:start] + rng.bytes(int(rng.integers(1, 300))) + case.data[start:], touched


def swapped(case: Case, rng: np.random.Generator) -> Damage:
    i, j = sorted(rng.choice(CHUNKS, 2, replace=False))
    a, b = case.chunks[i].start, case.behind(i)
    c, d = case.chunks[j].start, case.behind(j)
    data = case.data
    return data[:a] + data[c:d] + data[b:c] + data[a:b] + data[d:], set()


def doubled(case: Case, rng: np.random.Generator) -> Damage:
    i = int(rng.integers(CHUNKS))
    start, end = case.chunks[i].start, case.behind(i)
    return case.data[:end] + case.data[start:end] + case.data[end:], set()


DRAWN: tuple[Callable[[Case, np.random.Generator], Damage], ...] = (
    zeros,
    noise,
    bytes_gone,
    bytes_more,
    swapped,
    doubled,
)
