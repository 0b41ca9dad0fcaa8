"""The model of each machine: one file for all, or a folder with one a machine."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path

from twin.effects import load_catalogue
from twin.errors import InputError
from twin.model.file import find_model, format_model, load_model
from twin.model.machine import MachineModel

DEFAULT = "default"  # of a folder: the model of a machine that has no file of its own


@dataclass(frozen=True)
class Machine:
    """A model with what tells it from all others."""

    model: MachineModel
    digest: str


@dataclass(frozen=True)
class Models:
    """Where models are. path: a file, a name of the package, or a folder; effects: of the user."""

    path: Path
    effects: tuple[Path, ...] = ()

    @classmethod
    def at(cls, path: str | Path, effects: Sequence[Path] = ()) -> Models:
        """Models that are there. Raises InputError."""
        found = Path(path)
        if found.is_dir():
            if not any(found.glob("*.toml")):
                raise InputError(
                    f"--model {found}: holds no model; name its files after their machines, "
                    f"MACHINE.toml, or {DEFAULT}.toml for all others"
                )
            return cls(found.resolve(), tuple(p.resolve() for p in effects))
        return cls(find_model(path).resolve(), tuple(p.resolve() for p in effects))

    @cached_property
    def digest(self) -> str:
        """Of which models there are: a log without one is looked at again when they change."""
        files = sorted(self.path.glob("*.toml")) if self.path.is_dir() else [self.path]
        return hashlib.sha256("\n".join(p.name for p in files).encode()).hexdigest()

    def of(self, machine: str) -> Machine:
        """The model of a machine. Raises InputError where it has none, or a bad one."""
        path = self.path if self.path.is_file() else self._file(machine)
        return _loaded(path, path.stat().st_mtime_ns, self.effects)

    def _file(self, machine: str) -> Path:
        named = {p.stem: p for p in self.path.glob("*.toml")}  # never a path made of its name
        found = named.get(machine) or named.get(DEFAULT)
        if found is None:
            raise InputError(
                f"{self.path}: has neither {machine}.toml nor {DEFAULT}.toml; add one of them"
            )
        return found


@lru_cache(maxsize=256)
def _loaded(path: Path, changed: int, effects: tuple[Path, ...]) -> Machine:
    """changed: when the file was, so that another one is read again."""
    model = load_model(path, load_catalogue(effects))
    parts = [format_model(model), model.mjcf or "", *(p.read_text("utf-8") for p in effects)]
    return Machine(model, hashlib.sha256("\0".join(parts).encode()).hexdigest())
