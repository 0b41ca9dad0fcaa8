"""Options that the commands share, and the logs and models that they read."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Generic, TypeVar

import typer
from typer import Argument, Option

from identify.cli.command import Commands, Reply, progress_on_stderr
from identify.output.machine import briefly
from twin.errors import InputError
from twin.telling import heard

if TYPE_CHECKING:
    from identify.output.words.next_step import Source
    from twin.effects import Catalogue
    from twin.logs import Log
    from twin.model.machine import MachineModel

Result = TypeVar("Result")
MEASURED = (
    "position", "velocity", "setpoint_position", "current", "force", "pressure", "pressure_2",
    "temperature",
)  # fmt: skip

app = Commands(
    help="Find out why the model and the machine disagree.",
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)


def written(what: str) -> Any:
    """The option -o of a command, with its help."""
    return Option("--out", "-o", help=what)


def was_kept(path: Path, kept: Path) -> str:
    """That a file which was written over is kept under another name."""
    return f"{path}: what was there is kept as {kept}"


Logs = Annotated[list[Path], Argument(metavar="LOG...", help="MCAP logs.")]
FitLogs = Annotated[list[Path], Argument(metavar="LOG...", help="MCAP logs to fit on.")]
Model = Annotated[str, Argument(metavar="MODEL", help="Machine model (.toml).")]
ModelOption = Annotated[str, Option("--model", help="Machine model (.toml).")]
Holdout = Annotated[
    list[Path] | None,
    Option(
        help="Selection logs (MCAP), one or several: no parameter is fitted on them, but they take "
        "part in the choice of effects.",
    ),
]
Test = Annotated[
    list[Path] | None,
    Option(
        help="Test logs (MCAP), one or several, on which nothing is decided: they give the error "
        "that is reported.",
    ),
]
Scheduler = Annotated[
    str | None,
    Option(
        metavar="ADDRESS",
        help="Dask scheduler whose workers do it, as tcp://host:8786; this computer if left out.",
    ),
]
TestFunction = Annotated[
    float | None,
    Option(
        metavar="SECONDS",
        help="Length of the test functions, the time scale of the residual; from the noise if "
        "left out.",
    ),
]
Report = Annotated[Path | None, written("HTML report.")]
Effects = Annotated[
    list[Path] | None,
    Option(
        "--effects", help="Your own effect files, one or several; loading them runs their code."
    ),
]


def _version(asked: bool) -> None:
    if asked:
        from twin.logs.writer import software_version

        print(software_version())
        raise typer.Exit


@app.callback()
def front_door(
    version: Annotated[
        bool, Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Find out why the model and the machine disagree."""


def loaded(model: str, effects: list[Path] | None) -> tuple[MachineModel, Catalogue]:
    """A model, and the catalogue with a user's own effects."""
    from twin.effects import load_catalogue
    from twin.model.file import load_model

    catalogue = load_catalogue(effects or ())
    return load_model(model, catalogue), catalogue


class Recordings(Mapping[str, "Log"]):
    """Logs by name, read each time that one is asked for, less what identification does not read.

    So nobody holds a log for a command that is done with it: datasets() takes each once. among: all
    logs that are held in memory at once; where these are too long, they are read at a lower rate,
    which is said on standard error.
    """

    def __init__(self, paths: Sequence[Path], among: Sequence[Path] = ()) -> None:
        from twin.checks.long import step_of

        self.paths = {str(path): path for path in paths}
        self.every = step_of(among or paths) if paths else 1

    def __getitem__(self, name: str) -> Log:
        from twin.checks.long import is_thinned

        path = self.paths[name]
        log = self.read(path)
        if self.every > 1 and is_thinned(log, path):
            print(
                f"twin: {path}: is read at {log.sample_rate:g} Hz, because all logs together are "
                "too long to be held in memory; cut them to be fitted at their own rate",
                file=sys.stderr,
            )
        return log

    def read(self, path: Path) -> Log:
        """The log of a file."""
        from twin.checks.long import read_measured

        return read_measured(path, MEASURED, self.every)

    def __iter__(self) -> Iterator[str]:
        return iter(self.paths)

    def __len__(self) -> int:
        return len(self.paths)


class CheckedRecordings(Recordings):
    """The same, checked as they are read.

    findings: of the check on the whole logs, one sentence each, there when the logs have been read.
    refused: names of the faults with which a log is refused by an InputError.
    """

    def __init__(
        self, paths: Sequence[Path], among: Sequence[Path] = (), refused: Collection[str] = ()
    ) -> None:
        super().__init__(paths, among)
        self.refused, self.findings = refused, list[str]()

    def read(self, path: Path) -> Log:
        from twin.checks.long import read_checked

        log, report = read_checked(path, MEASURED, self.every)
        for finding in report.findings:
            if finding.fault.name in self.refused and finding.severity.value == "error":
                raise InputError(f"{path}: {finding}; nothing is fitted to it")
            self.findings.append(f"{path}: {finding.severity.value}: {finding}")
        return log

    @contextmanager
    def explaining(self) -> Iterator[None]:
        """What goes wrong with the logs meanwhile is told with what the check knows of them."""
        from numpy.linalg import LinAlgError  # as of numbers that nothing can be computed with

        try:
            yield
        except (InputError, LinAlgError) as error:
            known = next((f for f in self.findings if ": error: " in f), None)
            if known is None:
                raise
            raise InputError(f"{known}; as it is, {error}") from error


def meaningless(joints: Collection[str]) -> frozenset[str]:
    """Names of the faults with which what is fitted has no meaning; joints: axes that are some.

    Of a joint, which the others move, no mass of its own tells a sign: `twin new --mjcf` does.
    """
    always = {"UNIT", "SWAPPED", "WRAPPED"}
    return frozenset(always if joints else always | {"SIGN", "PARTIAL"})


@dataclass(frozen=True)
class Done(Generic[Result]):
    """What a job on logs gave. findings: on its first logs; left_out: those that say nothing."""

    result: Result
    findings: list[str]
    left_out: list[str]

    @property
    def warnings(self) -> list[str]:
        """What is said of the logs on standard error."""
        return [*briefly(self.findings), *self.left_out]


def with_logs(
    job: Callable[..., Result],
    model: MachineModel,
    logs: list[Path] | None,
    *others: list[Path] | None,
    fits: bool = False,
) -> Done[Result]:
    """The result of a job on a model and logs, those of each other role in turn.

    fits: to the first logs, which are refused with a fault that gives numbers without a meaning.
    """
    from twin.threads import share_one_arena

    share_one_arena()
    every = [path for paths in (logs, *others) for path in paths or ()]
    recorded = CheckedRecordings(logs or (), every, meaningless(model.joints) if fits else ())
    rest = (Recordings(paths or (), every) for paths in others)
    with progress_on_stderr() as progress, heard() as silent, recorded.explaining():
        result = job(model, recorded, *rest, progress=progress)
    return Done(result, recorded.findings, list(dict.fromkeys(silent)))  # of all axes alike


LONG = 600_000  # samples of all axes and logs, with which a diagnosis takes more than some seconds


def tell_first_look(model: MachineModel, logs: Sequence[Path], catalogue: Catalogue) -> None:
    """Say on standard error what the first log begins with, where all of them take long.

    What is wrong with it is told with the result.
    """
    from identify.output.words.first_look import first_look_in_words
    from identify.selection.first_look import first_look
    from twin.logs.decode import samples_by_axis

    with suppress(InputError), heard():
        if sum(sum(samples_by_axis(path).values()) for path in logs) < LONG:
            return
        if found := first_look(model, logs[0], catalogue=catalogue):
            typer.echo(f"twin: {first_look_in_words(str(logs[0]), found)}", err=True)


def source_of(model: str, test_function: float | None, effects: list[Path] | None) -> Source:
    """The command as typed, and what the next one takes over of it."""
    from identify.output.words.next_step import Source

    length = [] if test_function is None else ["--test-function", f"{test_function:g}"]
    own = [text for file in effects or () for text in ("--effects", str(file))]
    return Source(shlex.join(["twin", *sys.argv[1:]]), model, options=(*length, *own))


def said_of(result: Any, warnings: Sequence[str] = (), fine: bool = True, **more: Any) -> Reply:
    """What a command says of a result; more: entries of its JSON object that the command knows."""
    from identify.output.as_json import answer_of

    return Reply(str(result), answer_of(result, **more), warnings, fine)
