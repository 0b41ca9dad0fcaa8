"""The intervals that a fit found, kept in the model's file so that two files can be compared."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import tomlkit

from twin.errors import InputError

if TYPE_CHECKING:
    from twin.model.machine import AxisModel, MachineModel

Interval = tuple[float, float]
Intervals = Mapping[str, Mapping[str, Interval]]  # axis -> label of a parameter -> low, high

ENTRY = "intervals"  # of the TOML document
COMMENT = "90 % intervals of the fit that wrote this file; for `twin agree`"


def read_intervals(
    given: Mapping[str, Mapping[str, Sequence[float]]], axes: Mapping[str, AxisModel]
) -> Intervals:
    """The intervals that a model's file gives; raises InputError for one that is none.

    An interval that does not hold its parameter's value belongs to another fit: the value was
    edited afterwards. It is left out.
    """
    found: dict[str, dict[str, Interval]] = {}
    for axis, entries in given.items():
        if axis not in axes:
            raise InputError(f"{ENTRY}: the model has no axis '{axis}'; it has {', '.join(axes)}")
        values = _values(axes[axis])
        for label, ends in entries.items():
            low, high = _ends(label, ends)
            if label not in values:
                raise InputError(f"{ENTRY}: axis {axis} has no parameter '{label}'; remove it")
            if low <= values[label] <= high:
                found.setdefault(axis, {})[label] = (low, high)
    return found


def _ends(label: str, ends: Sequence[float]) -> Interval:
    if not ends[0] <= ends[1]:
        raise InputError(f"{ENTRY}: {label} = {list(ends)}: give the low end first")
    return ends[0], ends[1]


def _values(axis: AxisModel) -> dict[str, float]:
    """Every parameter of an axis by its label."""
    own = {f"{f.effect.name}.{name}": v for f in axis.effects for name, v in f.values.items()}
    return {axis.mass_parameter.name: axis.mass, **own}


def intervals_table(model: MachineModel) -> tomlkit.items.Table:
    """The intervals of a model as TOML, each with its unit in a comment."""
    table = tomlkit.table(is_super_table=True)
    for axis, intervals in model.intervals.items():
        units = model.axes[axis].units
        entries = tomlkit.table()
        entries.comment(COMMENT)
        for label, ends in intervals.items():
            unit = units(_unit(model.axes[axis], label))
            entries.append(tomlkit.key([label]), tomlkit.item(list(ends)).comment(unit))
        table[axis] = entries
    return table


def _unit(axis: AxisModel, label: str) -> str:
    """Unit of a parameter on a linear axis."""
    effect, _, name = label.rpartition(".")
    return axis[effect].effect.parameter(name).unit if effect else axis.mass_parameter.unit
