"""A log is read in part or part by part: only the chunks of what is asked for, and no other."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from check_drive import drive
from log_cases import assert_same_samples, two_axes, write_together
from mcap.opcode import Opcode
from mcap.records import ChunkIndex
from mcap_bytes import of, parsed

from twin.checks import Fault, Severity, check_log
from twin.checks.long import (
    CheckedPart,
    check_file,
    is_thinned,
    read_checked,
    read_measured,
    together,
)
from twin.checks.report import WHOLE, CheckReport, LogFinding, Place
from twin.errors import InputError
from twin.logs import AxisLog, Log, read_log, write_log
from twin.logs.decode import read_parts
from twin.logs.log import joined, thinned

LOG = two_axes()
X, Y, TRUTH = 1, 2, 3  # the channels


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """The log in 12 chunks of each topic."""
    write_log(LOG, tmp_path / "a.mcap", chunk_bytes=20_000)
    return tmp_path / "a.mcap"


def spoil(path: Path, *channels: int, after: int = -1, before: int = 1 << 62) -> None:
    """Flip a bit in every chunk of some channels that ends before a time or begins after it, ns."""
    data = bytearray(path.read_bytes())
    for index in (parsed(ChunkIndex, p) for p in of(bytes(data), Opcode.CHUNK_INDEX)):
        outside = index.message_start_time > after or index.message_end_time < before
        if outside and index.message_index_offsets.keys() <= set(channels):
            data[index.chunk_start_offset + index.chunk_length - 9] ^= 1
    path.write_bytes(data)


@pytest.mark.parametrize(
    ("asked", "channels"),
    [({"axes": ("x",), "truth": False}, [X]), ({"axes": ("y",)}, [Y]), ({"truth": False}, [X, Y]),
     ({"axes": ("x",)}, [X, TRUTH])],
)  # fmt: skip
def test_only_chunks_of_what_is_asked_for_are_read(path, asked, channels):
    spoil(path, *{X, Y, TRUTH} - set(channels))
    truth = LOG.truth if TRUTH in channels else {}
    axes = {a: LOG.axes[a] for n, a in ((X, "x"), (Y, "y")) if n in channels}
    got = read_log(path, **asked)
    assert_same_samples(got, Log(LOG.sample_rate, axes, truth=truth))
    assert got.metadata["source"] == "simulation"
    with pytest.raises(InputError, match=r"chunk at byte .*twin recover"):
        read_log(path)


def test_damage_to_what_is_not_asked_for_is_found_by_a_check_alone(path):
    spoil(path, TRUTH)
    assert sum(map(len, read_parts(path, 20))) == len(LOG)
    with pytest.raises(InputError, match="twin recover"):
        check_file(path)


@pytest.mark.parametrize(
    ("start", "stop", "span"),
    [(0.0101, 0.0203, slice(101, 203)), (None, 0.01, slice(0, 100)),
     (0.045, None, slice(450, 500)), (0.01005, 0.01015, slice(101, 102))],
)  # fmt: skip
def test_a_range_is_cut_out_and_only_its_chunks_are_read(path, start, stop, span):
    begin, end = 1e9 * (start or 0.0), 1e9 * (stop or 1.0)
    spoil(path, X, Y, TRUTH, after=int(end), before=int(begin))
    assert_same_samples(read_log(path, start=start, stop=stop), LOG, span)
    with pytest.raises(InputError):
        read_log(path)


@pytest.mark.parametrize(
    ("start", "stop", "why"),
    [(0.02, 0.01, "not before"), (9.0, 10.0, "no samples from 9 to 10 s")],
)
def test_a_range_without_samples_is_refused(path, start, stop, why):
    with pytest.raises(InputError, match=why):
        read_log(path, start=start, stop=stop)


def test_a_field_that_no_log_has_is_refused_and_one_axis_needs_no_list(path):
    """A misspelt field was left out without a word."""
    with pytest.raises(InputError, match="no log has a field postion; give some of setpoint_posi"):
        read_log(path, fields=["postion", "force"])
    assert read_log(path, axes="x", truth=False) == read_log(path, axes=["x"], truth=False)


def test_some_fields_of_one_axis(path):
    got = read_log(path, ["y"], fields=("position", "force"), truth=False)
    assert {n: list(a.columns) for n, a in got.axes.items()} == {"y": ["position"]}
    assert got.truth == {}
    with pytest.raises(InputError, match=r"no samples on topic /axis/z; .* of these: x, y$"):
        read_log(path, axes=("z",))


@pytest.mark.parametrize("samples", [1, 60, 5000])
def test_a_log_read_in_parts_is_the_log(path, samples):
    parts = list(read_parts(path, samples))
    assert (len(parts) > 1) is (samples < 450)
    assert all(len(p) >= samples for p in parts[:-1])
    assert_same_samples(joined(parts), read_log(path, truth=False))


def test_a_gap_between_parts_is_found(tmp_path, path):
    data = path.read_bytes()
    chunk = of(data, Opcode.CHUNK)[5]  # of x, the second
    (tmp_path / "b.mcap").write_bytes(data[: chunk.start] + data[chunk.end :])
    with pytest.raises(InputError):
        list(read_parts(tmp_path / "b.mcap", 1))


def test_logs_with_all_topics_in_one_chunk_are_read_too(tmp_path):
    """As older versions wrote them: whole, in part, and in parts."""
    axes = {
        a: AxisLog({f: LOG.axes["x"].columns[f] + n for f in ("position", "force")})
        for n, a in enumerate("xy")
    }
    old = Log(LOG.sample_rate, axes)
    write_together(tmp_path / "a.mcap", old, rows=11)
    assert_same_samples(read_log(tmp_path / "a.mcap"), old)
    one = read_log(tmp_path / "a.mcap", axes=("y",))
    assert_same_samples(one, Log(LOG.sample_rate, {"y": axes["y"]}))
    ends = np.cumsum([0, *(len(part) for part in read_parts(tmp_path / "a.mcap", 20))])
    assert ends[-1] == len(LOG)
    assert all(b - a >= 20 for a, b in pairwise(ends[:-1]))


def test_a_slower_recorder_reads_positions_and_means_of_the_command():
    log = drive(rate=1000.0, seconds=0.0505, signals=("position", "force", "current"))
    slow = thinned(log, 4)
    assert (slow.sample_rate, len(slow)) == (250.0, len(log) // 4)
    columns, got = log.axes["x"].columns, slow.axes["x"].columns
    np.testing.assert_array_equal(got["position"], columns["position"][:-2:4])
    for k in (0, 7):
        assert got["force"][k] == pytest.approx(columns["force"][4 * k : 4 * k + 4].mean())


def test_a_file_is_checked_as_its_log_is_and_read_at_a_lower_rate(tmp_path):
    late = {"velocity": 0.02}
    log = drive(
        rate=10_000.0, seconds=6.0, late=late, signals=("position", "force", "velocity")
    )  # fmt: skip
    write_log(log, tmp_path / "a.mcap")
    report = check_file(tmp_path / "a.mcap")
    assert report == check_log(log)
    assert report.findings
    fields = ("position", "force")
    for every, step in ((1, 1), (2, 2), (9, 5)):  # a step is no longer than 0.5 ms
        wanted = thinned(log.with_fields(fields), step)
        got, again = read_checked(tmp_path / "a.mcap", fields, every)
        assert again == report
        assert_same_samples(got, wanted)
        assert is_thinned(got, tmp_path / "a.mcap") is (step > 1)
        assert_same_samples(read_measured(tmp_path / "a.mcap", fields, every), wanted)


def test_a_log_too_long_to_hold_is_read_in_parts(tmp_path):
    """What a part leaves of a step goes to the next."""
    column = np.arange(2_520_001.0)
    log = Log(20_000.0, {"x": AxisLog({"position": column, "force": -column})})
    write_log(log, tmp_path / "a.mcap")
    got = read_measured(tmp_path / "a.mcap", ("position", "force"), 7)
    assert_same_samples(got, thinned(log, 7))


def test_a_log_too_long_to_hold_is_checked_in_parts(tmp_path):
    short = drive(rate=20_000.0, seconds=12.0).axes["x"].columns
    columns = {f: np.tile(short[f], 11)[:2_600_000] for f in ("position", "force")}
    write_log(Log(20_000.0, {"x": AxisLog(columns)}), tmp_path / "a.mcap")
    (seam,) = check_file(tmp_path / "a.mcap").findings  # where it is tiled
    assert 0.0 < seam.where.start < 65.0
    assert str(seam.where).endswith(", and in 1 other parts")


def finding(fault=Fault.LAG, where=WHOLE, severity=Severity.WARNING, what="w") -> LogFinding:
    return LogFinding(severity, fault, "x", what, where, "r")


def parts_of(*reports: tuple[LogFinding, ...]) -> list[CheckedPart]:
    return [CheckedPart(10.0 * i, 10.0 * i + 10.0, CheckReport(r)) for i, r in enumerate(reports)]


ONE, TWO = finding(where=Place(3.0), what="first"), finding(where=Place(4.0), what="second")
ANYWHERE, WORSE = finding(), finding(severity=Severity.ERROR, what="worse", where=Place(1.0))


@pytest.mark.parametrize(
    ("reports", "what", "where"),
    [
        (((), (ONE, TWO), (TWO,)), "first",
         "from 13 s, and in 1 other parts"),
        (((), (ANYWHERE,)), "w", "10 to 20 s"),
        (((ANYWHERE,), (ANYWHERE,)), "w", "whole log"),
        (((ANYWHERE,), (WORSE,)), "worse",  # the worst of a fault is said
         "from 11 s, and in 1 other parts"),
    ],
)  # fmt: skip
def test_a_fault_is_said_once_with_its_first_place_and_in_how_many_parts(reports, what, where):
    report = together(parts_of(*reports))
    (said,) = report.findings
    assert (said.what, str(said.where)) == (what, where)
    assert report.ok == (said.severity is Severity.WARNING)


def test_one_part_is_the_log():
    alone = parts_of((ONE, TWO))
    assert together(alone) is alone[0].report


@pytest.mark.parametrize("fault", [Fault.FLAT, Fault.WEAK_EXCITATION, Fault.COARSE_POSITION])
def test_what_is_of_the_whole_counts_where_all_parts_say_so(fault):
    dull = finding(fault)
    assert together(parts_of((dull,), ())).findings == ()
    assert [f.fault for f in together(parts_of((dull,), (dull,))).findings] == [fault]
