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
    """What a format makes of a part of the model that it cannot hold as it is.

    part: an effect, or another part of the axis such as "mass"; text: what becomes of it and why,
    in one sentence with units.
    """

    axis: str
    part: str
    text: str


@dataclass(frozen=True)
class Exported:
    """The files of an export, and what they lack of the model.

    files: content by name; kept: by axis, what they hold as the model does; approximated: what they
    hold nearly; lost: what they do not hold.
    """

    files: Mapping[str, str | bytes]
    kept: Mapping[str, tuple[str, ...]]
    approximated: tuple[Remark, ...] = ()
    lost: tuple[Remark, ...] = ()


Export = Callable[["MachineModel", Mapping[str, "Log"]], Exported]


@dataclass(frozen=True)
class Exporter:
    """One format.

    summary: what it writes, in a few words; export: (model, logs by name) -> files, which tells on
    logs what is lost and raises InputError; ending: of the name of a file that every export has.
    """

    summary: str
    export: Export
    ending: str


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
