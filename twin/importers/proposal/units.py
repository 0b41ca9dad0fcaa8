"""The units of an axis: as names state them, as the sizes of columns tell, else assumed."""

from __future__ import annotations

import re
from collections.abc import Iterable

import numpy as np

from twin.importers.proposal.courses import TableColumn
from twin.importers.proposal.lexicon import CUSTOMARY, RAW, TURNING, Quantity
from twin.importers.proposal.names import Name, words_of
from twin.importers.proposal.signals import File, ProposedAxis, Signal
from twin.importers.units import COUNTS, find_unit, is_unit
from twin.logs.log import LINEAR_UNITS, ROTARY_UNITS

LENGTHS = ("m", "mm", "um")
ANGLES = ("rad", "deg", "rev")
_KINDS = ("m", "rad", "m/s", "rad/s")
_FAR = {"m": (5.0, "mm"), "rad": (40.0, "deg")}  # what goes farther is taken for the other unit
_ROUND = {360.0: "deg", 2.0 * np.pi: "rad"}  # where an angle comes round
SURE = 1.06  # times as large as it should be, in a unit that nothing but the size tells
SAME = 0.99  # likeness, from which a size tells a unit: a spring's force goes as its position too


def is_raw(unit: str | None) -> bool:
    """Whether a unit needs a scale."""
    return (unit or "").partition("/")[0] in RAW


def is_counted(unit: str) -> bool:
    """Whether a unit is that of a counter."""
    return unit.partition("/")[0] in COUNTS


def turns(axis: ProposedAxis) -> bool:
    """Whether an axis is rotary: by a unit, or by words where no unit is stated."""
    for field, signal in axis.signals.items():
        if LINEAR_UNITS[field] != ROTARY_UNITS[field]:
            unit = signal.name.unit or customary(signal.name)
            if is_unit(unit, ROTARY_UNITS[field]):
                return True
            if is_unit(unit, LINEAR_UNITS[field]):
                return False
    return axis.comes_round or any(TURNING & set(words_of(s.column)) for s in axis.signals.values())


def moves_straight(axis: ProposedAxis) -> bool:
    """Whether an axis is linear: by a unit, or as nothing is counted and nothing says it turns."""
    signals = axis.signals.items()
    if any(LINEAR_UNITS[f] != ROTARY_UNITS[f] and is_unit(s.name.unit, LINEAR_UNITS[f])
           for f, s in signals):  # fmt: skip
        return True
    return not turns(axis) and not is_raw(axis.signals["position"].name.unit)


def customary(name: Name) -> str | None:
    """The unit in which columns of that name usually are."""
    return next((u for code, u in CUSTOMARY.items() if re.search(code, name.column)), None)


def position_unit(file: File, axis: ProposedAxis) -> tuple[str, bool]:
    """The unit of the position, and whether its name states it, or the rate that a name states."""
    position = axis.signals["position"]
    if position.name.unit is not None:
        return position.name.unit, True
    if (parts := position.name.parts) and position.name.is_integral:  # in SI
        return ("rad" if turns(axis) else "m"), file.names[parts[0]].unit is not None
    column = file.column(position.name)
    if (unit := customary(position.name)) or (unit := _ROUND.get(column.wraps or 0.0)):
        return unit, False
    if column.counts:
        return "counts", False
    rotary = turns(axis)
    velocity = axis.signals.get("velocity")
    if velocity and velocity.name.unit and not is_raw(velocity.name.unit) and file.step:
        for unit in ANGLES if rotary else LENGTHS:
            if near(rate_ratio(file, position, velocity, unit, velocity.name.unit), SURE):
                return unit, True
    far, other = _FAR["rad" if rotary else "m"]
    return other if np.ptp(column.short) > far else ("rad" if rotary else "m"), False


def rate_ratio(file: File, position: Signal, velocity: Signal, of: str, unit: str) -> float:
    """A velocity in its unit, over the rate of a position in its own; 0 where that is not told."""
    if file.step is None:
        return 0.0
    samples = file.samples_of_a_rate
    _, one = file.column(position.name).rate(file.column(velocity.name), samples)
    if one == 0.0:
        return 0.0
    return find_unit(unit, *_KINDS).size / (one / file.step * find_unit(of, *_KINDS).size)


def near(ratio: float, times: float) -> bool:
    """Whether a ratio is 1 but for a factor."""
    return 1.0 / times < ratio < times


def unit_as_large(name: Name, slope: float, like: float, unit: str) -> str | None:
    """The unit in which a column is as large as a position that it goes with; None if in none.

    slope: how much of it is one of the position, which is in ``unit``. like: their correlation.
    """
    if name.unit is not None:
        others: Iterable[str] = (name.unit,)
    else:
        others = (unit, *LENGTHS, *ANGLES)
    for other in others:
        if other == unit:
            if near(slope, 1.25):  # by which a soft loop may miss the size of its setpoint
                return other
        elif not is_raw(other) and not is_raw(unit) and (name.unit or like > SAME):
            if not (is_unit(other, *_KINDS) and is_unit(unit, *_KINDS)):
                continue
            if near(slope * find_unit(other, *_KINDS).size / find_unit(unit, *_KINDS).size, SURE):
                return other
    return None


def is_rate(file: File, position: Name, velocity: Name) -> float:
    """How well a column goes with the rate of another, 0 where they agree in no units."""
    how, one = file.column(position).rate(file.column(velocity), 10)
    if file.step is None or one == 0.0:
        return how
    units = [find_unit(u, "m", "rad").size for u in (*LENGTHS, *ANGLES)]
    ratio = abs(one) / file.step
    sizes = {a / b * per for a in units for b in units for per in (1.0, 1.0 / 60.0, 60.0)}
    return how if any(near(ratio / size, 1.03) for size in sizes) else 0.0


def drive_unit(name: Name, column: TableColumn, rotary: bool) -> tuple[str | None, bool]:
    """The unit of a force or current, None where only the user knows it; and whether it is stated.

    A torque beside a length, or a force beside an angle, is one that a scale brings to the axis.
    """
    if name.unit is not None:
        si = ("A", "N m" if rotary else "N")
        known = is_unit(name.unit, *si)
        return (name.unit if known or is_raw(name.unit) else None), True
    if unit := customary(name):
        return unit, True
    if name.quantity in (None, Quantity.DRIVE) or column.whole:
        return None, False
    if name.quantity is Quantity.CURRENT:
        return "A", False
    return ("Nm" if rotary else "N"), False
