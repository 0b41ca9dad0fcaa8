"""What a command that ran inside a project adds to it."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from identify.project.entries import (
    AnswerEntry,
    ErrorsEntry,
    ExperimentEntry,
    ExportEntry,
    ModelEntry,
    Project,
    RecordingEntry,
    RoleName,
)
from identify.project.folder import Folder
from twin.files import write_atomically

Given = Mapping[str, Any]
Answer = Mapping[str, Any]
ROLE_OF: Mapping[str, RoleName] = {"fit": "training", "holdout": "selection", "test": "test"}
KEPT = (
    "import",
    "diagnose",
    "compare",
    "plan",
    "feedforward",
    "frf",
    "check",
    "add",
    "remove",
    "fit",
    "view",
)
"""Commands whose answers a project keeps."""


def keep(folder: Folder, command: str, given: Given, answer: Answer, typed: str) -> None:
    """Add what a command made. given: its parameters; typed: as it is outside a project."""
    adds: list[Callable[[Project], Project]] = []
    if command in _ADDING and (add := _ADDING[command](given, answer)):
        adds.append(add)
    if command in KEPT:
        adds.append(_answered(folder, command, given, answer, typed))

    def change(project: Project) -> Project:
        for add in adds:
            project = add(project)
        return project

    if adds:
        folder.change(change)


def _answered(
    folder: Folder, command: str, given: Given, answer: Answer, typed: str
) -> Callable[[Project], Project]:
    """Write the answer beside its page."""
    page = given.get("html") or given.get("plot")
    name = Path(page).with_suffix(".json") if page else None
    name = name or folder.free_name("answers", f"{{}}-{command}.json")
    write_atomically(folder.root / name, json.dumps(answer).encode())
    about = given.get("model")
    entry = AnswerEntry(
        command=typed, file=str(name), page=None if page is None else str(page),
        model=None if about is None else str(about),
    )  # fmt: skip
    return lambda project: _more(project, "answers", entry)


def _more(project: Project, kind: str, entry: Any) -> Project:
    return project.model_copy(update={kind: [*getattr(project, kind), entry]})


Adding = Callable[[Given, Answer], Callable[[Project], Project] | None]


def _import(given: Given, answer: Answer) -> Callable[[Project], Project] | None:
    log, sources = answer.get("log"), [str(path) for path in given["sources"]]
    if log is None:  # only a map, or less
        return None

    def change(project: Project) -> Project:
        old = [r for r in project.recordings if r.sources == sources]
        entry = RecordingEntry(
            file=log, role=old[0].role if old else project.next_role(), sources=sources,
            map=answer.get("map") or _text(given.get("mapping")),
        )  # fmt: skip
        if not old:
            return _more(project, "recordings", entry)
        changed = [entry if r is old[0] else r for r in project.recordings]
        return project.model_copy(update={"recordings": changed})

    return change


def _cut(given: Given, answer: Answer) -> Callable[[Project], Project]:
    """The stretch takes the place of the recording that it was cut from."""

    def change(project: Project) -> Project:
        changed = [
            r.model_copy(update={"file": answer["log"]}) if r.file == str(given["log"]) else r
            for r in project.recordings
        ]
        return project.model_copy(update={"recordings": changed})

    return change


def _text(path: object) -> str | None:
    return None if path is None else str(path)


def _new(given: Given, answer: Answer) -> Callable[[Project], Project]:
    return lambda project: _more(project, "models", ModelEntry(file=answer["model"]))


def _fit(given: Given, answer: Answer) -> Callable[[Project], Project] | None:
    if given.get("out") is None:
        return None
    entry = ModelEntry(
        file=str(given["out"]), base=given["model"], change=["fit"], errors=[*_fitted(answer)]
    )
    return lambda project: _more(project, "models", entry)


def _fitted(answer: Answer) -> Iterator[ErrorsEntry]:
    for axis, found in answer["axes"].items():
        errors = (found.get("force_error"), found.get("holdout_force_error"),
                  found.get("test_force_error"))  # fmt: skip
        for role, after in zip(ROLE_OF.values(), errors, strict=True):
            if after is not None:
                yield ErrorsEntry(axis=axis, role=role, after=after, unit=found["unit"])


def _add(given: Given, answer: Answer) -> Callable[[Project], Project]:
    if "body" in answer:
        return _corrected(given, answer)
    steps = answer.get("steps") or [answer]
    changes = [
        f"body {step['effect']}" if step["action"] == "body" else step["effect"]
        for step in steps
        if "effect" in step
    ]
    errors = {step["axis"]: step for step in steps if "axis" in step}
    entry = ModelEntry(
        file=str(given["out"]), base=given["model"], change=[*dict.fromkeys(changes)],
        proved=answer.get("kept", True),
        errors=[e for step in errors.values() for e in _of_step(step)],
    )  # fmt: skip
    return lambda project: _more(project, "models", entry)


def _remove(given: Given, answer: Answer) -> Callable[[Project], Project]:
    entry = ModelEntry(
        file=str(given["out"]), base=given["model"], removed=answer["effect"],
        errors=[*_of_step(answer)],
    )  # fmt: skip
    return lambda project: _more(project, "models", entry)


def _corrected(given: Given, answer: Answer) -> Callable[[Project], Project]:
    """A body of the mechanism whose inertia is another, and what that does to each joint."""
    errors = [
        ErrorsEntry(axis=axis, role=own["on"], after=own["after"], before=own["before"],
                    unit=own["unit"])
        for axis, own in answer["errors"].items()
    ]  # fmt: skip
    entry = ModelEntry(
        file=str(given["out"]), base=given["model"], change=[f"body {answer['body']}"],
        errors=errors,
    )  # fmt: skip
    return lambda project: _more(project, "models", entry)


def _of_step(step: Answer) -> Iterator[ErrorsEntry]:
    for prefix, role in ROLE_OF.items():
        after = step.get(f"{prefix}_error_after")
        if after is not None:
            before = step.get(f"{prefix}_error_before")
            yield ErrorsEntry(
                axis=step["axis"], role=role, after=after, before=before, unit=step["unit"]
            )


def _plan(given: Given, answer: Answer) -> Callable[[Project], Project] | None:
    file = answer.get("file")
    if file is None:
        return None
    return lambda project: _more(project, "experiments", ExperimentEntry(file=file))


def _export(given: Given, answer: Answer) -> Callable[[Project], Project]:
    entry = ExportEntry(format=answer["format"], files=answer["files"])
    return lambda project: _more(project, "exports", entry)


_ADDING: Mapping[str, Adding] = {
    "import": _import, "new": _new, "fit": _fit, "add": _add, "plan": _plan, "export": _export,
    "cut": _cut, "remove": _remove,
}  # fmt: skip
