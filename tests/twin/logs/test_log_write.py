"""What is written appears whole or not at all, also while it grows; what is no log is refused."""

import os
import signal
import subprocess
import sys
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from log_cases import assert_same_log, assert_same_samples, two_axes

from twin.errors import InputError
from twin.files import UNFINISHED
from twin.logs import AxisLog, Log, read_log, record_log, recover_log, write_log
from twin.logs.log import joined

LOG = two_axes()
SMALL = 20_000  # bytes of a stretch
KILLED = """
import os, signal, sys
from pathlib import Path
sys.path.insert(0, sys.argv[1])
from log_cases import two_axes
from twin.logs import record_log
def parts():
    for k in range(0, 500, 50):
        if k == 450:
            os.kill(os.getpid(), signal.SIGKILL)
        yield two_axes().part(k, k + 50)
record_log(parts(), Path("a.mcap"), chunk_bytes=20_000)
"""


def cut(log: Log, *places: int) -> list[Log]:
    return [log.part(a, b) for a, b in pairwise((0, *places, len(log)))]


@pytest.mark.parametrize("places", [(), (1,), (200, 201, 460), tuple(range(7, 500, 7))])
def test_parts_that_are_recorded_are_the_whole_that_is_written(tmp_path, places):
    parts = cut(LOG, *places)
    assert record_log(parts, tmp_path / "a.mcap", chunk_bytes=SMALL) == len(LOG)
    write_log(LOG, tmp_path / "b.mcap", chunk_bytes=SMALL)
    assert (tmp_path / "a.mcap").read_bytes() == (tmp_path / "b.mcap").read_bytes()
    assert_same_log(joined(parts), LOG)


def test_a_recording_that_fails_leaves_nothing_and_says_where(tmp_path):
    bad = cut(two_axes(), 300)
    bad[1].axes["x"].columns["position"][5:] = np.nan
    with pytest.raises(InputError, match=r"nan at 0\.0305 s \(sample 305\)"):
        record_log(bad, tmp_path / "a.mcap", chunk_bytes=SMALL)
    assert list(tmp_path.iterdir()) == []


def test_an_interrupted_run_leaves_what_was_there(tmp_path):
    def parts():
        yield LOG.part(0, 300)
        raise KeyboardInterrupt

    target = tmp_path / "a.mcap"
    for before in (None, b"older"):
        if before:
            target.write_bytes(before)
        with pytest.raises(KeyboardInterrupt):
            record_log(parts(), target, chunk_bytes=SMALL)
        assert [p.read_bytes() for p in tmp_path.iterdir()] == [before] * bool(before)


def test_two_runs_do_not_record_to_one_file(tmp_path):
    def parts():
        yield LOG.part(0, 100)
        with pytest.raises(InputError, match="another run is writing it"):
            record_log([LOG], tmp_path / "a.mcap")
        yield LOG.part(100, 500)

    record_log(parts(), tmp_path / "a.mcap", chunk_bytes=SMALL)
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


def with_x(log: Log, **columns: np.ndarray) -> Log:
    axis = replace(log.axes["x"], columns={**log.axes["x"].columns, **columns})
    return replace(log, axes={**log.axes, "x": axis})


def nan_at(k: int) -> np.ndarray:
    return np.where(np.arange(500) == k, np.nan, 1.0)


BAD_LOGS = [
    (lambda g: with_x(g, current=nan_at(123)), r"/axis/x: current is nan at 0.0123 s"),
    (lambda g: with_x(g, torque=np.ones(500)), "unknown signal torque; allowed: setpoint"),
    (lambda g: replace(g, axes={}), "no samples"),
    (lambda g: replace(g, axes={"x/y": g.axes["x"]}), "axis name 'x/y'"),
    (lambda g: replace(g, truth={"x": {"a b": np.ones(500)}}), "/truth/x: column name 'a b'"),
    (lambda g: replace(g, metadata={"seed": 3}), "metadata seed is 3"),
    (
        lambda g: replace(g, axes={"x": AxisLog({"position": np.ones(3)})}, truth={}),
        "/axis/x: .*position and one of current and force",
    ),
    (
        lambda g: replace(g, axes={"x": replace(g.axes["x"], force_constant=-1.0)}),
        "/axis/x: force constant is -1.0 N/A",
    ),
]


@pytest.mark.parametrize(("spoil", "message"), BAD_LOGS)
def test_a_log_that_could_not_be_read_back_is_refused(tmp_path, spoil, message):
    with pytest.raises(InputError, match=message) as caught:
        write_log(spoil(LOG), tmp_path / "a.mcap")
    assert "\n" not in str(caught.value)
    assert list(tmp_path.iterdir()) == []
