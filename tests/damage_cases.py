"""A small log of one topic in five chunks, ways to damage it, and what recovery says of it."""

import re
from dataclasses import dataclass

import numpy as np
import pytest
from mcap_bytes import CHUNK, MESSAGE_INDEX, Piece

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


@dataclass(frozen=True)
class Case:
    """The bytes of the log and its records."""

    data: bytes
    records: list[Piece]

    @property
    def chunks(self) -> list[Piece]:
        """Its chunk records."""
        return [r for r in self.records if r.opcode == CHUNK]

    def behind(self, chunk: Piece) -> int:
        """End of the message indexes behind a chunk."""
        following = self.records[self.records.index(chunk) + 1 :]
        return next(r.start for r in following if r.opcode != MESSAGE_INDEX)


def samples_of(chunk: int) -> set[int]:
    """Numbers of the samples in a chunk."""
    return set(range(chunk * PER_CHUNK, min((chunk + 1) * PER_CHUNK, COUNT)))


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
    whole = recovery.kept == f"all {COUNT} samples"
    match = re.fullmatch(r"(\d+) samples from (\S+) s", recovery.kept)
    assert whole or match, recovery.kept
    kept = set(range(COUNT)) if whole else span(*match.groups())
    return Account(kept, left_out, damaged)


def recovered(path, data: bytes) -> tuple[Log, Recovery]:
    """The file is refused by strict reading; what is recovered is what was written."""
    path.write_bytes(data)
    with pytest.raises(InputError) as caught:
        read_log(path)
    log, recovery = recover_log(path)
    assert recovery.lost
    assert all("\n" not in loss for loss in recovery.lost)
    reason = str(caught.value).removeprefix(f"{path}: ")
    assert reason.startswith(recovery.lost[0])
    match = re.fullmatch(r"(\d+) samples from (\S+) s", recovery.kept)
    assert match
    assert log.metadata["recovered"] == recovery.kept
    where = sorted(span(*match.groups()))
    assert len(log) == len(where)
    for name, axis in LOG.axes.items():
        for field, column in axis.columns.items():
            np.testing.assert_array_equal(log.axes[name].columns[field], column[where])
    return log, recovery


def spoilt(case: Case, *chunks: int) -> bytes:
    """Flip a bit of the compressed samples of some chunks."""
    data = bytearray(case.data)
    for number in chunks:
        data[case.chunks[number].end - 20] ^= 0x40
    return bytes(data)


def runs_without(*missing: int) -> list[set[int]]:
    """Samples of the stretches of chunks between those missing."""
    runs: list[set[int]] = [set()]
    for number in range(CHUNKS):
        if number in missing:
            runs.append(set())
        else:
            runs[-1] |= samples_of(number)
    return [r for r in runs if r]
