"""`history.sh` of a project: the commands that made it, to be repeated in an empty folder."""

from __future__ import annotations

import os
import shlex
from collections.abc import Iterable, Sequence
from pathlib import Path

from identify.project.folder import HISTORY, Folder
from twin.files import write_atomically

OTHERWISE = " || true"
FROM = '"$from"'
HEAD = """\
#!/bin/sh
# The commands of this project, in their order. In an empty folder, `sh PLACE/history.sh` repeats
# them: the recordings and maps that were given are read from PLACE, all else is made anew.
set -e
from=$(cd "$(dirname "$0")" && pwd)
"""


def note(
    folder: Folder, words: Sequence[str], given: Iterable[object] = (), ends_well: bool = True
) -> None:
    """Add a command to the history. words: as it was typed; given: files that a user gave.

    ends_well: whether its exit code is 0; else the commands behind it are run all the same.
    """
    path = folder.root / HISTORY
    before = path.read_text(encoding="utf-8") if path.exists() else HEAD
    files = {str(name) for name in given}
    line = " ".join(["twin", *(_word(folder, word, files) for word in words)])
    write_atomically(path, f"{before}{line}{'' if ends_well else OTHERWISE}\n".encode())


def commands(folder: Folder) -> list[str]:
    """The commands of the history, as they were typed."""
    path = folder.root / HISTORY
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    typed = (line.removesuffix(OTHERWISE) for line in lines if line.startswith("twin "))
    return [line.replace(f"{FROM}/", "") for line in typed]


def _word(folder: Folder, word: str, files: set[str]) -> str:
    """A word as the shell takes it from any folder."""
    if word not in files:
        return shlex.quote(word)
    root = folder.root.resolve()
    full = Path(os.path.abspath(root / word))
    if full.is_relative_to(root):
        return f"{FROM}/{shlex.quote(full.relative_to(root).as_posix())}"
    return shlex.quote(str(full))
