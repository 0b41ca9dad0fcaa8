"""A model for other tools: every file in ``formats`` is one exporter, and no other file names it.

Such a file defines ``EXPORTER`` and takes its name, which is that of ``--to``, from the file.
"""

from __future__ import annotations

import importlib
import math
import pkgutil
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, Any

from twin.errors import InputError, near

if TYPE_CHECKING:
    from twin.logs import Log
    from twin.model.machine import MachineModel


@dataclass(frozen=True)
class Remark:
    """What a format makes of a part of the model that it cannot hold as it is."""

    axis: str
    """The axis whose part it is."""
    part: str
    """An effect, or another part of the axis such as "mass"."""
    text: str
    """What becomes of it and why, in one sentence with units."""


@dataclass(frozen=True)
class Loss:
    """What a format loses of an effect. size, left: RMS of its force and of what is lost of it."""

    size: float
    left: float

    @property
    def is_negligible(self) -> bool:
        """Whether less is lost than a tenth of usual intervals."""
        return self.left <= 0.01 * self.size

    @property
    def is_most(self) -> bool:
        """Whether more is lost than held, so that the effect is called lost."""
        return self.left > 0.5 * self.size

    def on(self, where: str, unit: str) -> str:
        """In words; where: the motion along which it was computed."""
        return f"{self.left:.2g} of its {self.size:.2g} {unit} RMS are lost on {where}"


@dataclass(frozen=True)
class Held:
    """What a format holds of one axis as the model does, what nearly, and what not at all."""

    kept: tuple[str, ...]
    approximated: tuple[Remark, ...]
    lost: tuple[Remark, ...]


@dataclass(frozen=True)
class Exported:
    """The files of an export by name, and what they hold of each axis."""

    files: Mapping[str, str | bytes]
    axes: Mapping[str, Held]
    written: tuple[Remark, ...] = ()
    """Of a file that is written back, what of it is another now, and what stays of its own."""

    @property
    def kept(self) -> dict[str, tuple[str, ...]]:
        """By axis, what the files hold as the model does."""
        return {name: own.kept for name, own in self.axes.items()}

    @property
    def approximated(self) -> tuple[Remark, ...]:
        """What they hold nearly."""
        return tuple(remark for own in self.axes.values() for remark in own.approximated)

    @property
    def lost(self) -> tuple[Remark, ...]:
        """What they do not hold."""
        return tuple(remark for own in self.axes.values() for remark in own.lost)


Export = Callable[["MachineModel", Mapping[str, "Log"]], Exported]


@dataclass(frozen=True)
class Exporter:
    """One format."""

    summary: str
    """What it writes, in a few words."""
    export: Export
    """(model, logs by name) -> files; with logs it tells on them what is lost. Raises InputError"""
    ending: str
    """Of the name of a file that every export has."""


def format_names() -> tuple[str, ...]:
    """The names of all formats."""
    folder = importlib.import_module(f"{__name__}.formats")
    return tuple(sorted(m.name for m in pkgutil.iter_modules(folder.__path__)))


def find_exporter(name: str) -> Exporter:
    """The exporter of a format; InputError where there is none."""
    known = format_names()
    if name not in known:
        raise InputError(
            f"'{name}' is no format of an export; {near(name, known)}there are {', '.join(known)}"
        )
    found: Exporter = importlib.import_module(f"{__name__}.formats.{name}").EXPORTER
    return found


def axis_identifiers(model: MachineModel) -> dict[str, str]:
    """Each axis' name as one of a program; InputError where two of them are the same there."""
    names = {axis: identifier(axis) for axis in model.axes}
    for axis, name in names.items():
        if list(names.values()).count(name) > 1:
            raise InputError(
                f"axis {axis}: is called {name} in an export, as another is; give it another name"
            )
    return names


# Words of C, C++ and IEC 61131 and files of an FMU, which no model or axis can be called there.
TAKEN = {
    "auto", "bool", "break", "case", "catch", "char", "class", "const", "continue", "default",
    "delete", "do", "double", "else", "enum", "explicit", "export", "extern", "false", "float",
    "for", "friend", "goto", "if", "inline", "int", "long", "mutable", "namespace", "new",
    "operator", "private", "protected", "public", "register", "restrict", "return", "short",
    "signed", "sizeof", "static", "struct", "switch", "template", "this", "throw", "true",
    "try", "typedef", "typename", "union", "unsigned", "using", "virtual", "void", "volatile",
    "while", "model", "fmi2", "array", "by", "byte", "dint", "end", "exit", "function", "lint",
    "of", "real", "lreal", "repeat", "string", "sint", "then", "time", "to", "type", "until",
    "udint", "uint", "usint", "var", "with", "word", "and", "or", "xor", "not", "mod",
}  # fmt: skip


def identifier(name: str) -> str:
    """A name as one of a program: small letters, digits and _, and no word that it has already."""
    plain = re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_") or "model"
    return plain if plain[0].isalpha() and plain not in TAKEN else f"m_{plain}"


def filled(template: str, **values: Any) -> str:
    """The text of a template, which is called so, with these values in it."""
    text: str = _templates().get_template(f"{template}.j2").render(values)
    return text


@cache
def _templates() -> Any:
    from xml.sax.saxutils import quoteattr

    from jinja2 import Environment, PackageLoader, StrictUndefined

    found: Any = Environment(
        loader=PackageLoader("twin.export"), undefined=StrictUndefined, trim_blocks=True,
        lstrip_blocks=True, keep_trailing_newline=True,
    )  # fmt: skip
    found.filters.update(
        exact=repr,
        identifier=identifier,
        plain=lambda text: text.replace("*/", "* /").replace("\\", "/"),  # it ends no comment
        quoted=quoteattr,
    )
    found.tests.update(finite=math.isfinite)
    return found


@dataclass(frozen=True)
class Outdated:
    """A file that is not as the model gives it now."""

    file: str
    line: int | None
    """The first that differs; None in a file that is no text."""
    has: str
    gives: str
    """The line of the file, and that of the model; empty where one has ended."""


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
