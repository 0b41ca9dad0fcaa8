"""Options, input and output that the commands share."""

from __future__ import annotations

import json
import logging
import sys
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import typer

from identify.cli.apart import Command
from identify.cli.progress import progress_on_stderr
from twin.errors import InputError
from twin.files import require_writable

if TYPE_CHECKING:
    from identify.output.answers.answer import Answer
    from twin.effects import Catalogue
    from twin.logs import Log
    from twin.model.machine import MachineModel

Result = TypeVar("Result")
MEANINGLESS = ("SIGN", "UNIT", "SWAPPED")  # faults with which a fit gives numbers without a meaning
MEASURED = ("position", "velocity", "setpoint_position", "current", "force")


class Commands(typer.Typer):
    """The commands, none of which overwrites what it reads.

    In the list of commands each has the first sentence of its help, whole.
    """

    def command(self, name: str | None = None, **options: Any) -> Any:
        def register(job: Callable[..., None]) -> Callable[..., None]:
            first = (job.__doc__ or "").split("\n\n")[0]
            given = {"short_help": " ".join(first.split()), **options}
            return super(Commands, self).command(name, cls=Command, **given)(job)

        return register


app = Commands(
    help="Find out why the model and the machine disagree.",
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)

Logs = Annotated[list[Path], typer.Argument(metavar="LOG...", help="MCAP logs.")]
FitLogs = Annotated[list[Path], typer.Argument(metavar="LOG...", help="MCAP logs to fit on.")]
Model = Annotated[str, typer.Argument(metavar="MODEL", help="Machine model (.toml).")]
ModelOption = Annotated[str, typer.Option("--model", help="Machine model (.toml).")]
Holdout = Annotated[
    list[Path] | None,
    typer.Option(
        "--holdout",
        help="Selection log (MCAP): no parameter is fitted on it, but it takes part in the choice "
        "of effects; may be repeated.",
    ),
]
Test = Annotated[
    list[Path] | None,
    typer.Option(
        "--test",
        help="Test log (MCAP), on which nothing is decided: it gives the error that is reported; "
        "may be repeated.",
    ),
]
TestFunction = Annotated[
    float | None,
    typer.Option(
        "--test-function",
        metavar="SECONDS",
        help="Length of the test functions, the time scale of the residual; from the noise if "
        "left out.",
    ),
]
Report = Annotated[Path | None, typer.Option("--out", "-o", help="HTML report.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]
Effects = Annotated[
    list[Path] | None,
    typer.Option(
        "--effects",
        help="Your own effect file; loading it runs its code. May be repeated.",
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
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Find out why the model and the machine disagree."""


# --- what is read ----------------------------------------------------------------------------


def catalogue_with(files: list[Path] | None) -> Catalogue:
    from twin.effects import load_catalogue

    return load_catalogue(files or ())


def machine_model(name: str, catalogue: Catalogue) -> MachineModel:
    from twin.model.file import load_model

    return load_model(name, catalogue)


class Recordings(Mapping[str, "Log"]):
    """Logs by name, read each time that one is asked for, less what identification does not read.

    So nobody holds a log for a command that is done with it: datasets() takes each once. beside:
    other logs that are held in memory as well; where all are too long, they are read at a lower
    rate, which is said on standard error.
    """

    def __init__(self, paths: Sequence[Path] | None, beside: Sequence[Path] | None = None) -> None:
        from twin.checks.long import step_of

        self.paths = {str(path): path for path in paths or ()}
        self.every = step_of([*self.paths.values(), *(beside or ())]) if paths else 1

    def __getitem__(self, name: str) -> Log:
        path = self.paths[name]
        log = self.read(path)
        if self.every > 1:
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
        self,
        paths: Sequence[Path] | None,
        beside: Sequence[Path] | None = None,
        refused: Collection[str] = (),
    ) -> None:
        super().__init__(paths, beside)
        self.refused, self.findings = refused, list[str]()

    def read(self, path: Path) -> Log:
        from twin.checks.long import read_checked

        log, report = read_checked(path, MEASURED, self.every)
        for finding in report.findings:
            if finding.fault.name in self.refused and finding.severity.value == "error":
                raise InputError(f"{path}: {finding}; nothing is fitted to it")
            self.findings.append(f"{path}: {finding.severity.value}: {finding}")
        return log


def with_roles(
    job: Callable[..., Result],
    model: MachineModel,
    logs: list[Path],
    holdout: list[Path] | None,
    test: list[Path] | None,
    refused: Collection[str] = (),
) -> tuple[Result, list[str], list[str]]:
    """The result of a job on a model and the logs of each role; the findings on the first.

    And which logs of any role were left out, and why. refused: names of the faults with which a
    training log is refused.
    """
    from twin.memory import share

    share()
    held, tests = holdout or [], test or []
    recorded = CheckedRecordings(logs, [*held, *tests], refused)
    others = Recordings(held, [*logs, *tests]), Recordings(tests, [*logs, *held])
    with progress_on_stderr() as progress, left_out() as silent:
        result = job(model, recorded, *others, progress=progress)
    return result, recorded.findings, silent


@contextmanager
def left_out() -> Iterator[list[str]]:
    """The lines that are said meanwhile of logs that say nothing, instead of on standard error."""
    lines: list[str] = []
    handler = logging.Handler()
    handler.emit = lambda record: lines.append(record.getMessage())  # type: ignore[method-assign]
    logger = logging.getLogger("identify")
    logger.addHandler(handler)
    try:
        yield lines
    finally:
        logger.removeHandler(handler)


# --- what is written -------------------------------------------------------------------------


def say(text: str, answer: Answer, as_json: bool, warnings: Sequence[str] = ()) -> None:
    """Print the warnings on standard error, and the answer as text or as one JSON object."""
    for warning in warnings:
        print(f"twin: {warning}", file=sys.stderr)
    print(json.dumps(answer.entries()) if as_json else text)


def tell(result: Any, as_json: bool, warnings: Sequence[str] = (), **more: Any) -> None:
    """Print a result of the workflow; more: entries of its JSON object that the command knows."""
    from identify.output.as_json import answer_of
    from identify.output.text import text_of

    say(text_of(result), answer_of(result, **more), as_json, warnings)


def require_report(path: Path | None) -> None:
    """Raise InputError where a report could not be written, or its name is that of another kind."""
    if path is not None:
        if path.suffix.lower() not in (".html", ".htm"):
            raise InputError(f"{path}: a report is an .html file; give such a name")
        require_writable(path)
