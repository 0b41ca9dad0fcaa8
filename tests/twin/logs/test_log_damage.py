"""Damaged files: strict reading names the fault, recovery keeps what is intact."""

import numpy as np
import pytest
from log_cases import (
    RATE,
    assert_same_log,
    assert_same_samples,
    two_axes,
    write_together,
)
from mcap.reader import make_reader

from twin.errors import InputError
from twin.logs import AxisLog, Log, read_log, recover_file, recover_log, write_log
from twin.logs import writer as encode

TRIALS = 100  # of each kind of damage; none may get through, so more only find rarer faults


@pytest.fixture
def small_log() -> Log:
    log = two_axes(120)
    return Log(RATE, {"x": log.axes["x"]}, log.metadata, attachments=log.attachments)


@pytest.fixture
def intact(tmp_path, monkeypatch, small_log) -> bytes:
    """Bytes of a file of ten chunks of 12 samples."""
    monkeypatch.setattr(encode, "CHUNK_BYTES", 12 * (31 + 7 * 12))
    write_log(small_log, tmp_path / "intact.mcap")
    return (tmp_path / "intact.mcap").read_bytes()


def chunk_offsets(path) -> list[int]:
    with open(path, "rb") as stream:
        return [c.chunk_start_offset for c in make_reader(stream).get_summary().chunk_indexes]


def flip(data: bytes, bit: int) -> bytes:
    out = bytearray(data)
    out[bit // 8] ^= 1 << bit % 8
    return bytes(out)


def test_a_file_cut_anywhere_is_refused(tmp_path, intact):
    rng = np.random.default_rng(1)
    path = tmp_path / "cut.mcap"
    for size in {*range(60), *rng.integers(0, len(intact), TRIALS), len(intact) - 1}:
        path.write_bytes(intact[:size])
        with pytest.raises(InputError) as caught:
            read_log(path)
        assert str(path) in str(caught.value)
        assert "\n" not in str(caught.value)


def test_a_flipped_bit_anywhere_is_refused(tmp_path, intact):
    rng = np.random.default_rng(2)
    path = tmp_path / "flipped.mcap"
    for bit in rng.integers(0, 8 * len(intact), TRIALS):
        path.write_bytes(flip(intact, int(bit)))
        with pytest.raises(InputError) as caught:
            read_log(path)
        assert "\n" not in str(caught.value)


def test_every_bit_outside_the_chunks_is_protected(tmp_path, intact):
    first = chunk_offsets(tmp_path / "intact.mcap")[0]
    last = intact.rfind(b"\x0f\x04\0\0\0\0\0\0\0")  # the data end record
    path = tmp_path / "flipped.mcap"
    rng = np.random.default_rng(4)
    bits = [
        *range(8 * 40),
        *range(8 * last, 8 * (last + 40)),
        *range(8 * (len(intact) - 40), 8 * len(intact)),
    ]
    bits += [int(b) for b in rng.integers(0, 8 * first, TRIALS)]
    for bit in bits:
        path.write_bytes(flip(intact, bit))
        with pytest.raises(InputError):
            read_log(path)


def test_recovery_of_random_damage_invents_nothing(tmp_path, intact, small_log):
    rng = np.random.default_rng(5)
    path = tmp_path / "damaged.mcap"
    kept = []
    for bit in rng.integers(0, 8 * len(intact), TRIALS):
        size = int(rng.integers(0, len(intact))) if bit % 2 else len(intact)
        path.write_bytes(flip(intact, int(bit))[:size])
        try:
            log, recovery = recover_log(path)
        except InputError:
            kept.append(0)
            continue
        first = np.flatnonzero(small_log.axes["x"].position == log.axes["x"].position[-1])[-1]
        assert recovery.lost
        assert_same_samples(log, small_log, slice(first + 1 - len(log), first + 1))
        kept.append(len(log))
    assert sorted(kept)[TRIALS // 2] >= 60  # half of the samples or more, half of the time


def test_a_truncated_file_keeps_all_chunks_before_the_cut(tmp_path, intact, small_log):
    cut = chunk_offsets(tmp_path / "intact.mcap")[7] + 100
    path = tmp_path / "cut.mcap"
    path.write_bytes(intact[:cut])
    log, recovery = recover_log(path)
    assert len(log) == 7 * 12
    assert_same_samples(log, small_log, slice(0, 84))
    assert log.attachments == small_log.attachments
    assert log.metadata["source"] == "simulation"
    assert recovery.kept == "84 samples from 0 s"
    assert recovery.lost[0].startswith(f"truncated: ends at byte {cut} without")
    assert recovery.lost[1].startswith("bytes ")


def test_a_damaged_chunk_in_the_middle_keeps_the_longer_side(tmp_path, intact, small_log):
    place = chunk_offsets(tmp_path / "intact.mcap")[3]
    path = tmp_path / "damaged.mcap"
    path.write_bytes(flip(intact, 8 * (place + 200)))
    with pytest.raises(InputError, match=f"chunk at byte {place}: .*twin recover"):
        read_log(path)
    log, recovery = recover_log(path)
    assert_same_samples(log, small_log, slice(48, 120))
    assert recovery.kept == "72 samples from 0.0048 s"
    assert recovery.lost[0].startswith(f"chunk at byte {place}: ")
    assert "12 samples are missing, from 0.0036 s to 0.0048 s" in recovery.lost[1]
    assert recovery.lost[2].startswith("36 intact samples from 0 s are in a log of their own")
    (other,) = recovery.others
    assert_same_samples(other, small_log, slice(0, 36))
    assert len(recovery.lost) == 3
    write_log(log, tmp_path / "good.mcap")
    assert_same_log(read_log(tmp_path / "good.mcap"), log)


def test_a_damaged_record_length_hides_no_later_chunk(tmp_path, intact, small_log):
    place = chunk_offsets(tmp_path / "intact.mcap")[2]
    path = tmp_path / "damaged.mcap"
    for bit in (8 * (place + 1) + 7, 8 * (place + 2), 8 * (place + 6)):
        path.write_bytes(flip(intact, bit))
        log, recovery = recover_log(path)
        # a length that became too large leaves the chunk itself readable
        assert len(log) in (84, 120)
        assert_same_samples(log, small_log, slice(120 - len(log), 120))
        assert any("unreadable" in loss for loss in recovery.lost)


def test_damage_outside_the_chunks_costs_no_sample(tmp_path, intact, small_log):
    """Neither to an index, nor to the metadata, which have a checksum of their own."""
    path = tmp_path / "damaged.mcap"
    index = intact.find(b"\x07" + bytes([6 + 16 * 12]), chunk_offsets(tmp_path / "intact.mcap")[0])
    for place, why in (
        (index + 20, "metadata, an attachment or an index is damaged"),
        (intact.find(b"simulation"), "metadata at byte 42: wrong checksum"),
    ):
        path.write_bytes(flip(intact, 8 * place))
        with pytest.raises(InputError, match=why):
            read_log(path)
        log, recovery = recover_log(path)
        assert_same_samples(log, small_log)
        assert why in recovery.lost[0]
        assert not recovery.unproved
        assert ("source" in log.metadata) is ("metadata at byte" not in why)


def test_a_damaged_attachment_is_not_kept(tmp_path, intact, small_log):
    place = intact.find(b'name = "proton"')
    path = tmp_path / "damaged.mcap"
    path.write_bytes(flip(intact, 8 * place))
    log, recovery = recover_log(path)
    assert_same_samples(log, small_log)
    assert list(log.attachments) == ["model.xml"]
    assert any("attachment at byte" in loss for loss in recovery.lost)


def test_an_intact_file_is_recovered_whole(tmp_path, intact, small_log):
    log, recovery = recover_log(tmp_path / "intact.mcap")
    assert_same_log(log, small_log)
    assert recovery.lost == ()
    assert str(recovery) == "kept all 120 samples\nnothing was lost"


def test_a_nan_splits_a_recovered_log(tmp_path):
    position = np.arange(100.0)
    position[70] = np.nan
    log = Log(RATE, {"x": AxisLog({"position": position, "force": np.ones(100)})})
    write_together(tmp_path / "a.mcap", log, rows=8)
    got, recovery = recover_log(tmp_path / "a.mcap")
    assert 50 <= len(got) <= 70
    assert_same_samples(got, log, slice(0, len(got)))
    assert "position is nan at 0.007 s" in recovery.lost[0]


def test_an_unknown_axis_is_answered_with_those_there(tmp_path, intact):
    with pytest.raises(InputError, match=r"no samples on topic /axis/z; .* of these: x$"):
        read_log(tmp_path / "intact.mcap", axes=("z",))


def test_a_newer_schema_version_is_refused(tmp_path, monkeypatch, small_log):
    monkeypatch.setattr("twin.logs.outline.SCHEMA_VERSION", "2")
    write_log(small_log, tmp_path / "a.mcap")
    with pytest.raises(InputError, match="log schema version is '2', this program reads '1'"):
        read_log(tmp_path / "a.mcap")


def test_no_other_stretch_is_written_over_the_damaged_log(tmp_path, intact):
    damaged = tmp_path / "good.part1.mcap"
    broken = bytearray(intact)
    broken[chunk_offsets(tmp_path / "intact.mcap")[4] + 200] ^= 0xFF
    damaged.write_bytes(broken)
    with pytest.raises(InputError, match="would be overwritten; give another name"):
        recover_file(damaged, tmp_path / "good.mcap")
    assert not (tmp_path / "good.mcap").exists()
    assert damaged.read_bytes() == broken
