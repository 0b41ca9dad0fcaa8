"""A map proposed from a file alone, each entry with its reason; the user corrects and keeps it.

Which columns are which signals of an axis is told by their names, then by their numbers.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from twin.errors import InputError
from twin.importers.clock import find_clock
from twin.importers.course import (
    RATE,
    Columns,
    Leader,
    Pair,
    leaders,
    likeness_to_rate,
    means,
    moved_by,
    rate_of_another,
    rates,
)
from twin.importers.importer import table_of
from twin.importers.mapping import EVERY_COLUMN, ImportMap
from twin.importers.table import SignalTable, numbers
from twin.importers.units import find_unit, is_unit, raw_unit
from twin.logs.container import reading
from twin.logs.log import LINEAR_UNITS, ROTARY_UNITS, Array
from twin.logs.topics import IDENTIFIER

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
_UNIT_IN_NAME = re.compile(r"[\[(]\s*([^\])]*[^\])\s\d][^\])]*?)\s*[\])]\s*$"
                           r"|[_ ]([A-Za-z]+_s2?|[A-Za-z/0-9^]+)$")  # fmt: skip
_FAR = {"m": (5.0, "mm"), "rad": (40.0, "deg")}  # what goes farther is taken for the other unit
# What is assumed of an encoder: counts of 1 um, and some thousand a turn
_COUNT = {"m": "counts_per_metre = 1000000", "rad": "counts_per_turn = 4096"}
_COUNT |= {"m/s": _COUNT["m"], "rad/s": _COUNT["rad"]}
_COMMON = ("m", "mm", "um", "rad", "deg")  # units in which one column may be, its copy in another
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
            key = f"setpoint_{field}" if asked else field
            fitting = []
            for name, own in left.items():
                if _is_other(name, key):
                    continue
                places = [words.index(w) for w in own if w in words]
                if asked and field == "position" and set(own) <= set(ASKED):
                    places.append(0)  # qg, goal: of what, is not said
                if places and bool(set(own) & set(ASKED)) is asked:
                    fitting.append((min(places), name))
            if fitting:
                name = min(fitting)[1]
                del left[name]
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
    measured = columns[found["position"].name]
    for field in ("velocity", "setpoint_velocity"):
        called = found.get(field)
        # least correlation with the rate of a position of what is called one
        if called and likeness_to_rate(measured, columns[called.name], step) < 0.3:
            left.append(found.pop(field).name)
    left = _with_setpoints(found, left, columns, step)
    forces = [n for n in left if not (_is_other(n, "force") and _is_other(n, "current"))]
    known = {"force", "current"} & found.keys()
    if not known and (moved := moved_by(columns, forces, measured, step)):
        why = f"the motion explains {100.0 * moved[1]:.0f} % of it"
        unit = unit_in(moved[0])
        found["current" if is_unit(unit, "A") else "force"] = Signal(moved[0], unit, why)
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
    best: tuple[float, str, list[str]] = (RATE, "", [])
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
        # and least correlation then: a force that a spring makes may be as large by chance
        same = 0.99
        if other == unit:
            as_large = 1.25  # times, by which a soft loop may miss the size of its setpoint
            off, most = leader.slope, as_large
        elif is_unit(other, *kinds) and (stated or leader.likeness > same):
            sure = 1.06  # the same, where another unit must be what makes the difference,
            off, most = leader.slope * find_unit(other, *kinds).size / size, sure
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


def unit_in(name: str, *kinds: str) -> str | None:
    """The unit that a name ends with; a word behind a blank or _ need not be one.

    kinds: SI units of what it may be, those of all signals if none.
    """
    found = _UNIT_IN_NAME.search(name)
    bracketed, word = found.groups() if found else (None, None)
    word = (word or "").replace("_", "/")  # mm_s
    counted = len(word) > 1 and raw_unit(word)  # one letter, or the number of an axis, is none
    return bracketed or (word if counted or is_unit(word, *(kinds or _KINDS)) else None)


def _is_other(name: str, field: str) -> bool:
    """Whether the unit in a name is that of another signal; one letter is sure in brackets only."""
    unit = unit_in(name) or ""
    sure = len(unit) > 1 or name.endswith(("]", ")"))
    own = LINEAR_UNITS[field], ROTARY_UNITS[field]
    return sure and is_unit(unit, *_KINDS) and not is_unit(unit, *own)


def bare(name: str) -> str:
    """A name less its unit; all of it where that is all."""
    return (_UNIT_IN_NAME.sub("", name) or name) if unit_in(name) else name


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
        columns, holes = _distinct(table)
        if not columns:
            raise InputError("has no column of numbers; give another file")
    clock = find_clock(table, columns)
    step = clock.step
    moving = {n: c for n, c in columns.items() if n not in clock.used and np.ptp(c) > 0.0}
    head = f"# Proposed from {path.name}; correct what is wrong, above all what is ASSUMED"
    lines, used = [head, *clock.lines], set(clock.used)
    missing = [*clock.missing, *(holes[n] for n in clock.used if n in holes)]
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
        taken = {signal.name for signal in found.values()}
        lines += _unused([n for n in names if n not in taken], found, moving, step)
        missing += [holes[n] for n in columns if n in holes and n in taken]
        used |= {*names, *taken}
    left = {n: c for n, c in table.columns.items() if n not in used}
    others = [_about(n, c) + ", of no axis by its name" * (n in moving) for n, c in left.items()]
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


def _unused(
    names: Sequence[str], found: Mapping[str, Signal], columns: Columns, step: float
) -> list[str]:
    """Lines with the columns of an axis that are none of its signals, by what keeps them."""
    kept: dict[str, list[str]] = {}
    for name in names:
        kept.setdefault(_why_not(name, found, columns, step), []).append(name)
    return [f"# not used: {', '.join(alike)}: {why}" for why, alike in kept.items()]


def _why_not(name: str, found: Mapping[str, Signal], columns: Columns, step: float) -> str:
    field = next(iter(named([name])), "")
    if field in found:
        return f"{found[field].name} is taken for the {field}"
    if field in ("velocity", "setpoint_velocity") and "position" in found:
        position = found["position"].name
        like = likeness_to_rate(columns[position], columns[name], step)
        return f"correlates with the rate of {position} by {like:.2f} only"
    return "neither name nor course tells a signal"


def _distinct(table: SignalTable) -> tuple[dict[str, Array], dict[str, str]]:
    """The columns of numbers, each once, and where a straight line is across a hole in one.

    An entry of an array that has a name goes by that.
    """
    raw, out, holes = table.columns, dict[str, Array](), dict[str, str]()
    named = {(n.rpartition(".")[0], np.asarray(c).tobytes()) for n, c in raw.items()}
    for name, values in raw.items():
        try:
            column = numbers(name, values)
        except InputError:
            continue
        again = name.endswith("]") and (name.rpartition("[")[0], values.tobytes()) in named
        finite = np.flatnonzero(np.isfinite(column))
        if len(column) > 2 and 2 * len(finite) > len(column) and not again:  # else of another clock
            if hole := table.hole(name, column):
                holes[name] = hole
                column = np.interp(np.arange(len(column)), finite, column[finite])
            out[name] = column
    longest = max((len(c) for c in out.values()), default=0)
    return {name: column for name, column in out.items() if len(column) == longest}, holes


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
    counted = signal.unit if raw_unit(signal.unit) else None
    if position and field.endswith("velocity") and signal.unit in (None, f"{position.unit}/s"):
        counted = signal.unit or (raw_unit(position.unit) and f"{position.unit}/s")
    if counted:
        per = _COUNT.get(units[field], "scale = 1")
        entry = _table(signal.name, counted).replace("}", f", {per}}}")
        return f"{field} = {entry} # {span}; {per.partition(' ')[0]} ASSUMED"
    unit, why = assumed(units[field], column), ""
    if field.endswith("velocity") and position is not None:
        base = position.unit or assumed(units["position"], columns[position.name])
        unit = f"{base}/s"
        moved, given = rates(columns[position.name], step), means(column, step)
        ratio = float(moved @ given / (given @ given))
        alike = 0.1  # how far a velocity may be off the rate of its position to be in the same unit
        if field == "velocity" and abs(ratio - 1.0) > alike:
            why = f", but one of it is {ratio:.3g} {unit} by the position: correct one of the units"
    return f"{field} = {_table(signal.name, unit)} # {span}; unit ASSUMED{why}"


def _table(name: str, unit: str | None) -> str:
    column, text = (json.dumps(value, ensure_ascii=False) for value in (name, unit))
    return f"{{column = {column}, unit = {text}}}"


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
