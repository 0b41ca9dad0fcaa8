"""Which columns belong to which axis: by what their names share, else by the physics."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from twin.importers.proposal.courses import TableColumn
from twin.importers.proposal.lexicon import Quantity, SignalRole
from twin.importers.proposal.motion import explained
from twin.importers.proposal.names import AXIS_LETTERS, Name
from twin.logs.topics import IDENTIFIER

DRIVING = (Quantity.FORCE, Quantity.CURRENT)
PLAIN = "x"  # an axis that no name tells


def is_position(name: Name) -> bool:
    """Whether a name says that it is a measured position."""
    return name.quantity is Quantity.POSITION and name.role is not SignalRole.ASKED


def is_drive(name: Name) -> bool:
    """Whether a name says that it is a force or a current."""
    return name.quantity in DRIVING and name.role is not SignalRole.PART


def axes_of(names: Mapping[str, Name], columns: Mapping[str, TableColumn]) -> dict[str, list[str]]:
    """Axis -> its columns, and those that no name gives to another axis.

    A word tells axes apart where a position and a force, or a current, have it.
    """
    words = _telling(names)
    place = {c: tuple(w for w in n.axis if w in words) for c, n in names.items()}
    whole = [
        key
        for key in dict.fromkeys(place.values())
        if any(is_position(n) for c, n in names.items() if place[c] == key)
        and any(_may_drive(n) for c, n in names.items() if place[c] == key)
    ]
    if len(whole) > 1 and () in whole:
        whole.remove(())  # of no axis by its name
    if whole == [()] and (told := _by_physics(names, columns)):
        return told
    if whole:
        of_none = [c for c in names if place[c] == ()] if len(whole) == 1 else []
        called = _named(whole)
        return {called[key]: [c for c in names if place[c] == key or c in of_none] for key in whole}
    return _by_physics(names, columns) or {PLAIN: list(names)}


def _may_drive(name: Name) -> bool:
    return is_drive(name) or name.quantity is Quantity.DRIVE


def _telling(names: Mapping[str, Name]) -> frozenset[str]:
    """The words that tell axes apart."""
    positions = {w for n in names.values() if n.quantity is Quantity.POSITION for w in n.axis}
    drives = {w for n in names.values() if _may_drive(n) for w in n.axis}
    return frozenset(positions & drives)


def _named(keys: Sequence[tuple[str, ...]]) -> dict[tuple[str, ...], str]:
    """A name for each axis, of the words that not all have."""
    shared = set.intersection(*(set(key) for key in keys)) if len(keys) > 1 else set()
    out: dict[tuple[str, ...], str] = {}
    for key in keys:
        words = [w for w in key if w not in shared] or list(key)
        letters = [w for w in words if w in AXIS_LETTERS]
        numbers = [w for w in words if w.isdigit()]
        if letters:
            name = letters[-1]
        elif numbers and all(w.isdigit() for w in words):
            name = f"axis{'_'.join(numbers)}"
        else:
            name = "_".join(words)
        name = name if IDENTIFIER.fullmatch(name) else PLAIN
        out[key] = name if name not in out.values() else f"{name}{len(out) + 1}"
    return out


def _by_physics(
    names: Mapping[str, Name], columns: Mapping[str, TableColumn]
) -> dict[str, list[str]]:
    """Axes of two and more positions and forces whose names do not go together."""
    positions = [c for c, n in names.items() if is_position(n) and n.sure]
    drives = [c for c, n in names.items() if is_drive(n)]
    if len(positions) < 2 or len(drives) < 2:
        return {}
    shares = np.array([
        [e.best for e in explained(columns[p].short, [columns[d].short for d in drives])]
        for p in positions
    ])  # fmt: skip
    told = 0.5  # of a force, that the motion of its axis makes, and more than twice any other's
    best = shares.argmax(axis=1)
    sure = {}
    for row, (position, k) in enumerate(zip(positions, best, strict=True)):
        most = np.delete(shares[:, k], row).max()
        if shares[row, k] > max(told, 2.0 * most):
            sure[position] = drives[k]
    if len(sure) < 2:
        return {}
    out = {}
    for number, (position, drive) in enumerate(sure.items(), 1):
        words = names[position].axis
        others = [
            c for c, n in names.items()
            if c not in positions and c not in drives and set(n.axis) & set(words)
        ]  # fmt: skip
        name = "_".join(words)
        own = name if IDENTIFIER.fullmatch(name) else f"axis{number}"
        out[own] = [position, drive, *others]
    return out
