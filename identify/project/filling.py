"""What a command inside a project takes from it for the arguments that were left out."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from identify.project.entries import Project
from identify.project.folder import Folder
from twin.errors import InputError

Given = Mapping[str, Any]  # parameters of a command by name, as far as they were given
Source = Callable[[Folder, Project, Given], list[str]]


@dataclass(frozen=True)
class Filling:
    """Where a command takes what was left out. inputs: positional ones; options: by parameter.

    key: the parameter with which a command stands on its own: where it was given, nothing is
    filled, and the project is left alone; None where the command always belongs to the project.
    """

    inputs: Mapping[str, Source]
    options: Mapping[str, Source]
    key: str | None = "logs"

    def of(self, folder: Folder, given: Given) -> dict[str, list[str]] | None:
        """The values to add by parameter; None where the command stands on its own."""
        if self.key is not None and given.get(self.key):
            return None
        project = folder.read()
        wanted = {**self.inputs, **self.options}
        return {
            name: values
            for name, source in wanted.items()
            if not given.get(name) and (values := source(folder, project, given))
        }


def _model(folder: Folder, project: Project, given: Given) -> list[str]:
    if project.model is None:
        raise InputError(
            f"{folder.file}: has no model yet; `twin new` proposes one from its recordings"
        )
    return [project.model]


def _present_model(folder: Folder, project: Project, given: Given) -> list[str]:
    return [project.model] if project.model else []


def _model_before(folder: Folder, project: Project, given: Given) -> list[str]:
    base = project.models[-1].base if project.models else None
    return [base] if base else []


def _logs(*roles: str) -> Source:
    """The recordings in the first of these groups of roles, as "training selection", with any."""

    def source(folder: Folder, project: Project, given: Given) -> list[str]:
        groups = (project.logs(*group.split()) for group in roles)  # type: ignore[arg-type]
        logs = next(filter(None, groups), [])
        if not logs:
            raise InputError(
                f"{folder.file}: has no recording in role {' or '.join(roles)}; `twin import FILE` "
                "adds one, `twin project role FILE ROLE` changes what one is for"
            )
        return logs

    return source


def _logs_if_any(role: str) -> Source:
    return lambda folder, project, given: project.logs(role)  # type: ignore[arg-type]


def _free(inside: str, pattern: str) -> Source:
    return lambda folder, project, given: [str(folder.free_name(inside, pattern))]


def _first(source: Source) -> Source:
    return lambda folder, project, given: source(folder, project, given)[:1]


def _imported(folder: Folder, project: Project, given: Given) -> list[str]:
    """The log of a recording, beside an earlier one of the same name."""
    if given.get("guess"):
        return []
    stem = Path(given["sources"][0]).stem
    path = Path("logs") / f"{stem}.mcap"
    if (folder.root / path).exists():
        path = folder.free_name("logs", f"{stem}-{{}}.mcap")
    else:
        (folder.root / "logs").mkdir(exist_ok=True)
    return [str(path)]


def _cut(folder: Folder, project: Project, given: Given) -> list[str]:
    """The stretch of a recording, beside it."""
    return [str(folder.free_name("logs", f"{Path(given['log']).stem}-{{}}.mcap"))]


def _found(folder: Folder, project: Project, given: Given) -> list[str]:
    """The last diagnosis of the present model, where all that it found is to be added."""
    if not given.get("found"):
        return []
    _model(folder, project, given)
    answer = project.answer("diagnose")
    if answer is None:
        raise InputError(
            f"{folder.file}: has no diagnosis of its present model; `twin diagnose` makes one"
        )
    return [answer.file]


def _named(folder: Folder, project: Project, given: Given) -> list[str]:
    return [folder.root.resolve().name]


def _exported(folder: Folder, project: Project, given: Given) -> list[str]:
    if "to" not in given:  # which the command asks for by itself
        return []
    return [str(folder.free_name("exports", f"{{}}-{Path(given['to']).name}"))]


def _simulated(folder: Folder, project: Project, given: Given) -> list[str]:
    stem = Path(given["experiment"]).stem
    return [str(folder.free_name("experiments", f"{stem}-simulated-{{}}.mcap"))]


_TO_FIT = {"logs": _logs("training")}
_HELD = {"holdout": _logs_if_any("selection"), "test": _logs_if_any("test")}
_TESTS = {"logs": _logs("test", "selection", "training")}
_ALL = {"logs": _logs("training selection test")}
_NEW_MODEL = {"out": _free("models", "{}.toml")}
_OF_MODEL = {"model": _model}
FILLINGS: Mapping[str, Filling] = {
    "import": Filling({}, {"out": _imported}, None),
    "new": Filling({"logs": _logs("training selection")}, _NEW_MODEL | {"name": _named}),
    "fit": Filling(_OF_MODEL | _TO_FIT, _HELD | _NEW_MODEL),
    "diagnose": Filling(
        _OF_MODEL | _TO_FIT, _HELD | {"html": _free("answers", "{}-diagnose.html")}
    ),
    "compare": Filling(_OF_MODEL | _TESTS, {"html": _free("answers", "{}-compare.html")}),
    "add": Filling({"effect": _found} | _OF_MODEL | _TO_FIT, _HELD | _NEW_MODEL),
    "remove": Filling(_OF_MODEL | _TO_FIT, _HELD | _NEW_MODEL),
    "plan": Filling(
        _OF_MODEL | _TO_FIT,
        {"holdout": _HELD["holdout"], "out": _free("experiments", "{}.toml")},
    ),
    "feedforward": Filling(_OF_MODEL | _TESTS, {"before": _model_before}),
    "frf": Filling(_ALL, {"plot": _free("answers", "{}-frf.png")}),
    "cut": Filling({}, {"out": _cut}, None),
    "check": Filling(_ALL, {}),
    "info": Filling(_ALL, {}),
    "export": Filling(_OF_MODEL, {"folder": _exported}, "model"),
    "view": Filling(
        {"log": _first(_logs("test", "selection", "training")), "model": _present_model},
        {"html": _free("answers", "{}-view.html")},
        "log",
    ),
    "simulate": Filling({}, {"model": _present_model, "out": _simulated}, None),
}
"""By command; a command that is not here knows nothing of a project."""
