"""A position that a file has as its set point, and by how much the axis is off it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from twin.importers.proposal.lexicon import ERRORS, Quantity, SignalRole
from twin.importers.proposal.names import Name, names_of, unit_of, words_of
from twin.logs.log import Array


@dataclass(frozen=True)
class MadePosition:
    """A position (n,) in the unit of its set point, and the column that is in it as well."""

    name: Name
    values: Array
    error: str


def made_positions(columns: Mapping[str, Array]) -> list[MadePosition]:
    """The positions of axes that have a set point and its error alone; columns: (n,) by name."""
    names = names_of([*columns])
    known = [n for n in names.values() if n.quantity is Quantity.POSITION]
    asked = [n for n in known if n.role is SignalRole.ASKED]
    made = []
    for setpoint in asked:
        errors = [n for n in names.values() if _is_error_of(n, setpoint)]
        if len(errors) == 1 and not _has_position(setpoint, errors[0], names, columns):
            made.append(_made(setpoint, errors[0], columns))
    return made


def _is_error_of(name: Name, setpoint: Name) -> bool:
    if name.quantity is not Quantity.OTHER or not ERRORS & set(words_of(name.column)):
        return False
    stated = unit_of(name.column), unit_of(setpoint.column)
    return name.axis == setpoint.axis and (stated[0] is None or stated[0] == stated[1])


def _has_position(
    setpoint: Name, error: Name, names: Mapping[str, Name], columns: Mapping[str, Array]
) -> bool:
    """Whether another column is called the position, or goes as the set point does."""
    goes = columns[setpoint.column]
    for other, name in names.items():
        if name is setpoint or name is error:
            continue
        called = name.quantity is Quantity.POSITION and name.role is not SignalRole.ASKED
        if called and name.axis == setpoint.axis:
            return True
        if abs(np.corrcoef(goes, columns[other])[0, 1]) > 0.95:  # as a motion and its own set point
            return True
    return False


def _made(setpoint: Name, error: Name, columns: Mapping[str, Array]) -> MadePosition:
    """An axis is behind its set point: what is positive as that rises is to be taken off."""
    goal, off = columns[setpoint.column], columns[error.column]
    behind = float(np.dot(np.diff(goal), off[1:])) > 0.0
    word, values = ("less", goal - off) if behind else ("plus", goal + off)
    column = f"{setpoint.column} {word} {error.column}"
    name = Name(
        column, Quantity.POSITION, SignalRole.MEASURED, setpoint.unit, setpoint.axis, True, False,
        (setpoint.column, word, error.column),
    )  # fmt: skip
    return MadePosition(name, values, error.column)
