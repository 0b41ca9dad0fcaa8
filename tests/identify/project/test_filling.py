"""What each command takes from a project and leaves in it, and the names that it gives."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from identify.project.entries import (
    AnswerEntry,
    ErrorsEntry,
    ExperimentEntry,
    ExportEntry,
    ModelEntry,
    Project,
    RecordingEntry,
)
from identify.project.filling import FILLINGS
from identify.project.folder import Folder
from identify.project.keeping import KEPT, keep
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


GIVEN = {"out": "models/2.toml", "model": "models/1.toml", "log": "logs/a.mcap",
         "sources": ["a.csv", "b.csv"], "mapping": "m.toml"}  # fmt: skip
STEP = {"axis": "x", "effect": "spring", "action": "add", "unit": "N", "fit_error_before": 5.0,
        "fit_error_after": 4.0, "holdout_error_before": 6.0, "holdout_error_after": 3.0,
        "test_error_before": None, "test_error_after": None}  # fmt: skip
OF_STEP = [
    ErrorsEntry(axis="x", role="training", after=4.0, before=5.0, unit="N"),
    ErrorsEntry(axis="x", role="selection", after=3.0, before=6.0, unit="N"),
]
GROWN = ModelEntry(file="models/2.toml", base="models/1.toml")
BODY = {**STEP, "axis": "y", "effect": "arm", "action": "body", "unit": "N m"}
OF_BODY = [e.model_copy(update={"axis": "y", "unit": "N m"}) for e in OF_STEP]
TAKEN = RecordingEntry(file="logs/a.mcap", role="training", sources=["a.csv"])
MADE = {
    "import": ({"log": "logs/c.mcap", "map": "logs/c.map.toml"}, "recordings", RecordingEntry(
        file="logs/c.mcap", role="selection", sources=["a.csv", "b.csv"], map="logs/c.map.toml")),
    "import with a map": ({"log": "logs/c.mcap"}, "recordings", RecordingEntry(
        file="logs/c.mcap", role="selection", sources=["a.csv", "b.csv"], map="m.toml")),
    "import of a map alone": ({"log": None}, "recordings", None),
    "new": ({"model": "models/1.toml"}, "models", ModelEntry(file="models/1.toml")),
    "fit": (
        {"axes": {"x": {"force_error": 4.0, "holdout_force_error": 3.0, "unit": "N",
                        "test_force_error": 2.0},
                  "y": {"force_error": 1.0, "unit": "N m"}}}, "models",
        GROWN.model_copy(update={"change": ["fit"], "errors": [
            ErrorsEntry(axis="x", role="training", after=4.0, unit="N"),
            ErrorsEntry(axis="x", role="selection", after=3.0, unit="N"),
            ErrorsEntry(axis="x", role="test", after=2.0, unit="N"),
            ErrorsEntry(axis="y", role="training", after=1.0, unit="N m"),
        ]})),
    "add": (STEP, "models", GROWN.model_copy(update={"change": ["spring"], "errors": OF_STEP})),
    "add all": ({"steps": [STEP, BODY], "kept": False}, "models", GROWN.model_copy(update={
        "change": ["spring", "body arm"], "proved": False, "errors": [*OF_STEP, *OF_BODY]})),
    "add a body": (
        {"body": "arm", "errors": {"y": {"on": "test", "before": 2.0, "after": 1.0, "unit": "N"}}},
        "models", GROWN.model_copy(update={"change": ["body arm"], "errors": [
            ErrorsEntry(axis="y", role="test", before=2.0, after=1.0, unit="N")]})),
    "remove": (STEP, "models", GROWN.model_copy(update={"removed": "spring", "errors": OF_STEP})),
    "plan": ({"file": "next.toml"}, "experiments", ExperimentEntry(file="next.toml")),
    "plan of none": ({"file": None}, "experiments", None),
    "export": ({"format": "csv", "files": ["a.csv", "b.csv"]}, "exports",
               ExportEntry(format="csv", files=["a.csv", "b.csv"])),
    "cut": ({"log": "logs/part.mcap"}, "recordings", TAKEN.model_copy(
        update={"file": "logs/part.mcap"})),
}  # fmt: skip


@pytest.mark.parametrize("name", MADE)
def test_what_a_command_made_is_in_the_project_with_its_errors(name, tmp_path):
    folder, (answer, kind, entry) = Folder(tmp_path), MADE[name]
    folder.begin()
    before = folder.change(lambda p: p.model_copy(update={"recordings": [TAKEN]}))
    command = name.split()[0]
    keep(folder, command, GIVEN, answer, f"twin {command} typed")
    kept = folder.read()
    others = [] if command == "cut" else getattr(before, kind)
    assert getattr(kept, kind) == [*others, *([entry] if entry else [])]
    told = kept.answers if command in KEPT else [None]
    assert len(told) == 1
    if told[0]:
        assert (told[0].command, told[0].model) == (f"twin {command} typed", "models/1.toml")
        assert json.loads((tmp_path / told[0].file).read_text()) == answer


def test_what_is_imported_again_keeps_its_place_and_role(tmp_path):
    folder = Folder(tmp_path)
    folder.begin()
    last = TAKEN.model_copy(update={"file": "logs/b.mcap", "sources": ["b.csv"], "role": "test"})
    folder.change(lambda p: p.model_copy(update={"recordings": [TAKEN, last]}))
    keep(folder, "import", {"sources": ["a.csv"]}, {"log": "logs/new.mcap"}, "twin import a.csv")
    first = TAKEN.model_copy(update={"file": "logs/new.mcap"})
    assert folder.read().recordings == [first, last]
    keep(folder, "fit", {"model": "m.toml"}, {"axes": {}}, "twin fit m.toml")
    assert folder.read().models == []  # without a file to write
