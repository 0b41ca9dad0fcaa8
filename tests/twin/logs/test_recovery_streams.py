"""A damaged log is recovered piece by piece: what is written is what is read, in little memory."""

from __future__ import annotations

import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from log_cases import RATE, assert_same_samples, two_axes, write_together
from mcap_bytes import CHUNK, records

from twin.errors import InputError
from twin.files import UNFINISHED
from twin.logs import (
    AxisLog,
    Log,
    read_log,
    recover,
    recover_file,
    recover_log,
    write_log,
)
from twin.logs import container as file_bytes
from twin.logs import writer as encode
from twin.logs.container import FileBytes

LOG = two_axes()


def chunks(data: bytes) -> list[int]:
    """Ends of the chunks."""
    return [r.end for r in records(data) if r.opcode == CHUNK]


def damaged(path: Path, *places: int) -> Path:
    """Flip a bit at each of these bytes."""
    data = bytearray(path.read_bytes())
    for place in places:
        data[place] ^= 1
    path.write_bytes(data)
    return path


@pytest.fixture(params=["topics apart", "together", "intact"])
def path(request, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A log with damage in the middle of each topic, or with none."""
    path = tmp_path / "a.mcap"
    if request.param == "together":
        x = LOG.axes["x"]
        log = Log(RATE, {"x": x, "y": AxisLog({n: c + 1.0 for n, c in x.columns.items()})})
        write_together(path, log)
        return damaged(path, chunks(path.read_bytes())[7] - 50)
    monkeypatch.setattr(encode, "CHUNK_BYTES", 20_000)
    write_log(LOG, path)
    if request.param == "topics apart":
        ends = chunks(path.read_bytes())
        damaged(path, ends[6] - 50, ends[13] - 50)
    return path


def test_what_is_written_piece_by_piece_is_what_is_read_as_a_whole(
    path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In windows of which none holds the head of a chunk as a whole."""
    log, wanted = recover_log(path)
    monkeypatch.setattr(recover, "STEP", 33)
    monkeypatch.setattr(recover, "INTACT_STEP", 33)
    monkeypatch.setattr(file_bytes, "SMALLEST_WINDOW", 37)
    monkeypatch.setattr(file_bytes, "LARGEST_WINDOW", 71)
    recovery, files = recover_file(path, tmp_path / "good.mcap")
    assert (recovery.kept, recovery.lost) == (wanted.kept, wanted.lost)
    assert list(files) == [
        tmp_path / "good.mcap",
        *(tmp_path / f"good.part{n}.mcap" for n in range(1, 1 + len(wanted.others))),
    ]
    assert next(iter(files.values())) == recovery.kept
    for file, part in zip(files, (log, *wanted.others), strict=True):
        write_log(part, tmp_path / "b.mcap")
        assert file.read_bytes() == (tmp_path / "b.mcap").read_bytes()


def test_a_recovery_takes_little_memory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of samples of 1 MB, a few at a time, and where each chunk is."""
    monkeypatch.setattr(encode, "CHUNK_BYTES", 1 << 15)
    monkeypatch.setattr(file_bytes, "LARGEST_WINDOW", 1 << 16)
    monkeypatch.setattr(recover, "STEP", 500)
    monkeypatch.setattr(recover, "INTACT_STEP", 500)
    noise = np.random.default_rng(1).standard_normal((4, 30_000))
    columns = [{"position": noise[i], "force": noise[i + 2]} for i in range(2)]
    path = tmp_path / "a.mcap"
    write_log(Log(RATE, {"x": AxisLog(columns[0]), "y": AxisLog(columns[1])}), path)
    damaged(path, chunks(path.read_bytes())[20] - 50)
    tracemalloc.start()
    recover_file(path, tmp_path / "b.mcap")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < noise.nbytes


def test_what_is_recovered_from_is_there_to_the_last(tmp_path: Path, monkeypatch) -> None:
    """Also where it bears the name of the recording that it becomes."""
    monkeypatch.setattr(encode, "CHUNK_BYTES", 20_000)
    write_log(LOG, tmp_path / "b.mcap")
    ends = chunks((tmp_path / "b.mcap").read_bytes())
    source = (tmp_path / "b.mcap").rename(tmp_path / f"a.mcap{UNFINISHED}")
    damaged(source, *(end - 50 for end in ends[12:15]))
    wanted, told = recover_log(source)
    _, files = recover_file(source, tmp_path / "a.mcap")
    assert len(files) == 2
    for file, log in zip(files, (wanted, *told.others), strict=True):
        assert_same_samples(read_log(file), log)


def test_records_behind_an_attached_log_are_read(tmp_path: Path) -> None:
    """The chunks in the attachment are not those of the log around it."""
    log = Log(RATE, {"x": LOG.axes["x"]}, {"source": "a test"})
    write_log(log.part(0, 50), tmp_path / "inner.mcap")
    attachments = {"inner.mcap": (tmp_path / "inner.mcap").read_bytes(), "b.txt": b"behind"}
    path = tmp_path / "a.mcap"
    write_log(Log(RATE, log.axes, log.metadata, {}, attachments), path)
    path.write_bytes(path.read_bytes()[:-3])
    got, recovery = recover_log(path)
    assert_same_samples(got, log)
    assert got.attachments == attachments
    assert not any("unreadable" in loss for loss in recovery.lost[1:-1])


class _Broken:
    """A disk that refuses what is asked of it."""

    def seek(self, place: int) -> None:
        raise OSError(5, "Input/output error")


def test_a_disk_that_refuses_is_one_line() -> None:
    with pytest.raises(InputError, match="cannot be read: Input/output error"):
        FileBytes(_Broken(), 100).part(0, 10)
