"""A file appears whole or not at all, wherever it is to go."""

import os
import stat
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from twin.errors import InputError
from twin.files import (
    PART,
    atomic_writer,
    kept_beside,
    recording,
    remove_unfinished,
    require_writable,
    write_atomically,
)

POSIX = pytest.mark.skipif(sys.platform == "win32", reason="links, pipes and rights of POSIX")
KILLED = """
import os, signal
from pathlib import Path
from twin.files import atomic_writer
with atomic_writer(Path("a.bin")) as stream:
    stream.write(b"half")
    stream.flush()
    os.kill(os.getpid(), signal.SIGKILL)
"""


def test_a_trial_of_writing_leaves_the_file_and_nothing_beside_it(tmp_path: Path) -> None:
    (tmp_path / "there").mkdir()
    target = tmp_path / "there" / "a.bin"
    target.write_bytes(b"old")
    link = tmp_path / "b.bin"
    link.symlink_to(target)
    require_writable(link)
    assert (sorted(tmp_path.rglob("*")), target.read_bytes()) == (
        [link, target.parent, target],
        b"old",
    )


@POSIX
def test_a_link_is_followed_and_permissions_stay(tmp_path: Path) -> None:
    (tmp_path / "there").mkdir()
    target = tmp_path / "there" / "a.bin"
    target.write_bytes(b"old")
    target.chmod(0o640)
    (tmp_path / "link").symlink_to("there/a.bin")
    write_atomically(tmp_path / "link", b"new")
    assert (tmp_path / "link").is_symlink()
    assert target.read_bytes() == b"new"
    assert stat.S_IMODE(target.stat().st_mode) == 0o640
    assert [p.name for p in target.parent.iterdir()] == ["a.bin"]


@POSIX
def test_a_pipe_and_a_device_are_written_to(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    got: list[bytes] = []
    reader = threading.Thread(target=lambda: got.append(pipe.read_bytes()))
    reader.start()
    write_atomically(pipe, b"through")
    reader.join()
    assert got == [b"through"]
    assert stat.S_ISFIFO(pipe.stat().st_mode)
    write_atomically(Path(os.devnull), b"away")
    assert stat.S_ISCHR(os.stat(os.devnull).st_mode)


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="a device of Linux")
def test_a_full_disk_is_one_line_and_found_before_the_work(tmp_path: Path) -> None:
    import resource

    with pytest.raises(InputError, match="/dev/full: cannot be written: No space left"):
        write_atomically(Path("/dev/full"), b"x" * 10**6)
    with pytest.raises(InputError, match="/dev/full: cannot be written: No space left"):
        require_writable(Path("/dev/full"))
    require_writable(Path("/dev/null"))
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (1000, hard))  # as a disk with so much left
        with pytest.raises(InputError, match=r"a\.bin: cannot be written: File too large"):
            require_writable(tmp_path / "a.bin")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert list(tmp_path.iterdir()) == []


def test_what_cannot_be_written_is_said_before_the_work(tmp_path: Path) -> None:
    for path, why in (
        (tmp_path, "is a folder"),
        (tmp_path / "no" / "a.bin", "its folder does not exist"),
        (Path(""), "is a folder"),
    ):
        for attempt in (require_writable, lambda p: write_atomically(p, b"")):
            with pytest.raises(InputError, match=why) as refused:
                attempt(path)
            assert str(refused.value).startswith(str(path))
    require_writable(tmp_path / "a.bin")
    assert list(tmp_path.iterdir()) == []


def test_a_run_that_was_killed_leaves_nothing_behind_the_next(tmp_path: Path) -> None:
    subprocess.run(
        [sys.executable, "-c", KILLED], cwd=tmp_path, check=False,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])},
    )  # fmt: skip
    assert [p.name.endswith(PART) for p in tmp_path.iterdir()] == [True]
    write_atomically(tmp_path / "b.bin", b"whole")
    assert [p.name for p in tmp_path.iterdir()] == ["b.bin"]


@pytest.mark.parametrize("kind", [atomic_writer, recording])
def test_a_program_that_ends_at_once_leaves_nothing_half_written(kind, tmp_path: Path) -> None:
    def end_at_once() -> None:
        with kind(tmp_path / "a.bin") as stream:
            stream.write(b"half")
            assert len(list(tmp_path.iterdir())) == 1
            remove_unfinished()
            assert list(tmp_path.iterdir()) == []

    with pytest.raises(InputError, match="cannot be written"):
        end_at_once()


def test_a_run_that_lives_keeps_its_part(tmp_path: Path) -> None:
    with atomic_writer(tmp_path / "a.bin") as stream:
        stream.write(b"one")
        write_atomically(tmp_path / "b.bin", b"two")
    assert (tmp_path / "a.bin").read_bytes() == b"one"


def test_each_content_that_is_written_over_is_kept_under_a_name_of_its_own(tmp_path: Path) -> None:
    path, kept = tmp_path / "m.toml", []
    assert kept_beside(path, b"0") is None  # nothing is there yet
    for number in range(4):
        write_atomically(path, b"%d" % number)
        assert kept_beside(path, b"%d" % number) is None  # it would not be another
        kept.append(kept_beside(path, b"new"))
    assert [p and p.name for p in kept] == ["m.toml~", "m.toml~2", "m.toml~3", "m.toml~4"]
    assert [p and p.read_bytes() for p in kept] == [b"0", b"1", b"2", b"3"]
    write_atomically(path, b"2")
    assert kept_beside(path, b"new") == kept[2]
    assert len(list(tmp_path.iterdir())) == 5
