"""A project as text: its ledger."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from identify.output.numbers import change, quantity

if TYPE_CHECKING:
    from identify.project.entries import ErrorsEntry, ModelEntry, Project


def project_text(name: str, project: Project) -> str:
    """Recordings in their roles, models in their order with their errors, and what was planned."""
    lines = [f"project {name}"]
    width = max((len(r.file) for r in project.recordings), default=0)
    lines += [
        f"  {r.file:{width}s}  {r.role}{f', from {r.sources[0]}' if r.sources else ''}"
        for r in project.recordings
    ]
    lines += [f"  {line}" for model in project.models for line in _model(project, model)]
    lines += [f"  {e.file}: an experiment" for e in project.experiments]
    lines += [f"  {', '.join(e.files)}: exported to {e.format}" for e in project.exports]
    if len(lines) == 1:
        lines.append("  empty; `twin import FILE` takes a recording in")
    return "\n".join(lines)


def _model(project: Project, model: ModelEntry) -> Iterator[str]:
    yield f"{model.file} = {model_made(model)}"
    if model.errors and project.logs("test") and not any(e.role == "test" for e in model.errors):
        yield "  not tested: it has no error on the test logs"
    for axis in dict.fromkeys(e.axis for e in model.errors):
        told = [error_in_words(e) for e in reversed(model.errors) if e.axis == axis]
        yield f"  axis {axis}: {', '.join(told)}"


def model_made(model: ModelEntry) -> str:
    """What a model was made from."""
    if model.base is None:
        return "first model"
    if model.change == ["fit"]:
        return f"{model.base} refitted"
    if model.removed:
        return f"{model.base} without {model.removed}"
    proof = "" if model.proved else ", which the logs do not prove"
    return f"{model.base} + {' + '.join(model.change)}{proof}"


def error_in_words(error: ErrorsEntry) -> str:
    """The error in a role, with that before the change."""
    if error.before is None:
        return f"{error.role} {quantity(error.after, error.unit)}"
    before, after = change(error.before, error.after, error.unit)
    return f"{error.role} {before} -> {after}"
