"""Options, input and output that the commands share."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import typer

from identify.cli.apart import Command
from identify.cli.progress import progress_on_stderr
from twin.errors import InputError

if TYPE_CHECKING:
    from twin.checks import CheckReport
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


Json = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]
Effects = Annotated[
    list[Path] | None,
    typer.Option(
        "--effects",
        help="Your own effect file; loading it runs its code. May be repeated.",
    ),
]


def say(text: str, result: dict[str, Any], as_json: bool, warnings: Sequence[str] = ()) -> None:
    """Print the warnings on standard error, and the result as text or as one JSON object."""
    from identify.output.machine import plain

    for warning in warnings:
        print(f"twin: {warning}", file=sys.stderr)
    print(json.dumps(plain(result)) if as_json else text)


@contextmanager
def left_out() -> Iterator[list[str]]:
    """The lines that are said meanwhile of logs that say nothing, instead of on standard error."""
    import logging

    lines: list[str] = []
    handler = logging.Handler()
    handler.emit = lambda record: lines.append(record.getMessage())  # type: ignore[method-assign]
    logger = logging.getLogger("identify")
    logger.addHandler(handler)
    try:
        yield lines
    finally:
        logger.removeHandler(handler)


def catalogue_with(files: list[Path] | None) -> Catalogue:
    from twin.effects import load_catalogue

    return load_catalogue(files or ())


def machine_model(name: str, catalogue: Catalogue) -> MachineModel:
    from twin.model.file import load_model

    return load_model(name, catalogue)


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
    recorded, findings = read_checked(logs, beside=[*held, *tests], refused=refused)
    others = read_measured(held, beside=[*logs, *tests]), read_measured(tests, [*logs, *held])
    with progress_on_stderr() as progress, left_out() as silent:
        result = job(model, recorded, *others, progress=progress)
    return result, findings, silent


class Recordings(Mapping[str, "Log"]):
    """Logs by name, read from their files each time that one is asked for.

    So nobody holds a log for a command that is done with it: datasets() takes each once.
    """

    def __init__(self, paths: Sequence[Path], read: Callable[[Path], Log]) -> None:
        self._paths = {str(path): path for path in paths}
        self._read = read

    def __getitem__(self, name: str) -> Log:
        return self._read(self._paths[name])

    def __iter__(self) -> Iterator[str]:
        return iter(self._paths)

    def __len__(self) -> int:
        return len(self._paths)


def read_measured(
    paths: Sequence[Path] | None, beside: Sequence[Path] | None = None
) -> Mapping[str, Log]:
    """The logs by name, less what identification does not read: most of their memory.

    beside: other logs that are held in memory as well. Where all are too long, they are read at a
    lower rate.
    """
    from twin.checks.long import read_measured as read
    from twin.checks.long import step_of

    every = step_of([*(paths or ()), *(beside or ())]) if paths else 1
    return Recordings(paths or (), lambda path: said(path, read(path, MEASURED, every), every))


def read_checked(
    paths: Sequence[Path] | None,
    beside: Sequence[Path] | None = None,
    refused: Collection[str] = (),
) -> tuple[Mapping[str, Log], list[str]]:
    """The same, and the findings of the log check on the whole logs, one sentence each.

    They are there when the logs have been read. Raises InputError then for an error of a kind that
    is refused.
    """
    from twin.checks.long import read_checked as read
    from twin.checks.long import step_of

    every = step_of([*(paths or ()), *(beside or ())]) if paths else 1
    findings: list[str] = []

    def checked(path: Path) -> Log:
        log, report = read(path, MEASURED, every)
        for finding in report.findings:
            if finding.fault.name in refused and finding.severity.value == "error":
                raise InputError(f"{path}: {finding}; nothing is fitted to it")
        findings.extend(sentences(str(path), report))
        return said(path, log, every)

    return Recordings(paths or (), checked), findings


def said(path: Path, log: Log, every: int) -> Log:
    """The log; that it was read at a lower rate is said on standard error."""
    if every > 1:
        print(
            f"twin: {path}: is read at {log.sample_rate:g} Hz, because all logs together are too "
            "long to be held in memory; cut them to be fitted at their own rate",
            file=sys.stderr,
        )
    return log


def sentences(name: str, report: CheckReport) -> list[str]:
    """The findings of the log check, one sentence each."""
    return [f"{name}: {finding.severity.value}: {finding}" for finding in report.findings]


def unconfirmed(findings: Sequence[str]) -> list[str]:
    """Of the findings those that tell what an import map assumes."""
    return [line for line in findings if "the import map assumes" in line]


def require_report(path: Path) -> None:
    """Raise InputError where a report could not be written, or its name is that of another kind."""
    if path.suffix.lower() not in (".html", ".htm"):
        raise InputError(f"{path}: a report is an .html file; give such a name")
    require_folder(path)


def require_folder(path: Path) -> None:
    """Raise InputError now, instead of after the work, where the file could not be written."""
    from twin.files import require_writable

    require_writable(path)
