"""The intervals of a model in its file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import tomlkit

from twin.errors import InputError
from twin.model.intervals import AxisIntervals, Interval
from twin.model.machine import AxisModel, MachineModel

ENTRY = "intervals"  # of the TOML document
ABOVE_FLOOR = "above_floor"
COMMENT = "90 % intervals of the fit that wrote this file; for `twin agree`"


def read_intervals(
    given: Mapping[str, Mapping[str, Sequence[float] | float]], axes: Mapping[str, AxisModel]
) -> dict[str, AxisIntervals]:
    """The intervals that a model's file gives; raises InputError for one that is none.

    An interval that does not hold its parameter's value belongs to another fit: the value was
    edited afterwards. It is left out.
    """
    found = {}
    for axis, entries in given.items():
        if axis not in axes:
            raise InputError(f"{ENTRY}: the model has no axis '{axis}'; it has {', '.join(axes)}")
        values, ends = _values(axes[axis]), {}
        for label, pair in entries.items():
            if label == ABOVE_FLOOR:
                continue
            low, high = _ends(label, pair)
            if label not in values:
                raise InputError(f"{ENTRY}: axis {axis} has no parameter '{label}'; remove it")
            if low <= values[label] <= high:
                ends[label] = low, high
        found[axis] = AxisIntervals(ends, _ratio(entries.get(ABOVE_FLOOR, 1.0)))
    return found


def _ratio(given: Sequence[float] | float) -> float:
    if isinstance(given, float):
        return given
    raise InputError(f"{ENTRY}: {ABOVE_FLOOR} = {given}: give one number, error over noise floor")


def _ends(label: str, ends: Sequence[float] | float) -> Interval:
    if isinstance(ends, float) or not ends[0] <= ends[1]:
        raise InputError(f"{ENTRY}: {label} = {ends}: give two numbers, the low one first")
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
        meaning = units.words("1, force error over noise floor")
        entries[ABOVE_FLOOR] = tomlkit.item(intervals.above_floor).comment(meaning)
        for label, ends in intervals.ends.items():
            unit = units(_unit(model.axes[axis], label))
            entries.append(tomlkit.key([label]), tomlkit.item(list(ends)).comment(unit))
        table[axis] = entries
    return table


def _unit(axis: AxisModel, label: str) -> str:
    """Unit of a parameter on a linear axis."""
    effect, _, name = label.rpartition(".")
    return axis[effect].effect.parameter(name).unit if effect else axis.mass_parameter.unit
