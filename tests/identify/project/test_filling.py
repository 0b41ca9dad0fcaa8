"""What each command takes from a project, and the names that it gives to what it writes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from identify.project.entries import AnswerEntry, ModelEntry, Project, RecordingEntry
from identify.project.filling import FILLINGS
from identify.project.folder import Folder
from twin.errors import InputError

LOGS = {"a": "training", "b": "training", "c": "selection", "d": "test"}
WHOLE = Project(
    recordings=[RecordingEntry(file=f"logs/{n}.mcap", role=r) for n, r in LOGS.items()],
    models=[
        ModelEntry(file="models/1.toml"), ModelEntry(file="models/2.toml", base="models/1.toml"),
    ],
    answers=[
        AnswerEntry(command="twin diagnose", file="answers/1-diagnose.json", model="models/1.toml"),
        AnswerEntry(command="twin diagnose", file="answers/2-diagnose.json", model="models/2.toml"),
    ],
)  # fmt: skip
A, B, C, D = (f"logs/{n}.mcap" for n in LOGS)
ROLES = {"holdout": [C], "test": [D]}
MODEL = {"model": ["models/2.toml"]}


@pytest.fixture
def folder(tmp_path: Path) -> Folder:
    made = Folder(tmp_path / "servo")
    made.root.mkdir()
    made.begin()
    made.change(lambda now: WHOLE)
    for name in ("logs", "models", "answers"):
        (made.root / name).mkdir(exist_ok=True)
    for name in ("models/1.toml", "models/2.toml", "answers/2-diagnose.html", "logs/a-1.mcap"):
        (made.root / name).write_bytes(b"")
    return made


@pytest.mark.parametrize(
    ("command", "given", "added"),
    [
        ("import", {"sources": ["there/new run.csv"]}, {"out": ["logs/new run.mcap"]}),
        ("import", {"sources": ["a-1.csv"]}, {"out": ["logs/a-1-1.mcap"]}),
        ("import", {"sources": ["a.csv"], "guess": True}, {}),
        ("new", {}, {"logs": [A, B, C], "out": ["models/3.toml"], "name": ["servo"]}),
        ("new", {"name": "mine"}, {"logs": [A, B, C], "out": ["models/3.toml"]}),
        ("fit", {}, {**MODEL, "logs": [A, B], **ROLES, "out": ["models/3.toml"]}),
        ("fit", {"out": "x.toml"}, {**MODEL, "logs": [A, B], **ROLES}),
        ("diagnose", {}, {**MODEL, "logs": [A, B], **ROLES, "html": ["answers/3-diagnose.html"]}),
        ("compare", {}, {**MODEL, "logs": [D], "html": ["answers/1-compare.html"]}),
        ("add", {"effect": "wear"}, {**MODEL, "logs": [A, B], **ROLES, "out": ["models/3.toml"]}),
        (
            "add",
            {"found": True},
            {"effect": ["answers/2-diagnose.json"], **MODEL, "logs": [A, B], **ROLES,
             "out": ["models/3.toml"]},
        ),
        ("remove", {"effect": "x"}, {**MODEL, "logs": [A, B], **ROLES, "out": ["models/3.toml"]}),
        ("plan", {}, {**MODEL, "logs": [A, B], "holdout": [C], "out": ["experiments/1.toml"]}),
        ("feedforward", {}, {**MODEL, "logs": [D], "before": ["models/1.toml"]}),
        ("frf", {}, {"logs": [A, B, C, D], "plot": ["answers/1-frf.png"]}),
        ("cut", {"log": "logs/a.mcap"}, {"out": ["logs/a-2.mcap"]}),
        ("check", {}, {"logs": [A, B, C, D]}),
        ("export", {"to": "c"}, {**MODEL, "folder": ["exports/1-c"]}),
        ("export", {}, MODEL),
        ("view", {}, {"log": [D], **MODEL, "html": ["answers/1-view.html"]}),
        (
            "simulate",
            {"experiment": "experiments/1.toml"},
            {**MODEL, "out": ["experiments/1-simulated-1.mcap"]},
        ),
    ],
)  # fmt: skip
def test_a_command_takes_what_is_not_given(
    folder: Folder, command: str, given: dict[str, Any], added: dict[str, list[str]]
) -> None:
    assert FILLINGS[command].of(folder, given) == added


@pytest.mark.parametrize("command", ["fit", "compare", "view", "export"])
def test_a_command_that_names_its_own_stands_on_its_own(folder: Folder, command: str) -> None:
    own = FILLINGS[command].key
    assert own is not None
    assert FILLINGS[command].of(folder, {own: ["mine"], "to": "c"}) is None


def test_of_a_project_that_has_less_the_next_role_is_taken_or_it_is_said(folder: Folder) -> None:
    few = [r for r in WHOLE.recordings if r.role == "training"]
    folder.change(lambda now: Project(recordings=few))
    for command, given in (("fit", {}), ("add", {"found": True}), ("export", {"to": "c"})):
        with pytest.raises(InputError, match="has no model yet; `twin new` proposes one"):
            FILLINGS[command].of(folder, given)
    viewed = FILLINGS["view"].of(folder, {})
    assert viewed == {"log": [A], "html": ["answers/1-view.html"]}
    assert FILLINGS["check"].of(folder, {}) == {"logs": [A, B]}
    folder.change(lambda now: Project(models=WHOLE.models))
    with pytest.raises(InputError, match="has no diagnosis of its present model"):
        FILLINGS["add"].of(folder, {"found": True})
    for command, roles in (("new", "training selection"), ("fit", "training")):
        with pytest.raises(InputError, match=f"has no recording in role {roles}; `twin import"):
            FILLINGS[command].of(folder, {})
