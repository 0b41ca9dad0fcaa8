"""The commands that a page may ask for: those of the loop, on files of the project alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from identify.app.guard import inside
from twin.errors import InputError

# By command, the options that a page gives. None loads code, none writes where it pleases but
# those of OUTPUTS, which are looked at as every other name of a file.
ALLOWED: Mapping[str, frozenset[str]] = {
    "import": frozenset({"--map", "--set", "--yes"}),
    "new": frozenset({"--mjcf", "--mass"}),
    "fit": frozenset(),
    "compare": frozenset(),
    "diagnose": frozenset(),
    "add": frozenset({"--axis", "--found", "--shape"}),
    "remove": frozenset({"--axis"}),
    "plan": frozenset({"--between", "--axis", "--duration"}),
    "simulate": frozenset({"--setpoints", "--seed"}),
    "view": frozenset({"--html"}),
    "export": frozenset({"--to"}),
    "feedforward": frozenset(),
    "frf": frozenset(),
    "check": frozenset(),
    "cut": frozenset({"--from", "--to"}),
    "undo": frozenset(),
    "project": frozenset({"--to"}),
    "fleet": frozenset({"--store", "--out"}),
}
SUBCOMMANDS = {"project": ("role", "take", "leave"), "fleet": ("report",)}


def checked(root: Path, words: object) -> list[str]:
    """The words of a command; raises InputError where it is none that a page may ask for."""
    if not isinstance(words, list) or not all(isinstance(w, str) and w for w in words) or not words:
        raise InputError("a command is a list of words")
    name, *rest = words
    if name not in ALLOWED:
        raise InputError(f"{name}: is no command that a page may ask for")
    below = SUBCOMMANDS.get(name)
    if below and (not rest or rest[0] not in below):
        raise InputError(f"{name}: give {' or '.join(below)}")
    _check(root, rest, ALLOWED[name])
    return [name, *rest]


def _check(root: Path, words: Sequence[str], allowed: frozenset[str]) -> None:
    is_entry = False
    for word in words:
        if word.startswith("-") and not _is_number(word):
            if word not in allowed:
                raise InputError(f"{word}: is no option that a page may give")
            is_entry = word == "--set"
        elif not is_entry and ("/" in word or "\\" in word or (root / word).exists()):
            inside(root, word)


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True
