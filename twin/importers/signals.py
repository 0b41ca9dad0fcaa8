"""Which columns of a file are which signals of an axis: by their names, then by their numbers."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import permutations

import numpy as np

from twin.errors import InputError
from twin.importers.units import find_unit
from twin.logs.log import LINEAR_UNITS, ROTARY_UNITS, Array
from twin.signals import between, rate

Columns = Mapping[str, Array]
Pair = tuple[str, str, float]

_SPAN = 0.01  # s over which a rate is taken
_RATE = 0.9  # correlation of a column with the rate of another from which it is called that
_FORCE = 0.3  # of the variance of a command that motion explains
_FOLLOWS = 0.95  # correlation of a signal and its setpoint, at the lag of the loop
_LOOP = 0.25  # s, largest lag of a loop that is followed at all


def rate_of_another(columns: Columns, names: Sequence[str], step: float) -> Pair | None:
    """A column, the one that is its rate, and their correlation; None where no two are so."""
    found = [
        (abs(_correlation(rates(columns[x], step), means(columns[v], step))), x, v)
        for x, v in permutations(names, 2)
    ]
    how, position, velocity = max(found, default=(0.0, "", ""))
    return (position, velocity, how) if how > _RATE else None


@dataclass(frozen=True)
class Leader:
    """A column of the same course as a signal: its setpoint, or a second reading of it.

    ahead: s, by which it is ahead of the signal. slope: how much of it is one of the signal.
    """

    name: str
    likeness: float
    ahead: float
    slope: float


def leaders(columns: Columns, names: Sequence[str], signal: Array, step: float) -> list[Leader]:
    """Columns that have the course of a signal (k,), as of ``means``, the likest first.

    At some lag of a loop. The force that moves a mass does not: it goes with the acceleration and,
    by friction, with the sign of the velocity. That of a spring does, but in another size.
    """
    span = _width(step) * step
    reach = min(round(_LOOP / span), len(signal) // 4)
    found = []
    for name in names:
        other = means(columns[name], step)
        count = min(len(signal), len(other)) - reach
        shifts = [
            (_correlation(signal[reach:count], other[reach - k : count - k]), k)
            for k in range(-reach, reach + 1)
        ]
        likeness, ahead = max(shifts)
        if likeness > _FOLLOWS:
            slope = float(np.std(other) / np.std(signal))
            found.append(Leader(name, likeness, ahead * span, slope))
    return sorted(found, key=lambda leader: -leader.likeness)


def ratio_of_rates(position: Array, velocity: Array, step: float) -> float:
    """How many of the position's unit a second one of the velocity's is."""
    rate, given = rates(position, step), means(velocity, step)
    return float(rate @ given / (given @ given))


def moved_by(
    columns: Columns, names: Sequence[str], position: Array, step: float
) -> tuple[str, float] | None:
    """The column that the motion explains best as a force, and the share of its variance."""
    velocity, middle = rates(position, step), means(position, step)
    acceleration, one = rate(velocity, _width(step) * step), np.ones_like(middle)
    rows = np.column_stack([acceleration, velocity, np.sign(velocity), middle, one])
    rows /= np.abs(rows).max(axis=0) + np.finfo(float).tiny
    found = []
    for name in names:
        force = means(columns[name], step)
        left = force - rows @ np.linalg.lstsq(rows, force, rcond=1e-10)[0]
        found.append((1.0 - float(np.var(left) / np.var(force)), name))
    share, best = max(found, default=(0.0, ""))
    return (best, share) if share > _FORCE else None


def _width(step: float) -> int:
    return max(round(_SPAN / step), 1)


def rates(column: Array, step: float) -> Array:
    """(k,) rate over each span of 0.01 s, a second."""
    return between(column[:: _width(step)], _width(step) * step)


def means(column: Array, step: float) -> Array:
    """(k,) mean over each such span."""
    width = _width(step)
    count = (len(column) - 1) // width
    return np.asarray(column[: count * width].reshape(count, width).mean(axis=1))


def _correlation(a: Array, b: Array) -> float:
    n = min(len(a), len(b))
    a, b = a[:n] - a[:n].mean(), b[:n] - b[:n].mean()
    size = np.sqrt(float(a @ a) * float(b @ b))
    return float(a @ b) / size if size > 0.0 else 0.0


# Words that name a signal, the surest first.
WORDS: Mapping[str, tuple[str, ...]] = {
    "position": ("position", "pos", "displacement", "encoder", "enc", "angle", "theta", "qm", "q",
                 "x", "y"),
    "velocity": ("velocity", "velo", "vel", "speed", "qd", "dq"),
    "force": ("force", "torque", "effort", "tau", "moment", "f"),
    "current": ("current", "iq", "cur", "amps", "i"),
}  # fmt: skip
ASKED = ("setpoint", "reference", "target", "desired", "demand", "command", "ref", "set", "cmd",
          "goal", "qg", "sp", "soll")  # fmt: skip
OTHER = ("act", "actual", "measured", "main", "axis", "data", "joint", "states", "state",
         "present")  # fmt: skip
_TURNING = ("torque", "effort", "tau", "moment", "angle", "theta")
_UNIT_IN_NAME = re.compile(r"[\[(]\s*([^\])]*[^\])\s\d][^\])]*?)\s*[\])]\s*$|[_ ]([A-Za-z/0-9^]+)$")
_FAR = {"m": (5.0, "mm"), "rad": (40.0, "deg")}  # what goes farther is taken for the other unit
_COMMON = ("m", "mm", "um", "rad", "deg")  # units in which one column may be, its copy in another
_AS_LARGE = 1.25  # times, by which a soft loop may miss the size of its setpoint
_SURE = 1.06  # the same, where another unit must be what makes the difference,
_SAME = 0.99  # and least correlation then: a force that a spring makes may be as large by chance
_KINDS = tuple(dict.fromkeys((*LINEAR_UNITS.values(), *ROTARY_UNITS.values())))


@dataclass(frozen=True)
class Signal:
    """A column that was taken for a signal, and why; unit: None where its name states none."""

    name: str
    unit: str | None
    reason: str


def words_of(name: str) -> list[str]:
    spaced = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", " ", name)
    return re.findall(r"[a-z]+", spaced.lower())


def named(names: Sequence[str]) -> dict[str, Signal]:
    """The signals that names tell, the surest name first."""
    found: dict[str, Signal] = {}
    left = {name: words_of(bare(name)) for name in names}
    for field, words in WORDS.items():
        for asked in (False, True) if field in ("position", "velocity") else (False,):
            fitting = []
            for name, own in left.items():
                places = [words.index(w) for w in own if w in words]
                if asked and field == "position" and set(own) <= set(ASKED):
                    places.append(0)  # qg, goal: of what, is not said
                if places and bool(set(own) & set(ASKED)) is asked:
                    fitting.append((min(places), name))
            if fitting:
                name = min(fitting)[1]
                del left[name]
                key = f"setpoint_{field}" if asked else field
                found[key] = Signal(name, unit_in(name), "so called")
    return found


def signals_of(names: Sequence[str], columns: Columns, step: float) -> dict[str, Signal]:
    """The signals that names tell, and those that the numbers tell."""
    found = named(names)
    left = [n for n in names if n not in {signal.name for signal in found.values()}]
    if "position" not in found and (pair := _moved(columns, left, step)):
        position, velocity, how = pair
        why = f"{velocity} is its rate ({how:.2f})"
        found["position"] = Signal(position, unit_in(position), why)
        found.setdefault("velocity", Signal(velocity, unit_in(velocity), f"the rate of {position}"))
        left = [n for n in left if n not in pair]
    if "position" not in found:
        return found
    left = _with_setpoints(found, left, columns, step)
    known = {"force", "current"} & found.keys()
    if not known and (moved := moved_by(columns, left, columns[found["position"].name], step)):
        why = f"the motion explains {100.0 * moved[1]:.0f} % of it"
        found["force"] = Signal(moved[0], unit_in(moved[0]), why)
    return found


def _moved(columns: Columns, names: Sequence[str], step: float) -> Pair | None:
    """The position and its rate, and their correlation: of two pairs that go alike the later."""
    pair = rate_of_another(columns, names, step)
    others = [n for n in names if pair and n not in pair]
    other = rate_of_another(columns, others, step)
    if pair is None or other is None:
        return pair
    alike = leaders(columns, others, means(columns[pair[0]], step), step)
    return other if other[0] in {one.name for one in alike if one.ahead < 0.0} else pair


def _with_setpoints(
    found: dict[str, Signal], names: Sequence[str], columns: Columns, step: float
) -> list[str]:
    """The setpoints that the numbers tell are added; the names of what is no kind of motion."""
    position, left = found["position"], list(names)
    unit = position.unit or assumed("rad" if turns(found) else "m", columns[position.name])
    column = columns[position.name]
    for field, signal, of in (
        ("position", means(column, step), unit),
        ("velocity", rates(column, step), f"{unit}/s"),
    ):
        alike = [(leader, u) for leader in leaders(columns, left, signal, step)
                 if (u := _unit_of(leader, of))]  # fmt: skip
        if alike:
            leader, own = alike[0]
            side = "ahead of" if leader.ahead >= 0.0 else "behind"
            lag = f"{abs(leader.ahead) * 1e3:.3g} ms {side} it"
            why = f"goes as the {field}, {lag}, as large in {own}"
            found.setdefault(f"setpoint_{field}", Signal(leader.name, own, why))
        left = [n for n in left if n not in {leader.name for leader, _ in alike}]
    return left


def _unit_of(leader: Leader, unit: str) -> str | None:
    """The unit in which a column is as large as the one that it goes with; None where in none."""
    rate = "".join(unit.partition("/")[1:])
    kinds = ("m/s", "rad/s") if rate else ("m", "rad")
    size = find_unit(unit, *kinds).size if is_unit(unit, *kinds) else 1.0
    stated = unit_in(leader.name)
    for other in [stated] if stated else [unit, *(u + rate for u in _COMMON)]:
        if other == unit:
            off, most = leader.slope, _AS_LARGE
        elif is_unit(other, *kinds) and (stated or leader.likeness > _SAME):
            off, most = leader.slope * find_unit(other, *kinds).size / size, _SURE
        else:
            continue
        if 1.0 / most < off < most:
            return other
    return None


def turns(found: Mapping[str, Signal]) -> bool:
    """Whether the axis is rotary: by a unit, or by words where no unit is stated."""
    for field, signal in found.items():
        if LINEAR_UNITS[field] != ROTARY_UNITS[field]:
            if is_unit(signal.unit, ROTARY_UNITS[field]):
                return True
            if is_unit(signal.unit, LINEAR_UNITS[field]):
                return False
    return any(set(words_of(signal.name)) & set(_TURNING) for signal in found.values())


def unit_in(name: str) -> str | None:
    """The unit that a name ends with; a word behind a blank or _ need not be one."""
    found = _UNIT_IN_NAME.search(name)
    bracketed, word = found.groups() if found else (None, None)
    return bracketed or (word if word and is_unit(word, *_KINDS) else None)


def bare(name: str) -> str:
    """A name less its unit; all of it where that is all."""
    return (_UNIT_IN_NAME.sub("", name) or name) if unit_in(name) else name


def is_unit(unit: str | None, *kinds: str) -> bool:
    try:
        return unit is not None and find_unit(unit, *kinds).si is not None
    except InputError:
        return False


def assumed(si: str, column: Array) -> str:
    far, other = _FAR.get(si, (np.inf, si))
    return other if np.ptp(column) > far else si
