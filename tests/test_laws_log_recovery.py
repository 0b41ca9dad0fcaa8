"""Laws of recovery: every damaged place is named, and no sample disappears without a word.

One log of five chunks is cut, flipped, thinned and doubled in many places. What was kept, what is
left out and the samples of the places named as damaged must together be all samples, and every
sample that is kept must be the one that was written.
"""

import re
from dataclasses import dataclass

import numpy as np
import pytest
from mcap.records import Attachment
from mcap_bytes import (
    ATTACHMENT,
    CHUNK,
    MESSAGE_INDEX,
    Piece,
    parsed,
    records,
)

from twin.errors import InputError
from twin.log import AxisLog, Log, Recovery, encode, read_log, recover_log, write_log

RATE, COUNT, PER_CHUNK = 500.0, 33, 7
CHUNKS = -(-COUNT // PER_CHUNK)
ROW = (31 + 4 * 9) + (31 + 2 * 9) + (31 + 9)
NAMES = ("position", "velocity", "current", "force")
LOG = Log(
    RATE,
    {
        "x": AxisLog({n: 1e3 * i + np.arange(COUNT) for i, n in enumerate(NAMES, 1)}),
        "y": AxisLog(
            {n: 1e5 * i + np.arange(COUNT) for i, n in enumerate(NAMES[:1] + NAMES[3:], 1)}
        ),
    },
    {"source": "a test"},
    {"x": {"z": 1e7 + np.arange(COUNT)}},
    {"model.toml": b"mass = 1.0\n"},
)


@dataclass(frozen=True)
class Case:
    data: bytes
    records: list[Piece]

    @property
    def chunks(self) -> list[Piece]:
        return [r for r in self.records if r.opcode == CHUNK]

    def behind(self, chunk: Piece) -> int:
        """End of the message indexes behind a chunk."""
        following = self.records[self.records.index(chunk) + 1 :]
        return next(r.start for r in following if r.opcode != MESSAGE_INDEX)


@pytest.fixture(scope="module")
def intact(tmp_path_factory) -> Case:
    path = tmp_path_factory.mktemp("log") / "a.mcap"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(encode, "CHUNK_BYTES", PER_CHUNK * ROW)
        write_log(LOG, path)
    data = path.read_bytes()
    case = Case(data, records(data))
    assert len(case.chunks) == CHUNKS
    return case


def samples_of(chunk: int) -> set[int]:
    return set(range(chunk * PER_CHUNK, min((chunk + 1) * PER_CHUNK, COUNT)))


def span(count: str, seconds: str) -> set[int]:
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
        return self.kept.union(self.damaged, *self.left_out)


def account(case: Case, recovery: Recovery) -> Account:
    """Read the sentences; a chunk is damaged where it or bytes of it are named."""
    left_out, damaged = [], set()
    for sentence in recovery.lost:
        if found := re.match(r"(\d+) intact samples from (\S+) s are left out", sentence):
            left_out.append(span(*found.groups()))
        for number, chunk in enumerate(case.chunks):
            if re.search(rf"[Cc]hunk (record )?at byte {chunk.start}: ", sentence):
                damaged |= samples_of(number)
            if found := re.match(r"bytes (\d+) to (\d+): ", sentence):
                first, last = (int(g) for g in found.groups())
                if first < chunk.end and last >= chunk.start:
                    damaged |= samples_of(number)
        if found := re.match(r"the chunk of samples from (\S+) s to (\S+) s that", sentence):
            first, last = (round(float(g) * RATE) for g in found.groups())
            damaged |= set(range(first, last + 1))
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
    np.testing.assert_array_equal(log.truth["x"]["z"], LOG.truth["x"]["z"][where])
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


PAIRS = [(i, j) for i in range(CHUNKS) for j in range(i, CHUNKS)]


@pytest.mark.parametrize("chunks", PAIRS, ids=str)
def test_kept_left_out_and_damaged_are_all_samples(tmp_path, intact, chunks):
    _, recovery = recovered(tmp_path / "a.mcap", spoilt(intact, *set(chunks)))
    got = account(intact, recovery)
    runs = runs_without(*chunks)
    assert got.damaged == set().union(*(samples_of(c) for c in chunks))
    assert len(got.kept) == max(len(r) for r in runs)
    runs.remove(got.kept)
    assert sorted(got.left_out, key=min) == runs
    assert len(recovery.lost) == len(set(chunks)) + len(runs)


@pytest.mark.parametrize("chunks", PAIRS, ids=str)
def test_chunks_that_are_gone_are_told(tmp_path, intact, chunks):
    """Message indexes and summary still speak of them."""
    data = bytearray(intact.data)
    for number in sorted(set(chunks), reverse=True):
        del data[intact.chunks[number].start : intact.chunks[number].end]
    _, recovery = recovered(tmp_path / "a.mcap", bytes(data))
    got = account(intact, recovery)
    runs = runs_without(*chunks)
    assert len(got.kept) == max(len(r) for r in runs)
    runs.remove(got.kept)
    assert sorted(got.left_out, key=min) == runs
    assert got.all == set(range(COUNT)), recovery.lost


@pytest.mark.parametrize(("gone", "bad"), [(a, b) for a in range(5) for b in range(5) if a != b])
def test_one_chunk_gone_and_one_damaged_are_both_told(tmp_path, intact, gone, bad):
    data = bytearray(spoilt(intact, bad))
    del data[intact.chunks[gone].start : intact.chunks[gone].end]
    _, recovery = recovered(tmp_path / "a.mcap", bytes(data))
    shift = intact.chunks[gone].end - intact.chunks[gone].start if bad > gone else 0
    place = intact.chunks[bad].start - shift
    assert any(f"chunk at byte {place}:" in loss for loss in recovery.lost)
    told = account(Case(intact.data, []), recovery).all
    assert told | samples_of(bad) == set(range(COUNT)), recovery.lost


@pytest.mark.parametrize("number", range(CHUNKS))
def test_a_chunk_written_twice_costs_no_sample_without_a_word(tmp_path, intact, number):
    chunk = intact.chunks[number]
    end = intact.behind(chunk)
    data = intact.data[:end] + intact.data[chunk.start : end] + intact.data[end:]
    _, recovery = recovered(tmp_path / "a.mcap", data)
    assert account(intact, recovery).all == set(range(COUNT))


@pytest.mark.parametrize("number", range(CHUNKS - 1))
def test_chunks_in_the_wrong_order_cost_no_sample_without_a_word(tmp_path, intact, number):
    one, other = intact.chunks[number : number + 2]
    middle, end = intact.behind(one), intact.behind(other)
    data = intact.data
    data = data[: one.start] + data[middle:end] + data[one.start : middle] + data[end:]
    _, recovery = recovered(tmp_path / "a.mcap", data)
    assert account(intact, recovery).all == set(range(COUNT))


def test_a_file_cut_off_keeps_every_chunk_before_the_cut(tmp_path, intact):
    """Cut at, before and behind every end of a record, and within each."""
    ends = [r.end for r in intact.records]
    cuts = {c + d for c in ends for d in (0, 1)} | {c.end - 9 for c in intact.chunks}
    for cut in sorted(c for c in cuts if intact.chunks[0].end <= c < len(intact.data)):
        _, recovery = recovered(tmp_path / "a.mcap", intact.data[:cut])
        whole = [n for n, c in enumerate(intact.chunks) if c.end <= cut]
        assert account(intact, recovery).kept == set().union(*(samples_of(n) for n in whole))
        assert recovery.lost[0].startswith(f"truncated: ends at byte {cut} without")
        told: set[int] = set()
        for first, last in re.findall(r"bytes (\d+) to (\d+): ", " ".join(recovery.lost)):
            told |= set(range(int(first), int(last) + 1))
        assert told >= set(range(max(e for e in ends if e <= cut), cut))
        assert max(told, default=cut - 1) == cut - 1
        assert bool(told) == (cut not in ends)


def test_a_bit_flipped_in_any_kind_of_record_is_told_and_costs_its_chunk_at_most(tmp_path, intact):
    """The opcode, bytes of the length and of the content, of a record of each kind."""
    data = intact.data
    first_of = {r.opcode: r for r in reversed(intact.records)}
    for record in (*first_of.values(), intact.chunks[2]):
        size, chunk = record.end - record.start, record.opcode == CHUNK
        every = (0, 1, 2, 4, 8, 9, 17, 25, 33, 37, 41, size // 2, size - 1)
        for at in every if chunk else (0, 1, 8, 9, size - 1):
            place = record.start + at
            flipped = data[:place] + bytes([data[place] ^ 1 << at % 8]) + data[place + 1 :]
            _, recovery = recovered(tmp_path / "a.mcap", flipped)
            got = account(intact, recovery)
            assert got.all == set(range(COUNT)), (record.opcode, at, recovery.lost)
            if at >= 9 and not chunk:
                assert len(got.kept) == COUNT, (record.opcode, at, recovery.lost)


@pytest.mark.parametrize("position", [0, 5, 7])
@pytest.mark.parametrize("end", ["front", "back"])
def test_a_bit_flipped_in_the_magic_is_told(tmp_path, intact, position, end):
    place = position if end == "front" else len(intact.data) - 8 + position
    flipped = bytearray(intact.data)
    flipped[place] ^= 4
    _, recovery = recovered(tmp_path / "a.mcap", bytes(flipped))
    assert account(intact, recovery).kept == set(range(COUNT))


def test_each_extra_that_is_damaged_is_named_and_the_others_are_kept(tmp_path, intact):
    attachment = next(r for r in intact.records if r.opcode == ATTACHMENT)
    place = intact.data.index(parsed(Attachment, attachment).data)
    flipped = bytearray(intact.data)
    flipped[place] ^= 1
    log, recovery = recovered(tmp_path / "a.mcap", bytes(flipped))
    assert not log.attachments
    assert log.metadata["source"] == "a test"
    assert any(f"attachment at byte {attachment.start}: wrong checksum" in s for s in recovery.lost)
    place = intact.data.index(b"a test")
    flipped = bytearray(intact.data)
    flipped[place] ^= 1
    log, recovery = recovered(tmp_path / "a.mcap", bytes(flipped))
    assert log.attachments == LOG.attachments
    assert "checksum" in recovery.lost[0]


def test_an_intact_log_is_kept_whole_and_nothing_is_said_to_be_lost(tmp_path, intact):
    (tmp_path / "a.mcap").write_bytes(intact.data)
    log, recovery = recover_log(tmp_path / "a.mcap")
    assert recovery == Recovery(f"all {COUNT} samples", ())
    assert "recovered" not in log.metadata


def test_a_log_of_which_every_chunk_is_damaged_is_refused_and_names_each(tmp_path, intact):
    (tmp_path / "a.mcap").write_bytes(spoilt(intact, *range(CHUNKS)))
    with pytest.raises(InputError, match="nothing can be recovered") as caught:
        recover_log(tmp_path / "a.mcap")
    for chunk in intact.chunks:
        assert f"chunk at byte {chunk.start}:" in str(caught.value)
