"""The folder of a project: read, changed by one writer at a time, and taken back.

Every state of `project.toml` is kept under `.twin/states`, the present one too: so a state that was
edited by hand is one of them as soon as anything follows, and a step back always has where to go.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from time import sleep

from identify.project.entries import Project
from twin.entries import read_entries, toml_document
from twin.errors import InputError, at
from twin.files import lock, make_folder, write_atomically

FILE = "project.toml"
OWN = ".twin"
HISTORY = "history.sh"
EVERY = 0.1  # s between two looks at a lock
Change = Callable[[Project], Project]


def silent(holder: str) -> None:
    """Nobody is told who is waited for."""


@dataclass(frozen=True)
class Folder:
    """The folder of a project. root: where `project.toml` lies."""

    root: Path

    @property
    def file(self) -> Path:
        """The file of the project."""
        return self.root / FILE

    def read(self) -> Project:
        """The project as it is now; raises InputError where its file is damaged."""
        with at(str(self.file)):
            return read_entries(Project, toml_document(self.file)[1])

    def begin(self) -> None:
        """Make an empty project; raises InputError where there is one."""
        if self.file.exists():
            raise InputError(f"{self.root}: is a project already; `twin log` tells what is in it")
        make_folder(self.root / OWN / "states")
        write_atomically(self.root / OWN / ".gitignore", b"*\n")
        self._keep(Project())

    def change(self, change: Change) -> Project:
        """Change the project as it is now, whoever else has changed it meanwhile.

        An answer alone is no step that is taken back: it changes nothing that one goes on with.
        """
        with self._held("state"):
            now = self.read()
            if self._text() != self._last():
                self._note(self._text())  # edited by hand
            made = change(now)
            if made.model_copy(update={"answers": now.answers}) != now:
                self._keep(made)
            elif made != now:
                text = made.text().encode()
                write_atomically(self.file, text)
                write_atomically(self._states()[-1], text)
            return made

    def undo(self) -> Project:
        """The project one change back, that of an editor too; raises InputError at its beginning.

        No file but `project.toml` is touched.
        """
        with self._held("state"):
            states = self._states()
            if self._text() == self._last():
                if len(states) < 2:
                    raise InputError(f"{self.file}: nothing was changed yet that could be undone")
                states.pop().unlink()
            if not states:
                raise InputError(f"{self.file}: no state before this one is known")
            text = states[-1].read_text(encoding="utf-8")
            write_atomically(self.file, text.encode())
            return self.read()

    @contextmanager
    def working(self, command: str, waiting: Callable[[str], None] = silent) -> Iterator[None]:
        """The project for one command that writes into it; others wait.

        waiting: told once the command that is waited for.
        """
        with self._held("work", waiting) as path:
            write_atomically(path.with_suffix(".who"), command.encode())
            try:
                yield
            finally:
                with suppress(OSError):
                    path.with_suffix(".who").unlink()

    def free_name(self, folder: str, pattern: str) -> Path:
        """A name in a folder of the project, with the first number for {} that is not used."""
        make_folder(self.root / folder)
        known = re.compile(re.escape(pattern).replace(r"\{\}", r"0*(\d+)") + r".*")
        used = [known.fullmatch(path.name) for path in (self.root / folder).iterdir()]
        number = 1 + max((int(found[1]) for found in used if found), default=0)
        return Path(folder) / pattern.format(number)

    @contextmanager
    def _held(self, name: str, waiting: Callable[[str], None] = silent) -> Iterator[Path]:
        """A lock of the project, waited for; it ends with the process that holds it."""
        make_folder(self.root / OWN)
        path, told = self.root / OWN / f"{name}.lock", False
        with open(path, "ab") as stream:
            while True:
                try:
                    lock(stream)
                    break
                except BlockingIOError:
                    if not told:
                        waiting(self.worker() or "another command")
                    told = True
                    sleep(EVERY)
            yield path

    def worker(self) -> str | None:
        """The command that is writing into the project just now."""
        path = self.root / OWN / "work.lock"
        try:
            with open(path, "r+b") as stream:
                lock(stream)
            return None
        except BlockingIOError:
            with suppress(OSError):
                return path.with_suffix(".who").read_text(encoding="utf-8")
            return "another command"
        except OSError:
            return None

    def _keep(self, project: Project) -> None:
        """Write a state and note it."""
        text = project.text()
        write_atomically(self.file, text.encode())
        self._note(text)

    def _note(self, text: str) -> None:
        write_atomically(self.root / self.free_name(f"{OWN}/states", "{}.toml"), text.encode())

    def _text(self) -> str:
        return self.file.read_text(encoding="utf-8")

    def _last(self) -> str | None:
        """The text of the last state that is known."""
        states = self._states()
        return states[-1].read_text(encoding="utf-8") if states else None

    def _states(self) -> list[Path]:
        """All states in their order."""
        return sorted((self.root / OWN / "states").glob("*.toml"), key=lambda p: int(p.stem))


def project_here() -> Folder | None:
    """The project of the folder where a command runs; None where there is none."""
    return Folder(Path()) if Path(FILE).is_file() else None
