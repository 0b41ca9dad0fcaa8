"""A project as a Python script: what its last model and answers were made by."""

from __future__ import annotations

from collections.abc import Iterator

from identify.project.entries import ModelEntry, Project, RoleName

NAMES: dict[RoleName, str] = {"training": "fit", "selection": "held", "test": "test"}


def script(project: Project) -> str:
    """The calls of Python that make the models of a project from its logs, one after the other."""
    lines = ["import identify, twin", ""]
    for role, name in NAMES.items():
        logs = ", ".join(f'"{log}": twin.read_log("{log}")' for log in project.logs(role))
        lines.append(f"{name} = {{{logs}}}")
    lines += [line for model in project.models for line in _calls(project, model)]
    return "\n".join(lines) + "\n"


def _calls(project: Project, model: ModelEntry) -> Iterator[str]:
    if model.base is None:
        yield f'model = twin.load_model("{model.file}")'
    elif model.change == ["fit"]:
        yield "model = identify.fit(model, fit, held, test).model"
    elif model.removed:
        place = f', axis="{model.errors[0].axis}"' if model.errors else ""
        yield f'model = identify.remove("{model.removed}", model, fit, held, test{place}).model'
    elif len(model.change) == 1 and not model.change[0].startswith("body "):
        yield f'model = identify.add("{model.change[0]}", model, fit, held, test).model'
    else:
        yield "found = identify.diagnose(model, fit, held, test)"
        yield "print(found)"
        yield "model = found.model  # with all that was found"
