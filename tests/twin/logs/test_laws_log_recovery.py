"""Laws of recovery: every damaged place is named, and no sample disappears without a word.

One log of five chunks is cut, flipped, thinned and doubled in many places. What was kept, what is
left out and the samples of the places named as damaged must together be all samples, and every
sample that is kept must be the one that was written.
"""

import re

import pytest
from damage_cases import (
    CHUNKS,
    COUNT,
    LOG,
    PER_CHUNK,
    RATE,
    ROW,
    Case,
    account,
    recovered,
    runs_without,
    samples_of,
    spoilt,
)
from mcap.records import Attachment
from mcap_bytes import (
    ATTACHMENT,
    CHUNK,
    METADATA,
    parsed,
    records,
)

from twin.errors import InputError
from twin.logs import recover_log, write_log
from twin.logs import writer as encode


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
    gaps = len(set(chunks)) - (chunks[1] == chunks[0] + 1)
    assert len(recovery.lost) == len(set(chunks)) + len(runs) + gaps


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


@pytest.mark.parametrize("chunks", [(0, 1), (0, 3), (1, 3), (2, 4)], ids=str)
def test_two_lengths_that_are_damaged_are_two_places(tmp_path, intact, chunks):
    flipped = bytearray(intact.data)
    places = [intact.chunks[c].start + 4 for c in chunks]
    for place in places:
        flipped[place] ^= 0x10
    _, recovery = recovered(tmp_path / "a.mcap", bytes(flipped))
    ranges = re.findall(r"bytes (\d+) to (\d+): ", " ".join(recovery.lost))
    for place in places:
        assert any(int(a) <= place <= int(b) for a, b in ranges), recovery.lost


def test_a_rate_in_the_metadata_that_contradicts_the_chunks_gives_way(tmp_path, intact):
    """A bit makes 500.0 Hz of the metadata record, which has no checksum of its own, 700.0 Hz."""
    metadata = next(r for r in intact.records if r.opcode == METADATA)
    place = intact.data.index(b"500.0", metadata.start)
    assert place < metadata.end
    flipped = bytearray(intact.data)
    flipped[place] ^= 2
    log, recovery = recovered(tmp_path / "a.mcap", bytes(flipped))
    assert log.sample_rate == RATE
    assert len(log) == COUNT
    assert "wrong checksum" in recovery.lost[0]


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


def test_a_log_of_which_every_chunk_is_damaged_is_refused_and_names_each(tmp_path, intact):
    (tmp_path / "a.mcap").write_bytes(spoilt(intact, *range(CHUNKS)))
    with pytest.raises(InputError, match="nothing can be recovered") as caught:
        recover_log(tmp_path / "a.mcap")
    for chunk in intact.chunks:
        assert f"chunk at byte {chunk.start}:" in str(caught.value)
