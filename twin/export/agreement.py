"""Whether exported files are still those of a model: for the regression tests of a controller."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path

from twin.errors import InputError
from twin.export import Exported, find_exporter, format_names
from twin.logs import Log
from twin.model.machine import MachineModel


@dataclass(frozen=True)
class Outdated:
    """A file that is not as the model gives it now.

    line: the first that differs, None in a file that is no text; has, gives: that line of the file
    and of the model, empty where one has ended.
    """

    file: str
    line: int | None
    has: str
    gives: str


@dataclass(frozen=True)
class ExportAgreement:
    """What became of an export: its formats, and the files that are not those of the model."""

    formats: tuple[str, ...]
    outdated: tuple[Outdated, ...]

    @property
    def agrees(self) -> bool:
        """Whether every file is as the model gives it."""
        return not self.outdated


def compare_export(model: MachineModel, path: Path, logs: Mapping[str, Log]) -> ExportAgreement:
    """Compare exported files with what the model gives now.

    path: the folder that `twin export` wrote into, or the only file of a format. logs: those that
    were given to it. Raises InputError where nothing there is an export of such a model.
    """
    if not path.exists():
        raise InputError(f"{path}: no such file or folder; give what `twin export` wrote")
    endings = {file.suffix for file in (path.iterdir() if path.is_dir() else [path])}
    formats, outdated = [], []
    for name in format_names():
        exporter = find_exporter(name)
        if exporter.ending not in endings:
            continue
        try:
            made = exporter.export(model, logs)
        except InputError:
            continue  # of another kind of machine
        if pairs := _pairs(made, path):
            formats.append(name)
            outdated += [found for file, content in pairs for found in _outdated(file, content)]
    if not formats:
        raise InputError(
            f"{path}: holds no export of {model.name}; give what `twin export` wrote of it"
        )
    return ExportAgreement(tuple(formats), tuple(outdated))


def _pairs(made: Exported, path: Path) -> list[tuple[Path, str | bytes]]:
    """Each file there with what it should hold; none where it is not this format."""
    if path.is_dir():
        files = [(path / name, content) for name, content in made.files.items()]
        return files if all(file.is_file() for file, _ in files) else []
    (name, content), *others = made.files.items()
    return [] if others or Path(name).suffix != path.suffix else [(path, content)]


def _outdated(file: Path, content: str | bytes) -> Iterator[Outdated]:
    if isinstance(content, bytes):
        if file.read_bytes() != content:
            yield Outdated(str(file), None, "", "")
        return
    has = file.read_text(encoding="utf-8", errors="replace").splitlines()
    for line, (old, new) in enumerate(zip_longest(has, content.splitlines(), fillvalue=""), 1):
        if old.strip() != new.strip():
            yield Outdated(str(file), line, old.strip(), new.strip())
            return
