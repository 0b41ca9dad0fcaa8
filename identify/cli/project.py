"""Commands of a project: `twin project`, `twin log`, `twin undo`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Option

from identify.cli.command import Commands, Reply
from identify.cli.shared import app
from twin.errors import InputError

if TYPE_CHECKING:
    from identify.project.entries import Project, RoleName
    from identify.project.folder import Folder

ABOUT = "A folder that holds recordings, models and answers."
projects = Commands(help=f"{ABOUT}\n\nExample: twin project init servo", rich_markup_mode=None)
app.add_typer(projects, name="project", short_help=ABOUT)


@projects.command()
def init(
    folder: Annotated[Path, Argument(metavar="[FOLDER]", help="The project's folder.")] = Path(),
) -> Reply:
    """Make a folder a project; commands in it need no arguments.

    Example: twin project init
    """
    from identify.project.folder import Folder
    from identify.project.history import note

    made = Folder(folder)
    made.begin()
    note(made, ["project", "init"])
    return _said(made, made.read())


@projects.command()
def role(
    logs: Annotated[list[Path], Argument(metavar="LOG...", help="Recordings of the project.")],
    to: Annotated[str, Option("--to", help="training, selection or test.")],
) -> Reply:
    """Say what recordings are for: to fit, to choose effects, or to test.

    Example: twin project role logs/run3.mcap --to test
    """
    from identify.project.history import note

    wanted, names = _role(to), [str(log) for log in logs]
    here = _here()

    def change(project: Project) -> Project:
        files = [r.file for r in project.recordings]
        if missing := [name for name in names if name not in files]:
            raise InputError(
                f"{missing[0]}: is no recording of this project; "
                f"there are {', '.join(files) or 'none yet'}"
            )
        changed = [
            r.model_copy(update={"role": wanted}) if r.file in names else r
            for r in project.recordings
        ]
        return project.model_copy(update={"recordings": changed})

    made = here.change(change)
    note(here, ["project", "role", *names, "--to", wanted])
    return _said(here, made)


@projects.command()
def take(
    logs: Annotated[list[Path], Argument(metavar="LOG...", help="MCAP logs, in their place.")],
    to: Annotated[
        str | None, Option("--to", help="training, selection or test; proposed if left out.")
    ] = None,
) -> Reply:
    """Take MCAP logs into the project where they lie.

    Example: twin project take run1.mcap run2.mcap
    """
    from identify.project.entries import RecordingEntry
    from identify.project.history import note
    from twin.checks.long import log_info

    wanted = None if to is None else _role(to)
    here = _here()
    for log in logs:
        log_info(log)  # raises where it is no log

    def change(project: Project) -> Project:
        for log in logs:
            known = next((r for r in project.recordings if r.file == str(log)), None)
            if known is not None and wanted is None:
                continue  # it keeps its role
            entry = RecordingEntry(file=str(log), role=wanted or project.next_role())
            others = [r for r in project.recordings if r is not known]
            project = project.model_copy(update={"recordings": [*others, entry]})
        return project

    made = here.change(change)
    words = ["project", "take", *map(str, logs), *(["--to", to] if to else [])]
    note(here, words, logs)
    return _said(here, made)


@projects.command()
def leave(
    logs: Annotated[list[Path], Argument(metavar="LOG...", help="Recordings of the project.")],
) -> Reply:
    """Leave recordings out of the project; no file is removed.

    Example: twin project leave logs/run3.mcap
    """
    from identify.project.history import note

    here, names = _here(), {str(log) for log in logs}

    def change(project: Project) -> Project:
        kept = [r for r in project.recordings if r.file not in names]
        if len(kept) + len(names) != len(project.recordings):
            raise InputError(f"{', '.join(sorted(names))}: not all are recordings of this project")
        return project.model_copy(update={"recordings": kept})

    made = here.change(change)
    note(here, ["project", "leave", *map(str, logs)])
    return _said(here, made)


@app.command()
def log() -> Reply:
    """Tell what is in the project of this folder: its models in order, with their errors.

    Example: twin log
    """
    here = _here()
    return _said(here, here.read())


@app.command()
def undo() -> Reply:
    """Take the last change of the project back; no file is removed.

    Example: twin undo
    """
    from identify.project.history import note

    here = _here()
    made = here.undo()
    note(here, ["undo"])
    return _said(here, made)


def _here() -> Folder:
    from identify.project.folder import project_here

    found = project_here()
    if found is None:
        raise InputError(
            f"{Path().resolve()}: is no project; `twin project init` makes one of this folder"
        )
    return found


def _role(name: str) -> RoleName:
    from identify.project.entries import ROLES

    for role in ROLES:
        if role == name:
            return role
    raise InputError(f"--to {name}: give {', '.join(ROLES[:-1])} or {ROLES[-1]}")


def _said(here: Folder, project: Project) -> Reply:
    from identify.output.answers.project import ProjectAnswer
    from identify.output.project import project_text
    from identify.project.history import commands

    answer = ProjectAnswer.of(project, history=commands(here))
    return Reply(project_text(here.root.resolve().name, project), answer)
