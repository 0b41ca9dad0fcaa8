"""The intervals that a fit found, kept in the model's file so that two files can be compared."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import tomlkit

from twin.errors import InputError

if TYPE_CHECKING:
    from twin.model.machine import AxisModel, MachineModel

Interval = tuple[float, float]

ENTRY = "intervals"  # of the TOML document
ABOVE_FLOOR = "above_floor"
COMMENT = "90 % intervals of the fit that wrote this file; for `twin agree`"


@dataclass(frozen=True)
class AxisIntervals:
    """Low and high ends (90 %) by parameter label, in the parameters' units.

    above_floor: force error of the fit over its noise floor. Where it is large the model is wrong,
    and the ends tell how far the values scatter from one part of the logs to another, no more.
    """

    ends: Mapping[str, Interval]
    above_floor: float


def read_intervals(
    document: Mapping[str, Any], axes: Mapping[str, AxisModel]
) -> dict[str, AxisIntervals]:
    """The intervals in a model's TOML document; raises InputError for one that is none.

    An interval that does not hold its parameter's value belongs to another fit: the value was
    edited afterwards. It is left out.
    """
    found = {}
    for axis, entries in document.get(ENTRY, {}).items():
        if axis not in axes:
            raise InputError(f"{ENTRY}: the model has no axis '{axis}'; it has {', '.join(axes)}")
        values, ends = _values(axes[axis]), {}
        for label, given in entries.items():
            if label == ABOVE_FLOOR:
                continue
            low, high = _ends(label, given)
            if label not in values:
                raise InputError(f"{ENTRY}: axis {axis} has no parameter '{label}'; remove it")
            if low <= values[label] <= high:
                ends[label] = low, high
        found[axis] = AxisIntervals(ends, _ratio(entries.get(ABOVE_FLOOR, 1.0)))
    return found


def _ratio(given: Any) -> float:
    if isinstance(given, int | float) and not math.isnan(given) and given >= 0.0:
        return float(given)
    raise InputError(
        f"{ENTRY}: {ABOVE_FLOOR} = {given}: give force error over noise floor, 0 or more"
    )


def _ends(label: str, ends: Any) -> Interval:
    if (
        isinstance(ends, list)
        and len(ends) == 2
        and all(isinstance(e, int | float) and math.isfinite(e) for e in ends)
        and ends[0] <= ends[1]
    ):
        return float(ends[0]), float(ends[1])
    raise InputError(f"{ENTRY}: {label} = {ends}: give two finite numbers, low and high")


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
