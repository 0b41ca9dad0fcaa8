"""A position that a file has as its set point and by how much it is off it, or as its velocity."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from twin.importers.proposal.axes import DRIVING
from twin.importers.proposal.lexicon import ERRORS, RAW, Quantity, SignalRole
from twin.importers.proposal.names import Name, names_of, unit_of, words_of
from twin.importers.units import find_unit
from twin.logs.log import Array


@dataclass(frozen=True)
class MadePosition:
    """A position (n,) in the unit of its set point, and the column that is in it as well.

    Of the integral of a velocity, in SI, no other column is.
    """

    name: Name
    values: Array
    error: str | None = None


def made_positions(columns: Mapping[str, Array], step: float) -> list[MadePosition]:
    """The positions of axes that have a set point and its error alone, or a velocity.

    columns: (n,) by name. step: s a sample.
    """
    names = names_of([*columns])
    known = [n for n in names.values() if n.quantity is Quantity.POSITION]
    asked = [n for n in known if n.role is SignalRole.ASKED]
    made = []
    for setpoint in asked:
        errors = [n for n in names.values() if _is_error_of(n, setpoint)]
        if len(errors) == 1 and not _has_position(setpoint, errors[0], names, columns):
            made.append(_made(setpoint, errors[0], columns))
    return made or [_integral(rate, columns, step) for rate in _rates_alone(names, columns)]


def _rates_alone(names: Mapping[str, Name], columns: Mapping[str, Array]) -> list[Name]:
    """The measured velocity of each axis, where nothing is called a position or goes as one."""
    if any(n.quantity is Quantity.POSITION for n in names.values()):
        return []
    rates = [n for n in names.values() if n.quantity is Quantity.VELOCITY and (n.sure or n.unit)
             and n.role is not SignalRole.ASKED and n.unit not in RAW]  # fmt: skip
    rates.sort(key=lambda n: (n.role is not SignalRole.MEASURED, n.smoothed))
    one_each = {rate.axis: rate for rate in reversed(rates)}
    drives = [n for n in names.values() if n.quantity in (*DRIVING, Quantity.DRIVE)]
    unnamed = [columns[n.column] for n in names.values() if n.quantity is None]
    found = [r for r in one_each.values()
             if not any(_goes_as(np.cumsum(columns[r.column]), c) for c in unnamed)]  # fmt: skip
    return found if drives else []


def _goes_as(one: Array, other: Array) -> bool:
    """Whether columns (n,) go alike, as a motion and its own set point."""
    return abs(float(np.corrcoef(one, other)[0, 1])) > 0.95


def _integral(rate: Name, columns: Mapping[str, Array], step: float) -> MadePosition:
    size = find_unit(rate.unit, "m/s", "rad/s").size if rate.unit else 1.0
    values = size * step * np.cumsum(columns[rate.column])
    name = Name(
        f"{rate.column} integrated", Quantity.POSITION, SignalRole.MEASURED, None, rate.axis, True,
        False, (rate.column, "integrated", None),
    )  # fmt: skip
    return MadePosition(name, values)


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
        if _goes_as(goes, columns[other]):
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
