"""Laws of recovery: every damaged place is named, and no sample disappears without a word.

One log of five chunks is cut, flipped, thinned and doubled in many places. What was kept, what is
left out and the samples of the places named as damaged must together be all samples, and every
sample that is kept must be the one that was written.
"""

import re
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from damaged_logs import (
    CHUNKS,
    COUNT,
    CRC_AT,
    DRAWN,
    LOG,
    PER_CHUNK,
    RATE,
    ROW,
    Case,
    account,
    damage,
    flipped,
    kept,
    recovered,
    runs_without,
    samples_of,
    spoilt,
    without,
)
from log_cases import assert_same_log, assert_same_samples, two_axes, write_together
from mcap.opcode import Opcode
from mcap.records import Attachment, ChunkIndex
from mcap_bytes import of, parsed, records

from twin.errors import InputError
from twin.files import UNFINISHED
from twin.logs import AxisLog, Log, read_log, recover_file, recover_log, write_log


@pytest.fixture(scope="module")
def intact(tmp_path_factory) -> Case:
    path = tmp_path_factory.mktemp("log") / "a.mcap"
    write_log(LOG, path, chunk_bytes=PER_CHUNK * ROW)
    data = path.read_bytes()
    case = Case(data, records(data))
    assert len(case.chunks) == CHUNKS
    return case


PAIRS = [{i, j} for i in range(CHUNKS) for j in range(i, CHUNKS)]
DAMAGE = [
    *((pair, set()) for pair in PAIRS),
    *((set(), pair) for pair in PAIRS),
    *(({a}, {b}) for a in range(CHUNKS) for b in range(CHUNKS) if a != b),
]


@pytest.mark.parametrize(("bad", "gone"), DAMAGE, ids=str)
def test_kept_left_out_and_damaged_are_all_samples(tmp_path, intact, bad, gone):
    """Of chunks that are gone message indexes and summary still speak."""
    changed = without(intact, spoilt(intact, *bad), gone)
    _, recovery = recovered(tmp_path / "a.mcap", changed.data)
    got = account(changed, recovery)
    runs = runs_without(*bad, *gone)
    assert samples_of(*bad) <= got.damaged
    assert got.all == set(range(COUNT)), recovery.lost
    assert len(got.kept) == max(len(r) for r in runs)
    runs.remove(got.kept)
    assert sorted(got.left_out, key=min) == runs
    assert len(recovery.others) == len(runs)
    if not gone:
        assert got.damaged == samples_of(*bad)
        gaps = len(bad) - (max(bad) == min(bad) + 1)
        assert len(recovery.lost) == len(bad) + len(runs) + gaps


def test_a_file_cut_off_keeps_every_chunk_before_the_cut(tmp_path, intact):
    """Cut at, before and behind every end of a record, and within each."""
    ends = [r.end for r in intact.records]
    cuts = {c + d for c in ends for d in (0, 1)} | {c.end - 9 for c in intact.chunks}
    for cut in sorted(c for c in cuts if intact.chunks[0].end <= c < len(intact.data)):
        _, recovery = recovered(tmp_path / "a.mcap", intact.data[:cut])
        whole = [n for n, c in enumerate(intact.chunks) if c.end <= cut]
        assert account(intact, recovery).kept == samples_of(*whole)
        assert recovery.lost[0].startswith(f"truncated: ends at byte {cut} without")
        told: set[int] = set()
        for first, last in re.findall(r"bytes (\d+) to (\d+): ", " ".join(recovery.lost)):
            told |= set(range(int(first), int(last) + 1))
        assert told >= set(range(max(e for e in ends if e <= cut), cut))
        assert max(told, default=cut - 1) == cut - 1
        assert bool(told) == (cut not in ends)


@pytest.mark.slow
def test_a_bit_flipped_in_any_kind_of_record_is_told_and_costs_its_chunk_at_most(tmp_path, intact):
    """The opcode, bytes of the length and of the content, of a record of each kind; the magic."""
    first_of = {r.opcode: r for r in reversed(intact.records)}
    for record in (*first_of.values(), intact.chunks[2]):
        size, chunk = record.end - record.start, record.opcode == Opcode.CHUNK
        every = (0, 1, 2, 4, 8, 9, 17, 25, 33, 37, 41, size // 2, size - 1)
        for at in every if chunk else (0, 1, 8, 9, size - 1):
            data = flipped(intact.data, record.start + at, mask=1 << at % 8)
            _, recovery = recovered(tmp_path / "a.mcap", data)
            got = account(intact, recovery)
            assert got.all == set(range(COUNT)), (record.opcode, at, recovery.lost)
            if at >= 9 and not chunk:
                assert len(got.kept) == COUNT, (record.opcode, at, recovery.lost)
    for place in (0, 5, 7, -8, -3, -1):
        data = flipped(intact.data, place % len(intact.data), mask=4)
        _, recovery = recovered(tmp_path / "a.mcap", data)
        assert account(intact, recovery).kept == set(range(COUNT))


def test_each_extra_that_is_damaged_is_named_and_the_others_are_kept(tmp_path, intact):
    attachment = next(r for r in intact.records if r.opcode == Opcode.ATTACHMENT)
    place = intact.data.index(parsed(Attachment, attachment).data)
    log, recovery = recovered(tmp_path / "a.mcap", flipped(intact.data, place))
    assert not log.attachments
    assert log.metadata["source"] == "a test"
    assert any(f"attachment at byte {attachment.start}: wrong checksum" in s for s in recovery.lost)
    metadata = next(r for r in intact.records if r.opcode == Opcode.METADATA)
    for word in (b"a test", b"500.0"):  # a rate that the chunks deny gives way
        place = intact.data.index(word, metadata.start)
        log, recovery = recovered(tmp_path / "a.mcap", flipped(intact.data, place))
        assert f"metadata at byte {metadata.start}: wrong checksum" in recovery.lost[0]
        assert log.attachments == LOG.attachments
        assert (log.sample_rate, len(log)) == (RATE, COUNT)
        assert not recovery.not_proved
        assert "source" not in log.metadata


def test_a_log_of_which_every_chunk_is_damaged_is_refused_and_names_each(tmp_path, intact):
    (tmp_path / "a.mcap").write_bytes(spoilt(intact, *range(CHUNKS)))
    with pytest.raises(InputError, match="nothing can be recovered") as caught:
        recover_log(tmp_path / "a.mcap")
    for chunk in intact.chunks:
        assert f"chunk at byte {chunk.start}:" in str(caught.value)


@pytest.mark.parametrize("kind", DRAWN, ids=lambda k: k.__name__)
def test_chunks_that_the_damage_did_not_touch_come_back_whole(tmp_path, intact, kind):
    rng = np.random.default_rng(1)
    for _ in range(8):
        data, touched = kind(intact, rng)
        whole = samples_of(*set(range(CHUNKS)) - touched)
        try:
            log, recovery = recovered(tmp_path / "a.mcap", data)
        except InputError:
            assert not whole
            continue
        parts = (log, *recovery.others)
        assert whole <= set().union(*(kept(part.metadata["recovered"]) for part in parts))


def test_what_no_checksum_proves_comes_back_only_on_request(tmp_path, intact):
    path, chunk = tmp_path / "a.mcap", intact.chunks[2]
    data = bytearray(intact.data)
    data[chunk.start + CRC_AT : chunk.start + CRC_AT + 4] = bytes(4)
    log, recovery = recovered(path, bytes(data))
    assert len(log) + sum(map(len, recovery.others)) == COUNT - len(samples_of(2))
    assert f"chunk at byte {chunk.start}: has no checksum" in "; ".join(recovery.lost)
    log, recovery = recover_log(path, unproved=True)
    assert len(log) == COUNT
    assert "no checksum" in log.metadata["not_proved"]
    assert f"chunk at byte {chunk.start}: has no checksum" in "; ".join(recovery.not_proved)


@pytest.mark.slow
def test_every_cut_and_every_flipped_bit_is_refused(tmp_path, intact):
    data, path, rng = intact.data, tmp_path / "a.mcap", np.random.default_rng(1)
    first, end = intact.chunks[0].start, intact.chunks[-1].end
    bits = {*range(8 * 40), *range(8 * (len(data) - 40), 8 * len(data))}
    bits |= {int(b) for b in rng.integers(0, 8 * len(data), 40)}
    bits |= {int(b) for b in rng.integers(0, 8 * first, 40)}  # outside the chunks
    bits |= {int(b) for b in rng.integers(8 * end, 8 * len(data), 40)}
    cuts = {*range(60), *(int(n) for n in rng.integers(0, len(data), 40)), len(data) - 1}
    damaged = [flipped(data, bit // 8, mask=1 << bit % 8) for bit in bits]
    for content in [*damaged, *(data[:size] for size in cuts)]:
        path.write_bytes(content)
        with pytest.raises(InputError, match=re.escape(str(path))) as caught:
            read_log(path)
        assert "\n" not in str(caught.value)


def test_a_nan_splits_a_recovered_log(tmp_path):
    position = np.arange(100.0)
    position[70] = np.nan
    log = Log(RATE, {"x": AxisLog({"position": position, "force": np.ones(100)})})
    write_together(tmp_path / "a.mcap", log, rows=8)
    got, recovery = recover_log(tmp_path / "a.mcap")
    assert_same_samples(got, log, slice(0, 64))
    assert "position is nan at 0.14 s" in recovery.lost[0]


TWO = two_axes()


def test_an_intact_log_is_recovered_whole(tmp_path):
    write_log(TWO, tmp_path / "a.mcap")
    log, recovery = recover_log(tmp_path / "a.mcap")
    assert_same_log(log, TWO)
    assert str(recovery) == "kept all 500 samples\nnothing was lost"
    recovery, files = recover_file(tmp_path / "a.mcap", tmp_path / "b.mcap")
    assert files == {tmp_path / "b.mcap": recovery.kept}
    assert (tmp_path / "a.mcap").read_bytes() == (tmp_path / "b.mcap").read_bytes()


@pytest.mark.parametrize("seed", range(2))
def test_what_damage_did_not_touch_comes_back_whatever_else_is_lost(tmp_path, seed):
    """Every sample of every topic, in the log or in those beside it; and each is as written."""
    rng, path = np.random.default_rng(seed), tmp_path / "a.mcap"
    write_log(TWO, path, chunk_bytes=20_000)
    data, whole = bytearray(path.read_bytes()), {1: set(), 2: set(), 3: set()}
    for index in [parsed(ChunkIndex, p) for p in of(bytes(data), Opcode.CHUNK_INDEX)]:
        (channel,) = index.message_index_offsets
        if rng.random() < 0.2:
            place = index.chunk_start_offset + index.chunk_length - 1 - int(rng.integers(20))
            data[place] ^= 1 << int(rng.integers(8))
        else:
            times = index.message_start_time, index.message_end_time
            first, last = (round(t * 1e-9 * TWO.sample_rate) for t in times)
            whole[channel] |= set(range(first, last + 1))
    path.write_bytes(data)
    log, recovery = recover_log(path)
    found: dict[int, set[int]] = {1: set(), 2: set(), 3: set()}
    for part in (log, *recovery.others):
        assert len(part) * (len(part.axes) + len(part.truth)) <= len(log) * 3
        first = round(float(part.metadata["recovered"].split(" from ")[1].split()[0]) * 1e4)
        where = slice(first, first + len(part))
        axes = {name: TWO.axes[name] for name in part.axes}
        truth = {name: TWO.truth[name] for name in part.truth}
        assert_same_samples(part, Log(TWO.sample_rate, axes, truth=truth), where)
        for channel, there in ((1, "x" in axes), (2, "y" in axes), (3, bool(truth))):
            found[channel] |= set(range(first, first + len(part))) if there else set()
    assert (found[1], found[2]) == (whole[1], whole[2])
    assert found[3] == whole[3] & (whole[1] | whole[2])  # truth alone is no log


@pytest.mark.parametrize("layout", ["apart", "together"])
def test_what_is_written_piece_by_piece_is_what_is_read_as_a_whole(tmp_path, layout):
    """Of more samples than are held at a time."""
    count = 40_000 if layout == "apart" else 2_000
    path = tmp_path / f"good.mcap{UNFINISHED}"  # the name of the recording that it becomes
    column = np.arange(float(count))
    axis = AxisLog({"position": column, "force": -column})
    log = Log(1e4, {"x": axis, "y": AxisLog({"position": column + 0.5, "force": column})})
    if layout == "apart":
        write_log(log, path, chunk_bytes=200_000)
    else:
        write_together(path, log)
    damage(path, 4, 5)
    log, wanted = recover_log(path)
    recovery, files = recover_file(path, tmp_path / "good.mcap")
    assert (recovery.kept, recovery.lost) == (wanted.kept, wanted.lost)
    assert list(files) == [
        tmp_path / "good.mcap",
        *(tmp_path / f"good.part{n}.mcap" for n in range(1, 1 + len(wanted.others))),
    ]
    assert len(files) > 1
    assert next(iter(files.values())) == recovery.kept
    for file, part in zip(files, (log, *wanted.others), strict=True):
        write_log(part, tmp_path / "b.mcap")
        assert file.read_bytes() == (tmp_path / "b.mcap").read_bytes()


@pytest.mark.slow
def test_a_recovery_takes_little_memory(tmp_path):
    """As much as the steps that it takes, whatever the length of the log.

    Early releases of Python 3.12 and 3.13 hold what a caught error saw: 22 MB in all, else 13.
    """
    noise = np.random.default_rng(1).standard_normal((2, 1_500_000))
    path = tmp_path / "a.mcap"
    write_log(Log(1e4, {"x": AxisLog({"position": noise[0], "force": noise[1]})}), path)
    damage(path, 20)
    tracemalloc.start()
    recover_file(path, tmp_path / "b.mcap")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < noise.nbytes


def test_a_chunk_is_found_wherever_it_lies(tmp_path):
    """At every place beside the borders of what is searched at a time."""
    path, log = tmp_path / "a.mcap", Log(RATE, {"x": LOG.axes["x"]})
    for border in (1 << 16, 1 << 18):
        for before in range(-20, 80, 7):
            write_log(Log(RATE, log.axes, attachments={"a": bytes(border - 300)}), path)
            start = of(path.read_bytes(), Opcode.CHUNK)[0].start
            size = border - 300 + border - before - start
            write_log(Log(RATE, log.axes, attachments={"a": bytes(size)}), path)
            data = path.read_bytes()
            chunk = of(data, Opcode.CHUNK)[0]
            assert chunk.start == border - before
            path.write_bytes(flipped(data, chunk.start + 5))  # its length
            assert_same_samples(recover_log(path)[0], log)


def test_what_is_recovered_from_is_not_written_over(tmp_path):
    named = tmp_path / "good.part1.mcap"
    write_log(TWO, named, chunk_bytes=20_000)
    damage(named, 12)
    broken = named.read_bytes()
    with pytest.raises(InputError, match="would be overwritten; give another name"):
        recover_file(named, tmp_path / "good.mcap")
    assert not (tmp_path / "good.mcap").exists()
    assert named.read_bytes() == broken


def test_records_behind_an_attached_log_are_read(tmp_path):
    """The chunks in the attachment are not those of the log around it."""
    log = Log(TWO.sample_rate, {"x": TWO.axes["x"]}, {"source": "a test"})
    write_log(log.part(0, 50), tmp_path / "inner.mcap")
    attachments = {"inner.mcap": (tmp_path / "inner.mcap").read_bytes(), "b.txt": b"behind"}
    path = tmp_path / "a.mcap"
    write_log(Log(log.sample_rate, log.axes, log.metadata, {}, attachments), path)
    path.write_bytes(path.read_bytes()[:-3])
    got, recovery = recover_log(path)
    assert_same_samples(got, log)
    assert got.attachments == attachments
    assert not any("unreadable" in loss for loss in recovery.lost[1:-1])


def test_bytes_that_cannot_be_read_are_told_with_their_place(intact: Case, tmp_path: Path) -> None:
    """What lies between two chunks is unreadable; what lies at the end may be cut off."""
    between, last = intact.chunks[0].end, intact.chunks[-1].end
    damaged = flipped(intact.data, between, mask=0xFF)
    _, recovery = recovered(tmp_path / "damaged.mcap", damaged)
    assert f"bytes {between} to {intact.chunks[1].start - 1}: unreadable" in recovery.lost
    _, recovery = recovered(tmp_path / "cut.mcap", intact.data[: last + 5])
    assert f"bytes {last} to {last + 4}: cut off or unreadable" in recovery.lost
