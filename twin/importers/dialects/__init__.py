"""How recorders write their files: every file in this folder is one dialect, found as effects are.

A file defines ``DIALECT`` and takes the name, which is that of ``format`` in a map, from the file.
Of the dialects of one ending all but one know their files by what is in them.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from twin.errors import InputError

if TYPE_CHECKING:
    from twin.importers.mapping import ImportMap
    from twin.importers.table import SignalTable

PACKED = (".gz", ".zip", ".bz2", ".xz", ".7z", ".zst")
SHEETS = (".xlsx", ".xls", ".xlsm", ".ods")  # of workbooks, which hold more than a table


@dataclass(frozen=True)
class Dialect:
    """One way to write a recording."""

    summary: str
    """Who writes so, in a few words."""
    endings: tuple[str, ...]
    """Of the names of such files."""
    read: Callable[[Path, ImportMap], SignalTable]
    """The columns that a map names, all where it has no axes; raises InputError."""
    is_its: Callable[[Path], bool] | None = None
    """Whether a file is of this dialect; None for the one that takes what no other knows."""


@cache
def all_dialects() -> Mapping[str, Dialect]:
    """Every dialect by name."""
    names = sorted(module.name for module in pkgutil.iter_modules(__path__))
    return {n: importlib.import_module(f"{__name__}.{n}").DIALECT for n in names}


def find_dialect(path: Path, stated: str | None) -> str:
    """The name of a file's dialect; stated: ``format`` of its map. Raises InputError for none.

    Where the map states the one that takes every file of its endings, another may know the file.
    """
    known = all_dialects()
    if stated is not None and stated not in known:
        raise InputError(f"the map gives format = '{stated}'; allowed: {', '.join(known)}")
    if stated is not None and known[stated].is_its is not None:
        return stated
    endings = (path.suffix.lower(),) if stated is None else known[stated].endings
    fitting = {name: d for name, d in known.items() if set(endings) & set(d.endings)}
    if not fitting and path.suffix.lower() in PACKED:
        raise InputError("is compressed; unpack it first")
    if not fitting and path.suffix.lower() in SHEETS:
        raise InputError("is a workbook; save the sheet with the measurement as .csv")
    if not fitting:
        endings = tuple(dict.fromkeys(e for d in known.values() for e in d.endings))
        raise InputError(
            f"ends in '{path.suffix}', known are {', '.join(endings)}; state format in the map: "
            f"{', '.join(known)}"
        )
    for name, dialect in fitting.items():
        if dialect.is_its is not None and dialect.is_its(path):
            return name
    return stated or next(name for name, d in fitting.items() if d.is_its is None)
