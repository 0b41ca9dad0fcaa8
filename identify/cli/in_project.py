"""A command inside a project: filled from it before it runs, kept in it after."""

from __future__ import annotations

import os
import shlex
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from identify.project.filling import Filling
    from identify.project.folder import Folder

_RUN: ContextVar[ProjectCommand | None] = ContextVar("run", default=None)
# What a user gives of files that no command of the project made.
GIVEN_FILES = ("sources", "mapping", "mjcf", "effects")


@dataclass(frozen=True)
class ProjectCommand:
    """A command that belongs to a project. words: as typed; full: as it is typed outside one.

    held: the project, which no other command writes into until it is closed.
    """

    folder: Folder
    command: str
    words: tuple[str, ...]
    full: tuple[str, ...]
    held: ExitStack

    def keep(self, given: Mapping[str, Any], answer: Mapping[str, Any], fine: bool) -> None:
        """Add what was made to the project and the command to its history."""
        from identify.project.history import note
        from identify.project.keeping import KEPT, keep

        if not fine and (self.command == "import" or self.command not in KEPT):
            return  # nothing was made
        typed = shlex.join(["twin", *self.full])
        keep(self.folder, self.command, given, answer, typed)
        files = [given.get(name) for name in GIVEN_FILES]
        every = (one for f in files for one in (f if isinstance(f, list) else [f]) if one)
        words = [w for w in self.words if w != "--json"]
        note(self.folder, words, every, ends_well=fine)


def filled(command: Any, ctx: Any, args: Sequence[str]) -> list[str]:
    """The words of a command with what the project of this folder has for those left out."""
    if not Path("project.toml").is_file() or {"--help", *_ALONE} & set(args):
        return [*args]
    from identify.project.filling import FILLINGS
    from identify.project.folder import project_here

    folder, filling = project_here(), FILLINGS.get(command.name)
    if folder is None or filling is None:
        return [*args]
    try:
        given, rest, _ = command.make_parser(ctx).parse_args([*args])
    except Exception:  # a mistake, which is told of the words as they were typed
        return [*args]
    given = {k: v for k, v in given.items() if v not in (None, (), []) and not _unset(v)}
    if rest:
        return [*args]
    held, words = ExitStack(), (command.name, *args)
    held.enter_context(folder.working(shlex.join(["twin", *words]), _say_waiting))
    with held:  # let go where anything goes wrong
        added = filling.of(folder, given)
        if added is None:
            return [*args]
        full = _with(command, args, given, filling, added)
        _RUN.set(ProjectCommand(folder, command.name, words, (command.name, *full), held.pop_all()))
        return full


def _with(
    command: Any, args: Sequence[str], given: Mapping[str, Any], filling: Filling,
    added: Mapping[str, Sequence[str]],
) -> list[str]:  # fmt: skip
    """The words of a command with what is added: positional ones behind those that were typed."""
    options: dict[str, str] = {p.name: max(p.opts, key=len) for p in command.params}
    positional = [v for name in filling.inputs for v in added.get(name, [])]
    named = [w for n in filling.options for v in added.get(n, []) for w in (options[n], v)]
    typed = [v for n, v in given.items() if not options[n].startswith("-")]
    count = sum(len(v) if isinstance(v, list | tuple) else 1 for v in typed)
    place = next((i for i, word in enumerate(args) if word.startswith("-")), len(args))
    place = place if place == count else len(args)
    return [*args[:place], *positional, *args[place:], *named]


# Options with which a command asks, or only tells.
_ALONE = ("--guess", "--version")


def _unset(value: object) -> bool:
    """Whether a parser says of a parameter that it was not given."""
    return type(value).__name__ in ("Sentinel", "UNSET")


@contextmanager
def working() -> Iterator[ProjectCommand | None]:
    """The project of the command that runs, let go at its end; None where there is none."""
    run = _RUN.get()
    if run is None:
        yield None
        return
    _RUN.set(None)
    sys.argv[1:] = run.full  # what a page says that it was made by
    with run.held:
        yield run


def abandoned() -> None:
    """Let go of the project of a command that does not run."""
    if run := _RUN.get():
        _RUN.set(None)
        run.held.close()


def _say_waiting(holder: str) -> None:
    print(f"twin: waits for the end of `{holder}`, which runs in this project "
          f"(this is process {os.getpid()})", file=sys.stderr, flush=True)  # fmt: skip
