"""Files that appear whole or not at all, and are found wanting before the work is done."""

from __future__ import annotations

import os
import stat
import sys
from collections.abc import Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from twin.errors import InputError, Unwritten

PART = ".twin-part"
UNFINISHED = ".unfinished"  # a recording, of which a killed run leaves what it has written
TRIAL = bytes(1 << 16)  # written and removed again, to find a full disk before the work

# A program that is told to end at once has no other way to know what it would leave behind.
_unfinished: set[Path] = set()


def require_writable(path: Path) -> None:
    """Raise InputError now, instead of after the work, where the file could not be written."""
    with _explained(path):
        if not _is_direct(path):
            with _opened(_checked(path), _passing()) as stream:
                stream.write(TRIAL)
        elif path.is_char_device():  # a pipe would end there for its reader
            with open(path, "wb", buffering=0) as stream:
                stream.write(b"")


def make_folder(path: Path) -> None:
    """Make a folder and those above it; raises InputError where that is not possible."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        reason = error.strerror or error
        raise InputError(f"{path}: cannot be made: {reason}; give another folder") from error


def atomic_writer(path: Path) -> AbstractContextManager[BinaryIO]:
    """A stream whose bytes become ``path`` at the end, or nothing where anything fails.

    A symbolic link is followed, a file keeps its permissions, and a device or pipe is written to.
    Raises InputError where the folder or the disk refuses.
    """
    return _written(path, _passing())


def recording(path: Path) -> AbstractContextManager[BinaryIO]:
    """``atomic_writer`` for what grows while a long run lasts: the file ``path.unfinished``.

    It is removed where the run fails or is interrupted. A killed run leaves it to be recovered,
    until the next run that records to the same path. Raises InputError where one does just now.
    """
    return _written(path, "{}" + UNFINISHED)


def write_atomically(path: Path, content: bytes) -> None:
    """Write a file, whole or not at all; raises InputError."""
    with atomic_writer(path) as stream:
        stream.write(content)


def kept_beside(path: Path, content: bytes) -> Path | None:
    """Keep a file that is about to be written over with other content, under a name with a tilde.

    The name that it has then, which no other content had; None where nothing would be lost. Raises
    InputError.
    """
    with _explained(path):
        if _is_direct(path) or not path.is_file() or (old := path.read_bytes()) == content:
            return None
        number = 1
        while True:
            kept = path.with_name(f"{path.name}~{number if number > 1 else ''}")
            if not kept.exists():
                write_atomically(kept, old)
                return kept
            if kept.is_file() and kept.read_bytes() == old:
                return kept
            number += 1


def is_same_file(one: Path, other: Path) -> bool:
    """Whether two paths are one file, through links too; never a device, a pipe or a folder."""
    if any(_is_direct(path) or path.is_dir() for path in (one, other)):
        return False
    if one.exists() and other.exists():
        return os.path.samefile(one, other)
    return os.path.realpath(one) == os.path.realpath(other)


def remove_unfinished() -> None:
    """Remove what is half written, where the program ends at once."""
    for part in tuple(_unfinished):
        _remove(part)


@contextmanager
def _written(path: Path, name: str) -> Iterator[BinaryIO]:
    """A stream whose bytes lie in a file beside ``path``, of that name, and become it."""
    with _explained(path):
        if _is_direct(path):
            with open(path, "wb") as stream:
                yield stream
            return
        target = _checked(path)
        with _opened(target, name) as stream:
            yield stream
            stream.flush()
            os.fsync(stream.fileno())
            if target.exists():
                os.chmod(stream.name, stat.S_IMODE(target.stat().st_mode))
            os.replace(stream.name, target)
            with suppress(OSError):  # the folder's entry as well, where the system can
                number = os.open(target.parent, os.O_RDONLY)
                try:
                    os.fsync(number)
                finally:
                    os.close(number)


def _passing() -> str:
    """The name beside a file, put in for {}, of what this process writes until it is whole."""
    return f".{{}}.{os.getpid()}{PART}"


@contextmanager
def _opened(target: Path, name: str) -> Iterator[BinaryIO]:
    """An empty file beside the target that nobody else writes, removed on leaving if still there.

    name: with {} for that of the target.
    """
    part = target.with_name(name.format(target.name))
    with ExitStack() as leaving:
        if not part.exists():  # else it may be another run's, until it is locked
            _note(part, leaving)
        stream = leaving.enter_context(_held(part))
        _note(part, leaving)
        if stream.tell():  # a killed run has left it
            stream.truncate(0)
        yield stream


def _held(part: Path) -> BinaryIO:
    """The file, locked; opened anew where another run has swept it before it was.

    Until its lock it looks like one that a killed run has left.
    """
    while True:
        stream = open(part, "ab")  # noqa: SIM115 - it is given open
        try:
            lock(stream)
            if os.path.samestat(os.stat(part), os.fstat(stream.fileno())):
                return stream
        except FileNotFoundError:
            pass
        except BlockingIOError as error:
            if part.suffix != PART:  # else it is being swept
                stream.close()
                text = f"{part}: another run is writing it; give another name"
                raise InputError(text) from error
        stream.close()


def _note(part: Path, leaving: ExitStack) -> None:
    """Note that a file is half written; it is removed on leaving if it is still there."""
    _unfinished.add(part)
    leaving.callback(_remove, part)


def _remove(part: Path) -> None:
    if part in _unfinished:
        with suppress(OSError):
            part.unlink(missing_ok=True)
        _unfinished.discard(part)


def _checked(path: Path) -> Path:
    """The file itself where the path is a symbolic link to it, and its folder free of remains.

    Raises InputError for a path that is no file in a folder that is there. The unfinished files of
    runs that were killed are removed; a run that lives has its own locked.
    """
    target = Path(os.path.realpath(path)) if path.is_symlink() else path
    if target.is_dir():
        raise InputError(f"{path}: is a folder; give the name of a file in it")
    if not target.parent.is_dir():
        raise InputError(f"{path}: its folder does not exist; create {path.parent} first")
    for part in target.parent.glob(f".*{PART}"):
        if part not in _unfinished:
            with suppress(OSError), open(part, "r+b") as stream:
                lock(stream)
                part.unlink()
    return target


@contextmanager
def _explained(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        reason = error.strerror or error
        raise Unwritten(
            f"{path}: cannot be written: {reason}; check folder, rights and free space"
        ) from error


def _is_direct(path: Path) -> bool:
    """Whether there is nothing to replace: a device, a pipe, standard output."""
    if path.parent.as_posix() in ("/dev", "/dev/fd") or path.as_posix().startswith("/proc/"):
        return True
    try:
        mode = path.stat().st_mode
    except (OSError, ValueError):
        return False
    return not (stat.S_ISREG(mode) or stat.S_ISDIR(mode))


def lock(stream: BinaryIO) -> None:
    """Hold the file until it is closed; raises OSError where another process does."""
    if sys.platform != "win32":  # there an open file cannot be removed
        import fcntl

        fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
