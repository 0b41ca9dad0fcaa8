"""What the page shows: the project, the files beside it, the jobs, as one JSON object."""

from __future__ import annotations

import hashlib
import json
import re
import tomllib
from collections.abc import Iterator, Mapping
from typing import Any

import tomlkit

from identify.app.guard import inside
from identify.app.jobs import Jobs
from identify.output.answers import plain
from identify.output.numbers import quantity
from identify.output.project import error_in_words, model_made
from identify.project.entries import Project
from identify.project.folder import HISTORY, OWN, Folder
from identify.project.history import commands
from identify.project.script import script
from twin.errors import InputError

# What recorders and tools write; the importers know better, and say so of each file.
RECORDED = (".csv", ".txt", ".tsv", ".mat", ".json", ".parquet", ".h5", ".hdf5", ".tdms", ".mcap",
            ".xlsx", ".db3", ".bag", ".dat", ".log")  # fmt: skip
MECHANISM = (".xml", ".mjcf", ".urdf")
OWN_FOLDERS = ("models", "answers", "experiments", "exports", OWN)
MOST_FILES = 400  # beside the project that are listed
UNIT = re.compile(r"^#\s*([^,]*)(?:,\s*(.*))?$")


def state_of(folder: Folder, jobs: Jobs) -> dict[str, Any]:
    """All that the screens show; error: of a project file that is damaged."""
    try:
        project, error = folder.read(), None
    except InputError as wrong:
        project, error = Project(), str(wrong)
    return {
        "name": folder.root.resolve().name,
        "error": error,
        **project.model_dump(),
        "ledger": [_ledger(folder, project, k) for k in range(len(project.models))],
        "files": [*_files(folder, project)],
        "mechanisms": [*_of(folder, MECHANISM)],
        "history": commands(folder),
        "python": script(project),
        "jobs": jobs.shown(),
        "worker": folder.worker(),
        "runs": sorted(
            p.relative_to(folder.root).as_posix()
            for p in (folder.root / "experiments").glob("*")
            if p.suffix != ".toml"
        ),
        "stores": [*_stores(folder)],
    }


def signature(folder: Folder, jobs: Jobs) -> str:
    """Another text whenever what is shown may be another; it costs next to nothing."""
    watched = [folder.file, folder.root / HISTORY, folder.root / OWN / "work.who", folder.root]
    watched += [p for k in jobs.jobs for p in (jobs.place / f"{k}.json",)]
    if (last := max(jobs.jobs, default=None)) is not None:
        running = [k for k, j in jobs.jobs.items() if j.state == "running"] or [last]
        watched += [jobs.place / f"{running[-1]}.err"]
    stamps = []
    for path in watched:
        try:
            found = path.stat()
            stamps.append((found.st_mtime_ns, found.st_size))
        except OSError:
            stamps.append((0, 0))
    return hashlib.sha256(repr(stamps).encode()).hexdigest()[:16]


def _ledger(folder: Folder, project: Project, index: int) -> dict[str, Any]:
    """A model in words: what was changed, and its errors by role, the test logs first."""
    model = project.models[index]
    errors = [
        {**e.model_dump(), "told": error_in_words(e), "shown": quantity(e.after, e.unit)}
        for e in reversed(model.errors)
    ]
    return {"file": model.file, "made": model_made(model), "errors": errors}


def _files(folder: Folder, project: Project) -> Iterator[dict[str, Any]]:
    """Files that may be recordings, and whether the project has them."""
    taken = {s for r in project.recordings for s in (*r.sources, r.file)}
    for name in _of(folder, RECORDED):
        yield {"name": name, "taken": name in taken}


def _of(folder: Folder, endings: tuple[str, ...]) -> Iterator[str]:
    """Files with these endings in the folder and those directly below it."""
    found = sorted(p for pattern in ("*", "*/*") for p in folder.root.glob(pattern))
    names = (p.relative_to(folder.root) for p in found if p.suffix.lower() in endings)
    own = (*OWN_FOLDERS, "logs")
    kept = (n for n in names if n.parts[0] not in own and not n.name.startswith("."))
    for count, name in enumerate(kept):
        if count == MOST_FILES:
            return
        yield name.as_posix()


def _stores(folder: Folder) -> Iterator[str]:
    """Folders that hold the records of a fleet."""
    for path in sorted(folder.root.glob("*/records")):
        yield path.parent.relative_to(folder.root).as_posix()


def model_of(folder: Folder, name: str) -> dict[str, Any]:
    """A model for its cards: by axis the hardware and the effects, with units, meanings, bands."""
    text = inside(folder.root, name).read_text(encoding="utf-8")
    document, bands = tomlkit.parse(text), tomllib.loads(text).get("intervals", {})
    axes = {
        axis: {
            "values": [*_values(table, bands.get(axis, {}), "")],
            "effects": [
                {"name": effect, "values": [*_values(own, bands.get(axis, {}), f"{effect}.")],
                 "fixed": [*own.get("fixed", [])]}
                for effect, own in table.get("effects", {}).items()
            ],
        }
        for axis, table in document.get("axes", {}).items()
    }  # fmt: skip
    return {"file": name, "axes": axes}


def _values(table: Any, bands: Mapping[str, Any], prefix: str) -> Iterator[dict[str, Any]]:
    for key, value in table.items():
        if isinstance(value, bool) or not isinstance(value, float | int):
            continue
        found = UNIT.match(_remark(value))
        unit, meaning = (found[1].strip(), found[2] or "") if found else ("", "")
        band = bands.get(prefix + key)
        low_high = band and [_shown(float(v), unit) for v in band]
        yield {"name": key, "shown": _shown(float(value), unit), "meaning": meaning,
               "band": low_high}  # fmt: skip


def _remark(value: Any) -> str:
    """What stands behind a value."""
    remark: str = value.trivia.comment
    return remark


def _shown(value: float, unit: str) -> str:
    """A value in the unit that suits it; where its unit is none, as it is."""
    try:
        return quantity(value, "" if unit == "1" else unit)
    except (InputError, KeyError, ValueError):
        return f"{value:.4g} {unit}"


def answer_of(folder: Folder, name: str) -> dict[str, Any]:
    """A saved answer; what is large and not shown is left out."""
    found = json.loads(inside(folder.root, name).read_text(encoding="utf-8"))
    for key in ("model", "mujoco", "parameters"):
        found.pop(key, None)
    found.pop("axes", None) if "ranking" in found and len(found.get("axes", {})) < 2 else None
    cleaned: dict[str, Any] = plain(found)
    return cleaned
