"""Logs that are recorded while they grow, and read part by part."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from check_drive import drive
from log_cases import assert_same_log, assert_same_samples, two_axes

from twin.checks import Fault, check_log, long
from twin.errors import InputError
from twin.files import UNFINISHED
from twin.logs import Log, read_log, record_log, recover_log, write_log
from twin.logs import writer as encode
from twin.logs.container import McapFile
from twin.logs.decode import read_parts
from twin.logs.log import joined, thinned
from twin.logs.outline import outline

LOG = two_axes()
KILLED = """
import os, signal, sys
from pathlib import Path
sys.path.insert(0, sys.argv[1])
from log_cases import two_axes
from twin.logs import writer as encode, record_log
encode.CHUNK_BYTES = 20_000
def parts():
    for k in range(0, 500, 50):
        if k == 450:
            os.kill(os.getpid(), signal.SIGKILL)
        yield two_axes().part(k, k + 50)
record_log(parts(), Path("a.mcap"))
"""


@pytest.fixture(autouse=True)
def _small_chunks(monkeypatch):
    monkeypatch.setattr(encode, "CHUNK_BYTES", 20_000)


def cut(log: Log, *places: int) -> list[Log]:
    return [log.part(a, b) for a, b in pairwise((0, *places, len(log)))]


@pytest.mark.parametrize("places", [(), (1,), (200, 201, 460), tuple(range(7, 500, 7))])
def test_parts_that_are_recorded_are_the_whole_that_is_written(tmp_path, places):
    record_log(cut(LOG, *places), tmp_path / "a.mcap")
    write_log(LOG, tmp_path / "b.mcap")
    assert (tmp_path / "a.mcap").read_bytes() == (tmp_path / "b.mcap").read_bytes()
    assert_same_log(joined(cut(LOG, *places)), LOG)


def test_a_recording_that_fails_leaves_nothing_and_says_where(tmp_path):
    bad = cut(two_axes(), 300)
    bad[1].axes["x"].columns["position"][5:] = np.nan
    with pytest.raises(InputError, match=r"nan at 0\.0305 s \(sample 305\)"):
        record_log(bad, tmp_path / "a.mcap")
    assert list(tmp_path.iterdir()) == []


def test_two_runs_do_not_record_to_one_file(tmp_path):
    def parts():
        yield LOG.part(0, 100)
        with pytest.raises(InputError, match="another run is writing it"):
            record_log([LOG], tmp_path / "a.mcap")
        yield LOG.part(100, 500)

    record_log(parts(), tmp_path / "a.mcap")
    assert_same_log(read_log(tmp_path / "a.mcap"), LOG)


@pytest.mark.skipif(sys.platform == "win32", reason="SIGKILL")
def test_a_killed_recording_is_recovered_and_the_next_replaces_it(tmp_path):
    tests = Path(__file__).parents[2]
    ended = subprocess.run(
        [sys.executable, "-c", KILLED, str(tests)], cwd=tmp_path, check=False,
        env={**os.environ, "PYTHONPATH": str(tests.parent)},
    )  # fmt: skip
    assert ended.returncode == -signal.SIGKILL
    left = tmp_path / f"a.mcap{UNFINISHED}"
    log, _ = recover_log(left)
    assert_same_samples(log, LOG, slice(len(log)))
    assert len(log) >= 300  # of 450; some chunks are still being compressed
    record_log([LOG], tmp_path / "a.mcap")
    assert [p.name for p in tmp_path.iterdir()] == ["a.mcap"]


def test_a_file_cut_at_any_byte_gives_all_chunks_before_it(tmp_path):
    write_log(LOG, tmp_path / "a.mcap")
    data = (tmp_path / "a.mcap").read_bytes()
    with open(tmp_path / "a.mcap", "rb") as stream:
        ends = [r.end for r in McapFile(stream, len(data)).records() if r.opcode == 6]
    rows = encode.CHUNK_BYTES // outline(LOG).row_bytes
    ends = ends[2::3]  # of the last topic of each stretch
    times = [rows] * (len(ends) - 1) + [len(LOG) - rows * (len(ends) - 1)]
    for place in np.random.default_rng(7).integers(ends[0], ends[-1], 25):
        (tmp_path / "b.mcap").write_bytes(data[:place])
        log, _ = recover_log(tmp_path / "b.mcap")
        assert_same_samples(log, LOG, slice(len(log)))
        assert len(log) == sum(n for end, n in zip(ends, times, strict=True) if end <= place)


@pytest.mark.parametrize("samples", [1, 60, 499, 5000])
def test_a_log_read_in_parts_is_the_log(tmp_path, samples):
    write_log(LOG, tmp_path / "a.mcap")
    parts = list(read_parts(tmp_path / "a.mcap", samples))
    assert (len(parts) > 1) is (samples < 450)
    assert all(len(p) >= samples for p in parts[:-1])
    assert_same_samples(joined(parts), read_log(tmp_path / "a.mcap", truth=False))
    (part,) = read_parts(tmp_path / "a.mcap", 5000, fields=("position", "force"))
    assert list(part.axes["x"].columns) == ["position", "force"]


def test_a_gap_between_parts_is_found(tmp_path):
    record_log(cut(LOG, 250), tmp_path / "a.mcap")
    data = (tmp_path / "a.mcap").read_bytes()
    with open(tmp_path / "a.mcap", "rb") as stream:
        chunks = [r for r in McapFile(stream, len(data)).records() if r.opcode == 6]
    gone = data[: chunks[3].offset] + data[chunks[3].end :]
    (tmp_path / "b.mcap").write_bytes(gone)
    with pytest.raises(InputError):
        list(read_parts(tmp_path / "b.mcap", 1))


def test_a_range_is_cut_out_and_only_its_chunks_are_read(tmp_path, monkeypatch):
    write_log(LOG, tmp_path / "a.mcap")
    read = []
    inner = McapFile._record
    monkeypatch.setattr(
        McapFile, "_record",
        lambda self, offset, end: read.append(found := inner(self, offset, end)) or found,
    )  # fmt: skip
    for start, stop, span in (
        (0.0101, 0.0203, slice(101, 203)), (None, 0.01, slice(0, 100)),
        (0.045, None, slice(450, 500)), (0.01005, 0.01015, slice(101, 102)),
    ):  # fmt: skip
        read.clear()
        got = read_log(tmp_path / "a.mcap", start=start, stop=stop)
        assert_same_samples(got, LOG, span)
        chunks = [r for r in read if r.opcode == 6]
        assert len(chunks) <= 3 * ((span.stop - span.start) // 10 + 3)
    for start, stop, why in ((0.02, 0.01, "not before"), (9.0, 10.0, "no samples from 9 to 10 s")):
        with pytest.raises(InputError, match=why):
            read_log(tmp_path / "a.mcap", start=start, stop=stop)


def test_one_axis_and_some_fields(tmp_path):
    write_log(LOG, tmp_path / "a.mcap")
    got = read_log(tmp_path / "a.mcap", ["y"], fields=("position", "current"), truth=False)
    assert {n: list(a.columns) for n, a in got.axes.items()} == {"y": ["position", "current"]}
    assert got.truth == {}


def test_a_slower_recorder_reads_positions_and_means_of_the_command():
    log = drive(rate=1000.0, seconds=0.0505, signals=("position", "force", "current"))
    slow = thinned(log, 4)
    assert (slow.sample_rate, len(slow)) == (250.0, len(log) // 4)
    columns, got = log.axes["x"].columns, slow.axes["x"].columns
    np.testing.assert_array_equal(got["position"], columns["position"][:-2:4])
    for k in (0, 7):
        assert got["force"][k] == pytest.approx(columns["force"][4 * k : 4 * k + 4].mean())


def test_a_long_log_is_checked_and_read_in_parts(tmp_path, monkeypatch):
    monkeypatch.setattr(encode, "CHUNK_BYTES", 5000)
    late = {"velocity": 0.02}
    log = drive(
        rate=1000.0, seconds=12.0, late=late,
        signals=("position", "force", "velocity"),
    )  # fmt: skip
    write_log(log, tmp_path / "a.mcap")
    whole = check_log(log)
    monkeypatch.setattr(long, "LARGEST_PART", 4000)
    report = long.check_file(tmp_path / "a.mcap")
    assert (
        [(f.axis, f.fault, f.where) for f in report.findings]
        == [(f.axis, f.fault, f.where) for f in whole.findings]
        != []
    )
    monkeypatch.setattr(long, "MOST_SAMPLES", 6000)
    assert long.step_of([tmp_path / "a.mcap"]) == 2
    fields = ("position", "force")
    for every, step in ((1, 1), (2, 1)):  # a step is no longer than 0.5 ms
        got, again = long.read_checked(tmp_path / "a.mcap", fields, every)
        assert again == report
        assert_same_samples(got, thinned(log.with_fields(fields), step))
    monkeypatch.setattr(long, "LONGEST_STEP", 1.0)
    for every in (2, 7):
        got = long.read_measured(tmp_path / "a.mcap", fields, every)
        assert_same_samples(got, thinned(log.with_fields(fields), every))


def test_a_fault_of_one_part_is_placed_and_standstill_of_one_is_none(tmp_path, monkeypatch):
    def change(columns):
        columns["position"][9000:9004] += 0.01
        columns["position"][:4000] = columns["position"][4000]
        columns["force"][:4000] = columns["force"][4000]

    log = drive(rate=1000.0, seconds=12.0, change=change)
    write_log(log, tmp_path / "a.mcap")
    monkeypatch.setattr(encode, "CHUNK_BYTES", 5000)
    write_log(log, tmp_path / "a.mcap")
    monkeypatch.setattr(long, "LARGEST_PART", 4000)
    findings = long.check_file(tmp_path / "a.mcap").findings
    assert not {Fault.FLAT, Fault.WEAK_EXCITATION} & {f.fault for f in findings}
    assert any("into the part from 8" in f.where for f in findings)
