"""The catalogue: every file in this folder is one effect, and no other file names it.

A file defines ``EFFECT``, a twin.effect.Effect, and takes its name from the file.
"""

from __future__ import annotations

import importlib
import itertools
import pkgutil
import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from pathlib import Path

from twin.effect import Effect, load_effect
from twin.errors import InputError, near

MOST_OF_ONE = 12  # of one effect on an axis: a motor has more than five unrelated periods
LONGEST_TRIAL = 30.0  # s for loading, trying and compiling a user's file
LARGEST_TRIAL = 4 << 30  # bytes for the same


class Catalogue(Mapping[str, Effect]):
    """Effects by name, in alphabetical order."""

    def __init__(self, effects: Iterable[Effect]) -> None:
        self._effects = {e.name: e for e in sorted(effects, key=lambda e: e.name)}

    def __getitem__(self, name: str) -> Effect:
        found = self._found(name)
        if found is None:
            raise InputError(self._unknown(name))
        return found

    def __contains__(self, name: object) -> bool:
        return self._found(name) is not None

    def __iter__(self) -> Iterator[str]:
        return iter(self._effects)

    def __len__(self) -> int:
        return len(self._effects)

    def _found(self, name: object) -> Effect | None:
        """The effect of that name, or the one of several, such as ``cogging_2``."""
        if name in self._effects:
            return self._effects[str(name)]
        several = re.fullmatch(r"(\w+)_([1-9]\d?)", str(name))
        first = self._effects.get(several[1]) if several else None
        if several is None or first is None or not first.several:
            return None
        number = int(several[2])
        return first.numbered(number) if 2 <= number <= MOST_OF_ONE else None

    def after(self, taken: Collection[str]) -> Iterator[Effect]:
        """The effects that can be added to those taken: absent ones, and the next of several."""
        for effect in self.values():
            numbers = range(1, MOST_OF_ONE + 1 if effect.several else 2)
            free = (e for e in map(effect.numbered, numbers) if e.name not in taken)
            yield from itertools.islice(free, 1)

    def _unknown(self, name: str) -> str:
        return (
            f"unknown effect '{name}'; {near(name, self._effects)}`twin effects` lists the "
            f"{len(self)} that exist, to which a file of your own can be added"
        )


def load_catalogue(user_files: Sequence[Path | str] | Path | str = ()) -> Catalogue:
    """The effects of this package, and those of the user's own Python file, or files.

    Loading a user's file runs its code, first in a process of its own. Raises InputError where a
    file is missing, has the name of another effect, cannot be run, does not come to an end within
    30 s, or defines no EFFECT.
    """
    names = [m.name for m in pkgutil.iter_modules(__path__)]
    effects = [importlib.import_module(f"{__name__}.{name}").EFFECT for name in names]
    given = [user_files] if isinstance(user_files, str | Path) else user_files
    for path in map(Path, given):
        _require_name(path, Catalogue(effects))
        from twin.isolated import NoAnswer, isolated

        try:
            isolated(_load_and_try, path, seconds=LONGEST_TRIAL, memory=LARGEST_TRIAL)
        except NoAnswer as error:
            raise InputError(f"{path}: {error}") from error
        effects.append(load_effect(path))
    return Catalogue(effects)


def _require_name(path: Path, taken: Catalogue) -> None:
    if not path.is_file():
        raise InputError(f"{path}: no such effect file; give a Python file that defines EFFECT")
    if not path.stem.isidentifier():
        raise InputError(
            f"{path}: '{path.stem}' cannot be the name of an effect; use letters, digits and _"
        )
    if path.stem in taken:
        raise InputError(
            f"{path}: there is an effect '{path.stem}' already; give the file another name"
        )


def _load_and_try(path: Path) -> None:
    """Raise InputError for what is wrong with a file; it may also end the process, or hang."""
    from twin.core.user_effect import (
        require_sound,  # only a user's file needs the compiler to be read
    )

    require_sound(load_effect(path), path)
