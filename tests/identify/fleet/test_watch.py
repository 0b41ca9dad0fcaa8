"""A log is followed while it is written, and a change of its residual is told within seconds."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from cli_runs import refusal, twin
from machines import tracked

from identify.fleet.floor import STAGE
from identify.fleet.watch import Watcher
from twin.logs import Log, write_log
from twin.logs.follow import Follower
from twin.model.file import load_model
from twin.model.machine import AxisIntervals

MODEL = load_model(STAGE)
SINCE, SECONDS = 17.0, 23.0
FLOOR = 2e-3  # N RMS, about what noise leaves in a window


@pytest.fixture(scope="module")
def log() -> Log:
    return tracked(MODEL, seed=2, duration=SECONDS)


def spoilt(log: Log, size: float, since: float = SINCE) -> Log:
    """With a force from a time on that no effect of the model makes; N RMS."""
    extra = np.sqrt(2.0) * size * np.sin(2.0 * np.pi * log.axes["x"].position / 0.02)
    extra *= log.time >= since
    constant = log.axes["x"].force_constant or 1.0
    per = {"force": 1.0, "current": 1.0 / constant}
    return log.changed(lambda name, c: c + per[name] * extra if name in per else c)


def written(log: Log, folder: Path) -> bytes:
    write_log(replace(log, truth={}), folder / "whole.mcap", chunk_bytes=1 << 14)
    return (folder / "whole.mcap").read_bytes()


def test_the_windows_of_a_growing_file_are_those_of_the_whole(log, tmp_path) -> None:
    data, path, seen = written(log, tmp_path), tmp_path / "live.mcap", []
    follower = Follower(path)
    assert list(follower.windows(1.0)) == []  # its writer has not begun
    path.touch()
    for _ in range(2):
        assert list(follower.windows(1.0)) == []  # or has not written anything
    for size in range(0, len(data) + 40_001, 40_001):
        path.write_bytes(data[:size])
        seen += follower.windows(1.0)
    assert follower.ended
    assert follower.told == []
    assert [start for start, _ in seen] == pytest.approx(range(int(SECONDS)))
    for i, (_, window) in enumerate(seen):
        part = log.part(1000 * i, 1000 * (i + 1))
        assert np.array_equal(window.axes["x"].position, part.axes["x"].position)


def test_a_change_of_five_floors_is_told_within_five_seconds_and_no_other(log) -> None:
    watcher, changed, alarms = Watcher(MODEL), spoilt(log, 5.0 * FLOOR), []
    for i in range(int(SECONDS)):
        alarms += watcher.take(float(i), changed.part(1000 * i, 1000 * (i + 1))).alarms
    (alarm,) = alarms
    assert SINCE < alarm.time <= SINCE + 5.0
    assert abs(alarm.changed - SINCE) <= 1.0
    assert alarm.after > 2.0 * alarm.before


@pytest.mark.parametrize(("gap", "tells"), [(0.0, "...xxxxxx"), (0.5, "...xx...x")])
def test_a_window_tells_of_an_axis_what_three_seconds_before_it_prepare(log, gap, tells) -> None:
    """Of one that does not follow on the last, as of the first."""
    watcher, told = Watcher(MODEL), ""
    for i in range(9):
        start = i + gap * (i >= 5)
        window = watcher.take(start, log.part(1000 * i, 1000 * (i + 1)))
        assert (window.end, len(window.log), window.alarms) == (start + 1.0, 1000, ())
        told += "".join(axis.axis for axis in window.axes) or "."
    assert told == tells


@pytest.mark.parametrize(("floors", "unlike"), [(0.0, False), (30.0, True)])
def test_a_machine_that_was_never_as_its_model_is_told(log, floors, unlike) -> None:
    """No change tells of it."""
    fitted = replace(MODEL, intervals={"x": AxisIntervals({}, 1.1)})
    watcher, other = Watcher(fitted), spoilt(log, floors * FLOOR, since=0.0)
    for i in range(8):
        assert not watcher.take(float(i), other.part(1000 * i, 1000 * (i + 1))).alarms
    assert bool(watcher.unlike) is unlike
    assert not replace(watcher, model=MODEL).unlike  # which was not fitted


def test_a_torn_chunk_and_a_writer_that_begins_anew_are_told_and_followed(log, tmp_path) -> None:
    data = bytearray(written(log.part(0, 12_000), tmp_path))
    data[len(data) // 2] ^= 0xFF
    path = tmp_path / "live.mcap"
    path.write_bytes(data)
    follower = Follower(path)
    first = [start for start, _ in follower.windows(1.0)]
    assert "left out" in follower.told[0]
    assert 8 <= len(first) < 12
    path.unlink()
    path.write_bytes(written(log.part(0, 5000), tmp_path))
    assert len(list(follower.windows(1.0))) == 5
    assert "begins anew" in follower.told[-1]


def test_the_command_ends_with_the_log(log, tmp_path) -> None:
    written(log.part(0, 6000), tmp_path)
    done = twin("watch", "whole.mcap", STAGE, "--json", folder=tmp_path)
    found = json.loads(done.stdout)
    assert (done.returncode, found["ended"], found["windows"]) == (0, True, 6)
    assert found["alarms"] == found["told"] == []
    assert "is no file" in refusal("watch", "gone.mcap", STAGE, folder=tmp_path)
    (tmp_path / "none.mcap").write_bytes(b"not a log")
    assert "not an MCAP file" in refusal("watch", "none.mcap", STAGE, folder=tmp_path)
