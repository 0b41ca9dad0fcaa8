"""A map proposed from a file alone, each entry with its reason; the user corrects and keeps it.

Which columns are which signals of an axis is told by their names, then by their numbers.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import permutations
from pathlib import Path

import numpy as np

from twin.errors import InputError
from twin.importers.importer import table_of
from twin.importers.mapping import EVERY_COLUMN, ImportMap
from twin.importers.table import numbers
from twin.importers.units import find_unit
from twin.logs.container import reading
from twin.logs.log import LINEAR_UNITS, ROTARY_UNITS, Array
from twin.logs.topics import IDENTIFIER
from twin.signals import between, rate

_TIME_WORDS = ("time", "timestamp", "stamp", "t", "zeit", "clock")
_TIME_SIZES = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}
_SLOWEST, _FASTEST = 20.0, 100_000.0  # Hz, of a log that a drive is identified from
_EVEN = 0.01  # of a step; what is less even needs resample
_ALIKE = 0.1  # how far a velocity may be off the rate of its position to be in the same unit
_SPAN = 0.01  # s over which a rate is taken
_RATE = 0.9  # correlation of a column with the rate of another from which it is called that
_FORCE = 0.3  # of the variance of a command that motion explains
_FOLLOWS = 0.95  # correlation of a signal and its setpoint, at the lag of the loop
_LOOP = 0.25  # s, largest lag of a loop that is followed at all

Columns = Mapping[str, Array]
Pair = tuple[str, str, float]  # a position, its rate, and their correlation


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
        own, lags = signal[reach:count], range(-reach, reach + 1)
        shifts = [(_correlation(own, other[reach - k : count - k]), k) for k in lags]
        likeness, ahead = max(shifts)
        if likeness > _FOLLOWS:
            slope = float(np.std(other) / np.std(signal))
            found.append(Leader(name, likeness, ahead * span, slope))
    return sorted(found, key=lambda leader: -leader.likeness)


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
    if "position" not in found and (driven := _driven(columns, left, step)):
        position, why = driven
        found["position"] = Signal(position, unit_in(position), why)
        left.remove(position)
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


def _driven(columns: Columns, names: Sequence[str], step: float) -> tuple[str, str] | None:
    """The position whose motion explains another column as its force, and why it is taken for it.

    Of columns of one course the roughest is measured, and the others are its setpoints.
    """
    best: tuple[float, str, list[str]] = (_RATE, "", [])
    for name in names:
        course = leaders(columns, [n for n in names if n != name], means(columns[name], step), step)
        alike = [name, *(leader.name for leader in course)]
        moved = moved_by(columns, [n for n in names if n not in alike], columns[name], step)
        if moved and moved[1] > best[0]:
            as_large = [leader.name for leader in course if _unit_of(leader, "m")]
            best = moved[1], moved[0], [name, *as_large]
    share, force, alike = best
    if not alike:
        return None
    position = max(alike, key=lambda n: float(np.std(np.diff(columns[n], 2)) / np.std(columns[n])))
    return position, f"its motion explains {100.0 * share:.0f} % of {force}"


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


@dataclass(frozen=True)
class Guess:
    """text: of the map; missing: what the user must add, one sentence each."""

    text: str
    missing: tuple[str, ...]


def guess_map(path: Path) -> Guess:
    """A map for a file of any of the formats; raises InputError where it has no columns."""
    with reading(path):
        table = table_of(path, EVERY_COLUMN)
        columns = _distinct(table.columns)
        if not columns:
            raise InputError("has no column of numbers; give another file")
    time = _time(columns)
    clock, step = _clock(columns, time, table.sample_rate)
    moving = {n: c for n, c in columns.items() if n != time and np.ptp(c) > 0.0}
    head = f"# Proposed from {path.name}; correct what is wrong, above all what is ASSUMED"
    lines, missing, used = [head, *clock], list[str](), {time}
    for axis, names in _axes(moving).items():
        found = signals_of(names, moving, step)
        lines += ["", f"[axes.{axis}]"]
        lines += [_entry(field, found, moving, step) for field in found]
        for field in ("position", "force"):
            if field not in found and not (field == "force" and "current" in found):
                missing.append(f"axis {axis}: no column of {', '.join(names)} looks like a {field}")
                lines.append(f'# {field} = {{column = "?", unit = "?"}} # {missing[-1]}')
        if "current" in found and "force" not in found:
            unit = "N m/A" if turns(found) else "N/A"
            lines.append(f"# force_constant = 1.0 # {unit}: NOT KNOWN, see the motor's data sheet")
        used |= {*names, *(signal.name for signal in found.values())}
        unused = [n for n in names if n not in {signal.name for signal in found.values()}]
        lines += [f"# not used: {', '.join(unused)}"] if unused else []
    others = [_about(n, c) for n, c in table.columns.items() if n not in used]
    lines += ["", *(f"# not used: {other}" for other in others)] if others else []
    return Guess("\n".join(lines) + "\n", tuple(missing))


def _about(name: str, raw: np.ndarray) -> str:
    """A column, or a single value, of no axis: its name and what it holds."""
    try:
        column = numbers(name, raw)
    except InputError:
        return f"{name} (no numbers)"
    if not len(column) or not np.isfinite(column).all():
        return f"{name} (not finite)"
    if np.ptp(column) == 0.0:
        return f"{name} = {column[0]:g}" + (" throughout" if len(column) > 1 else "")
    return f"{name} ({len(column)} rows, {column.min():.4g} to {column.max():.4g})"


def _distinct(raw: Mapping[str, np.ndarray]) -> dict[str, Array]:
    """The columns of numbers, each once: an entry of an array that has a name goes by that."""
    out: dict[str, Array] = {}
    named = {(n.rpartition(".")[0], np.asarray(c).tobytes()) for n, c in raw.items()}
    for name, values in raw.items():
        try:
            column = numbers(name, values)
        except InputError:
            continue
        again = name.endswith("]") and (name.rpartition("[")[0], values.tobytes()) in named
        if len(column) > 2 and np.isfinite(column).all() and not again:
            out[name] = column
    longest = max((len(c) for c in out.values()), default=0)
    return {name: column for name, column in out.items() if len(column) == longest}


def _time(columns: Columns) -> str | None:
    """The column of time stamps: it rises, and is called so or rises evenly."""
    rising = {n: c for n, c in columns.items() if np.mean(np.diff(c) > 0.0) > 0.9}
    called = [n for n in rising if set(words_of(n)) & set(_TIME_WORDS)]
    even = [n for n, c in rising.items() if np.ptp(np.diff(c)) < 0.5 * np.median(np.diff(c))]
    return next(iter([*called, *even]), None)


def _clock(columns: Columns, time: str | None, stated: float | None) -> tuple[list[str], float]:
    """The lines of the clock, and the step in s."""
    if stated is not None:
        return [f"# the file states its sample rate: {stated:g} Hz"], 1.0 / stated
    if time is None:
        return ["sample_rate = 1000.0 # Hz, ASSUMED: no column rises as times do"], 1e-3
    steps = np.diff(columns[time])
    step = float(np.median(steps[steps > 0.0]))
    unit, reason = unit_in(time), "its name states the unit"
    if unit is None or not is_unit(unit, "s"):
        fits = [u for u, size in _TIME_SIZES.items() if _SLOWEST <= size / step <= _FASTEST]
        unit = fits[0] if fits else "s"
        reason = f"that is {_TIME_SIZES[unit] / step:.6g} Hz"
    seconds = step * find_unit(unit, "s").size
    lines = [f"time = {_table(time, unit)} # rises by {step:.6g} {unit}: {reason}"]
    if np.abs(steps - step).max() > _EVEN * step:
        rate = float(f"{1.0 / seconds:.2g}")
        spread = f"{steps.min():.4g} to {steps.max():.4g} {unit}"
        lines.append(f"resample = {rate:g} # Hz, because the steps are uneven: {spread}")
    return lines, seconds


def _axes(columns: Columns) -> dict[str, list[str]]:
    """Columns by axis: what a name has beside the words of signals and units tells the axis."""
    told = (*WORDS.values(), ASKED, OTHER)
    every = {w for words in told for w in words if len(w) > 1}
    out: dict[str, list[str]] = {}
    for name in columns:
        rest = [w for w in words_of(bare(name)) if w not in every]
        letters = [w for w in rest if w in ("x", "y", "z")]
        digits = re.findall(r"\d+", name.rpartition("/")[2])
        axis = letters[0] if letters else f"axis{digits[-1]}" if digits else (rest or ["x"])[-1]
        out.setdefault(axis, []).append(name)
    whole = {}
    for axis, names in out.items():
        found = named(names).keys()
        if IDENTIFIER.fullmatch(axis) and "position" in found and {"force", "current"} & found:
            whole[axis] = names
    return whole or {"x": list(columns)}


def _entry(field: str, found: Mapping[str, Signal], columns: Columns, step: float) -> str:
    """One line of the map, with the reason behind it."""
    signal, position = found[field], found.get("position")
    column = columns[signal.name]
    span = f"{signal.reason}; {column.min():.4g} to {column.max():.4g}"
    units = ROTARY_UNITS if turns(found) else LINEAR_UNITS
    if is_unit(signal.unit, units[field]):
        return f"{field} = {_table(signal.name, signal.unit)} # {span}"
    unit, why = assumed(units[field], column), ""
    if field.endswith("velocity") and position is not None:
        base = position.unit or assumed(units["position"], columns[position.name])
        unit = f"{base}/s"
        moved, given = rates(columns[position.name], step), means(column, step)
        ratio = float(moved @ given / (given @ given))
        if field == "velocity" and abs(ratio - 1.0) > _ALIKE:
            why = f", but one of it is {ratio:.3g} {unit} by the position: correct one of the units"
    return f"{field} = {_table(signal.name, unit)} # {span}; unit ASSUMED{why}"


def _table(name: str, unit: str | None) -> str:
    return f"{{column = {json.dumps(name)}, unit = {json.dumps(unit, ensure_ascii=False)}}}"


def doubts_of(mapping: ImportMap) -> Iterator[str]:
    """What a map lacks, and units that the names of its columns state otherwise, in brackets."""
    for name, axis in mapping.axes.items():
        for field, column in axis.columns.items():
            found = _UNIT_IN_NAME.search(column.name)
            stated = found and found[1]
            if column.scale != 1.0 or not stated or not is_unit(stated, *_KINDS):
                continue
            unit = find_unit(stated, *_KINDS)
            if unit.si != column.si.si or not np.isclose(unit.size, column.si.size):
                yield (
                    f"axes.{name}.{field}: its column '{column.name}' is in {stated} by its name, "
                    f"in {column.unit} by the map; correct one of them"
                )
        if "force" not in axis.columns and axis.force_constant is None:
            yield (
                f"axes.{name}: has a current and no force_constant, so no force; add it to the map "
                "(N/A, see the motor's data sheet)"
            )
