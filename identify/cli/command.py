"""What every command does around its work: nothing that it reads is overwritten, one way to print.

Whether it can write is known before the work.

Progress: what a command is doing and how long that still takes, on standard error.

On a terminal it is a bar; elsewhere lines, the first after some seconds, so that a short command
says nothing. How many steps a search takes nobody knows before, so the time is that of the part
under way, never of the whole.
"""

from __future__ import annotations

import inspect
import json
import os
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from functools import wraps
from itertools import combinations, product
from pathlib import Path
from threading import Event, Thread
from time import monotonic
from typing import TYPE_CHECKING, Annotated, Any, TextIO

import typer
from typer.core import TyperCommand

from identify.cli.in_project import abandoned, filled, working
from twin.errors import InputError, Unwritten
from twin.files import is_same_file, require_writable
from twin.parallel import AHEAD, Progress, silent

if TYPE_CHECKING:
    from rich.table import Table

    from identify.output.answers import Answer

FOLDER = "folder"
# What is written.
OUTPUTS = (FOLDER, "out", "html", "better", "mcap", "plot", "setpoints", "video", "rerun")
UPDATED = {"fit": "model", "add": "model"}  # what a command may write over: it holds all of it
AS_JSON = inspect.Parameter(
    "as_json",
    inspect.Parameter.KEYWORD_ONLY,
    default=False,
    annotation=Annotated[
        bool, typer.Option("--json", help="Print one JSON object and nothing else.")
    ],
)


@dataclass(frozen=True)
class Reply:
    """What a command says: text or, with --json, the answer; warnings on standard error.

    fine: whether the exit code is 0, else 1. unwritten: errors of files that could not be written
    after all was computed; they come behind the text, with exit code 2.
    """

    text: str
    answer: Answer
    warnings: Sequence[str] = ()
    fine: bool = True
    unwritten: Sequence[str] = ()


def tried(*writes: Callable[[], object]) -> tuple[str, ...]:
    """What of some files could not be written, an error each: an answer is told all the same."""
    errors = []
    for write in writes:
        try:
            write()
        except Unwritten as error:
            errors.append(str(error))
    return tuple(errors)


class Commands(typer.Typer):
    """The commands: each may print JSON, and none overwrites what it reads.

    In the list of commands each has the first sentence of its help, whole.
    """

    def command(self, name: str | None = None, **options: Any) -> Any:
        def register(job: Callable[..., Reply]) -> Callable[..., Reply]:
            own = inspect.signature(job, eval_str=True)

            @wraps(job)
            def run(as_json: bool, **given: Any) -> int:
                with working() as project:
                    said = job(**given)
                    if project is not None:
                        project.keep(given, said.answer.entries(), said.fine)
                for warning in said.warnings:
                    print(f"twin: {warning}", file=sys.stderr)
                print(json.dumps(said.answer.entries()) if as_json else said.text)
                for error in said.unwritten:
                    print(f"twin: {error}", file=sys.stderr)
                return 2 if said.unwritten else 0 if said.fine else 1

            parameters = [*own.parameters.values(), AS_JSON]
            run.__signature__ = own.replace(parameters=parameters)  # type: ignore[attr-defined]
            run.__annotations__[AS_JSON.name] = AS_JSON.annotation
            first = (job.__doc__ or "").split("\n\n")[0]
            known: dict[str, Any] = {"short_help": " ".join(first.split()), **options}
            super(Commands, self).command(name, cls=Command, **known)(run)
            return job

        return register


class Command(TyperCommand):
    """A command that overwrites no file that it reads, and no output with another.

    Options that may be repeated take all that follows them up to the next option: of two logs
    behind ``--holdout`` the second would else be fitted on, without a word.
    """

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        repeated = {o for p in self.params if getattr(p, "multiple", False) for o in p.opts}
        spread: list[str] = []
        option, count = "", 0
        for arg in args:
            if arg.startswith("-"):
                option, count = arg if arg in repeated else "", 0
            elif option and (count := count + 1) > 1:
                spread.append(option)
            spread.append(arg)
        try:
            return super().parse_args(ctx, filled(self, ctx, spread))
        except BaseException:
            abandoned()
            raise

    def invoke(self, ctx: Any) -> Any:
        try:
            self._require_apart(ctx)
            return super().invoke(ctx)
        finally:
            abandoned()

    def _require_apart(self, ctx: Any) -> None:
        outputs, inputs = {}, {}
        for param in self.params:
            given = ctx.params.get(param.name)
            if param.name in OUTPUTS and given is not None:
                outputs[min(param.opts, key=len)] = param.name, Path(given)
            elif param.name != UPDATED.get(self.name or ""):
                inputs[_called(param)] = given
        require_apart({option: path for option, (_, path) in outputs.items()}, inputs)
        for name, path in outputs.values():
            if name == "html" and path.suffix.lower() not in (".html", ".htm"):
                raise InputError(f"{path}: a report is an .html file; give such a name")
            if name == "rerun" and path.suffix.lower() != ".rrd":
                raise InputError(f"{path}: Rerun opens an .rrd file; give such a name")
            if name != FOLDER:
                require_writable(path)


def require_apart(outputs: Mapping[str, Path], inputs: Mapping[str, Any]) -> None:
    """Raise InputError where an output is an input or another output.

    outputs, inputs: by what they are called in the command; inputs of any kind, whose files are
    looked at.
    """
    for (one, first), (other, second) in combinations(outputs.items(), 2):
        if is_same_file(first, second):
            raise InputError(f"{one} {first} and {other} {second} are one file; give two names")
    for (option, path), (name, given) in product(outputs.items(), inputs.items()):
        for read in _files(given):
            if is_same_file(path, read):
                raise InputError(
                    f"{option} {path}: is the file that is read as {name}; give another name"
                )


def _called(param: Any) -> str:
    """What the help calls a parameter: LOG, --holdout."""
    name: str = max(param.opts, key=len)
    return name if name.startswith("-") else str(param.metavar or name).strip("[].").upper()


def _files(given: Any) -> Iterator[Path]:
    """The files that a value of a parameter may name."""
    if isinstance(given, list | tuple):
        for one in given:
            yield from _files(one)
    elif isinstance(given, Path):
        yield given
    elif isinstance(given, str):
        from twin.model.file import model_files

        yield from model_files(given)


# --- what it is doing -----------------------------------------------------------------------------

FIRST, EVERY = 5.0, 10.0  # s until the first line, and from one to the next
OFTEN = "TWIN_PROGRESS"  # variable with the s of both, for a program that reads the lines


@dataclass(frozen=True)
class Progressed:
    """Part of a command's work. first: how much of it was done when it began, at ``begun`` (s).

    since: when as much as ``done`` was done, s.
    """

    what: str
    done: int
    total: int
    first: int
    begun: float
    since: float

    def left(self, now: float) -> float | None:
        """s until it ends, where the rest goes as fast as what was done; None where that is none.

        It only falls until more is done; None too where that takes longer than all of the rest.
        """
        if self.done <= self.first or self.done >= self.total:
            return None
        each = (self.since - self.begun) / (self.done - self.first)
        left = each * (self.total - self.done) - (now - self.since)
        return left if left > 0.0 else None

    def words(self, now: float) -> str:
        """What is done, how much of it, and how long that still takes."""
        words, left = self.what, self.left(now)
        if self.total > 1000:  # above it a part is told as a percentage
            words += f": {100 * self.done // self.total} %"
        elif self.total > 1:
            words += f": {self.done} of {self.total}"
        return words if left is None else f"{words}, about {roughly(left)} left of this part"


def roughly(seconds: float) -> str:
    """A time as roughly as it is known."""
    if seconds < 100.0:
        return f"{max(round(seconds), 1)} s"
    minutes = round(seconds / 60.0)
    return f"{minutes} min" if minutes < 100 else f"{minutes / 60.0:.1f} h"


class ProgressDisplay:
    """Where a command is: called as a `Progress`, from any thread.

    Who is ahead is shown beside the work that it is of, as several axes may be asked at a time.
    """

    def __init__(self) -> None:
        self.begun = monotonic()
        self.part = Progressed("starting", 0, 0, 0, self.begun, self.begun)
        self.ahead, self.of = "", ""

    def __call__(self, what: str, done: int, total: int) -> None:
        if total == 0:
            if AHEAD in what:
                self.ahead, self.of = f"; {what[what.rfind(AHEAD) :]}", _whose(what)
            return
        same = what == self.part.what and total == self.part.total and done > self.part.done
        now = monotonic()
        self.part = (
            replace(self.part, done=done, since=now)
            if same
            else Progressed(what, done, total, done, now, now)
        )

    def __str__(self) -> str:
        now = monotonic()
        ahead = self.ahead if self.of == _whose(self.part.what) else ""
        return f"{self.part.words(now)}{ahead} ({roughly(now - self.begun)} so far)"


def _whose(what: str) -> str:
    """The part of the work that a line of it is of, e.g. the diagnosis of an axis."""
    return what.partition(", ")[0]


@contextmanager
def progress_on_stderr(first: float = FIRST, every: float = EVERY) -> Iterator[Progress]:
    """Progress on standard error: a bar on a terminal, else lines; first, every: s between them."""
    if asked := os.environ.get(OFTEN):
        with suppress(ValueError):
            first = every = max(float(asked), 0.1)
    if sys.stderr is None:  # closed by who started the command
        yield silent
        return
    shown = ProgressDisplay()
    try:
        with _bar(shown) if sys.stderr.isatty() else _lines(shown, sys.stderr, first, every):
            yield shown
    except SystemExit:  # by a signal: what is known by then was worth the wait
        if shown.ahead:
            print(f"twin: stopped{shown.ahead}; nothing of it is proved yet", file=sys.stderr)
        raise


@contextmanager
def _lines(shown: ProgressDisplay, stream: TextIO, first: float, every: float) -> Iterator[None]:
    """Lines from a thread of their own: they come too while a long piece of work says nothing."""
    ended = Event()

    def tell() -> None:
        wait = first
        with suppress(OSError, ValueError):  # nobody reads them any more
            while not ended.wait(wait):
                stream.write(f"twin: {shown}\n")
                stream.flush()
                wait = every

    teller = Thread(target=tell, name="progress", daemon=True)
    teller.start()
    try:
        yield
    finally:
        ended.set()
        teller.join()


@contextmanager
def _bar(shown: ProgressDisplay) -> Iterator[None]:
    from rich.console import Console
    from rich.live import Live
    from rich.progress_bar import ProgressBar
    from rich.table import Table

    def drawn() -> Table:
        part, row = shown.part, Table.grid(padding=(0, 1))
        counted = part.total > 1  # what is not only shows that it goes on
        width = 30  # of the bar, characters
        bar = ProgressBar(part.total if counted else None, part.done, width, pulse=not counted)
        row.add_row(bar, str(shown))
        return row

    with Live(get_renderable=drawn, console=Console(stderr=True), transient=True):
        yield
