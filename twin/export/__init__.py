"""A model for other tools: every file in ``formats`` is one exporter, and no other file names it.

Such a file defines ``EXPORTER`` and takes its name, which is that of ``--to``, from the file.
"""

from __future__ import annotations

import importlib
import pkgutil
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from twin.entries import near
from twin.errors import InputError

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
class Exported:
    """The files of an export, and what they lack of the model."""

    files: Mapping[str, str | bytes]
    """Content by file name."""
    kept: Mapping[str, tuple[str, ...]]
    """By axis, what the files hold as the model does."""
    approximated: tuple[Remark, ...] = ()
    """What they hold nearly."""
    lost: tuple[Remark, ...] = ()
    """What they do not hold."""


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
            f"--to {name}: no such format; {near(name, known)}there are {', '.join(known)}"
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


def identifier(name: str) -> str:
    """A name as one of a program: small letters, digits and _."""
    plain = re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_") or "model"
    return plain if plain[0].isalpha() else f"m_{plain}"
