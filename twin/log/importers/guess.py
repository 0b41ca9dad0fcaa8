"""A map proposed from a file alone, each entry with its reason; the user corrects and keeps it."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from twin.errors import InputError
from twin.log.container import reading
from twin.log.importers.importer import table_of
from twin.log.importers.mapping import ImportMap
from twin.log.importers.relations import moved_by, rate_of_another, ratio_of_rates
from twin.log.importers.table import numbers
from twin.log.importers.units import find_unit
from twin.log.log import LINEAR_UNITS, ROTARY_UNITS, Array
from twin.log.topics import IDENTIFIER

# Words that name a signal, the surest first.
_WORDS: Mapping[str, tuple[str, ...]] = {
    "position": ("position", "pos", "displacement", "encoder", "enc", "angle", "theta", "qm", "q",
                 "x", "y"),
    "velocity": ("velocity", "velo", "vel", "speed", "qd", "dq"),
    "force": ("force", "torque", "effort", "tau", "moment", "f"),
    "current": ("current", "iq", "cur", "amps", "i"),
}  # fmt: skip
_ASKED = ("setpoint", "reference", "target", "desired", "demand", "command", "ref", "set", "cmd",
          "qg", "sp", "soll")  # fmt: skip
_OTHER = ("act", "actual", "measured", "main", "axis", "data", "joint", "states", "state")
_TURNING = ("torque", "effort", "tau", "moment", "angle", "theta")
_TIME_WORDS = ("time", "timestamp", "stamp", "t", "zeit", "clock")
_UNIT_IN_NAME = re.compile(r"[\[(]\s*([^\])]*[^\])\s\d][^\])]*?)\s*[\])]\s*$|[_ ]([A-Za-z/0-9^]+)$")
_TIME_SIZES = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}
_SLOWEST, _FASTEST = 20.0, 100_000.0  # Hz, of a log that a drive is identified from
_FAR = {"m": (5.0, "mm"), "rad": (40.0, "deg")}  # what goes farther is taken for the other unit
_EVEN = 0.01  # of a step; what is less even needs resample
_ALIKE = 0.1  # how far a velocity may be off the rate of its position to be in the same unit


@dataclass(frozen=True)
class Guess:
    """text: of the map; missing: what the user must add, one sentence each."""

    text: str
    missing: tuple[str, ...]


@dataclass(frozen=True)
class Signal:
    """A column that was taken for a signal, and why; unit: None where its name states none."""

    name: str
    unit: str | None
    reason: str


def guess_map(path: Path) -> Guess:
    """A map for a file of any of the formats; raises InputError where it has no columns."""
    with reading(path):
        table = table_of(path, ImportMap({}))
        columns = _distinct(table.columns)
        if not columns:
            raise InputError("has no column of numbers; give another file")
    time = _time(columns)
    clock, step = _clock(columns, time, table.sample_rate)
    moving = {n: c for n, c in columns.items() if n != time and np.ptp(c) > 0.0}
    lines = [
        f"# Proposed from {path.name}; correct what is wrong, above all what is ASSUMED",
        *clock,
    ]
    missing: list[str] = []
    for axis, names in _axes(moving).items():
        found = _signals(names, moving, step)
        rotary = _turns(found)
        lines += ["", f"[axes.{axis}]"]
        position = found.get("position")
        for field, signal in found.items():
            lines.append(_entry(field, signal, moving, rotary, position, step))
        for field in ("position", "force"):
            if field not in found and not (field == "force" and "current" in found):
                missing.append(f"axis {axis}: no column of {', '.join(names)} looks like a {field}")
                lines.append(f'# {field} = {{column = "?", unit = "?"}} # {missing[-1]}')
        if "current" in found and "force" not in found:
            unit = "N m/A" if rotary else "N/A"
            lines.append(f"# force_constant = 1.0 # {unit}: NOT KNOWN, see the motor's data sheet")
        used = {signal.name for signal in found.values()}
        unused = [n for n in names if n not in used]
        lines += [f"# not used: {', '.join(unused)}"] if unused else []
    return Guess("\n".join(lines) + "\n", tuple(missing))


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


def _words(name: str) -> list[str]:
    spaced = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", " ", name)
    return re.findall(r"[a-z]+", spaced.lower())


def _time(columns: Mapping[str, Array]) -> str | None:
    """The column of time stamps: it rises, and is called so or rises evenly."""
    rising = {n: c for n, c in columns.items() if np.mean(np.diff(c) > 0.0) > 0.9}
    called = [n for n in rising if set(_words(n)) & set(_TIME_WORDS)]
    even = [n for n, c in rising.items() if np.ptp(np.diff(c)) < 0.5 * np.median(np.diff(c))]
    return next(iter([*called, *even]), None)


def _clock(
    columns: Mapping[str, Array], time: str | None, stated: float | None
) -> tuple[list[str], float]:
    """The lines of the clock, and the step in s."""
    if stated is not None:
        return [f"# the file states its sample rate: {stated:g} Hz"], 1.0 / stated
    if time is None:
        return ["sample_rate = 1000.0 # Hz, ASSUMED: no column rises as times do"], 1e-3
    steps = np.diff(columns[time])
    step = float(np.median(steps[steps > 0.0]))
    unit, reason = _unit_in(time), "its name states the unit"
    if unit is None or not _is(unit, "s"):
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


def _axes(columns: Mapping[str, Array]) -> dict[str, list[str]]:
    """Columns by axis: what a name has beside the words of signals and units tells the axis."""
    every = {w for words in (*_WORDS.values(), _ASKED, _OTHER) for w in words if len(w) > 1}
    out: dict[str, list[str]] = {}
    for name in columns:
        rest = [w for w in _words(_UNIT_IN_NAME.sub("", name)) if w not in every]
        letters = [w for w in rest if w in ("x", "y", "z")]
        digits = re.findall(r"\d+", name.rpartition("/")[2])
        axis = letters[0] if letters else f"axis{digits[-1]}" if digits else (rest or ["x"])[-1]
        out.setdefault(axis, []).append(name)
    whole = {
        axis: names
        for axis, names in out.items()
        if IDENTIFIER.fullmatch(axis) and {"force", "current"} & _named(names).keys()
        and "position" in _named(names)
    }  # fmt: skip
    return whole or {"x": list(columns)}


def _named(names: Sequence[str]) -> dict[str, Signal]:
    """The signals that names tell, the surest name first."""
    found: dict[str, Signal] = {}
    for field, words in _WORDS.items():
        for asked in (False, True):
            if asked and field not in ("position", "velocity"):
                continue
            taken = {signal.name for signal in found.values()}
            fitting = []
            for name in names:
                own = _words(_UNIT_IN_NAME.sub("", name) or name)
                places = [words.index(w) for w in own if w in words]
                if asked and field == "position" and "qg" in own:
                    places.append(0)
                if name not in taken and places and bool(set(own) & set(_ASKED)) is asked:
                    fitting.append((min(places), name))
            if fitting:
                name = min(fitting)[1]
                key = f"setpoint_{field}" if asked else field
                found[key] = Signal(name, _unit_in(name), "so called")
    return found


def _signals(names: Sequence[str], columns: Mapping[str, Array], step: float) -> dict[str, Signal]:
    """The signals that names tell, and those that the numbers tell."""
    found = _named(names)
    left = [n for n in names if n not in {signal.name for signal in found.values()}]
    if "position" not in found and (pair := rate_of_another(columns, left, step)):
        position, velocity, how = pair
        found["position"] = Signal(
            position, _unit_in(position), f"{velocity} is its rate ({how:.2f})"
        )
        found.setdefault(
            "velocity", Signal(velocity, _unit_in(velocity), f"the rate of {position}")
        )
        left = [n for n in left if n not in pair]
    if "position" in found and not {"force", "current"} & found.keys():
        moved = moved_by(columns, left, columns[found["position"].name], step)
        if moved is not None:
            why = f"the motion explains {100.0 * moved[1]:.0f} % of it"
            found["force"] = Signal(moved[0], _unit_in(moved[0]), why)
    return found


def _turns(found: Mapping[str, Signal]) -> bool:
    """Whether the axis is rotary: by a unit, or by words where no unit is stated."""
    for field, signal in found.items():
        if LINEAR_UNITS[field] != ROTARY_UNITS[field]:
            if _is(signal.unit, ROTARY_UNITS[field]):
                return True
            if _is(signal.unit, LINEAR_UNITS[field]):
                return False
    return any(set(_words(signal.name)) & set(_TURNING) for signal in found.values())


def _unit_in(name: str) -> str | None:
    found = _UNIT_IN_NAME.search(name)
    return next((g for g in found.groups() if g), None) if found else None


def _is(unit: str | None, *kinds: str) -> bool:
    try:
        return unit is not None and find_unit(unit, *kinds).si is not None
    except InputError:
        return False


def _entry(
    field: str, signal: Signal, columns: Mapping[str, Array], rotary: bool,
    position: Signal | None, step: float,
) -> str:  # fmt: skip
    """One line of the map, with the reason behind it."""
    column = columns[signal.name]
    span = f"{signal.reason}; {column.min():.4g} to {column.max():.4g}"
    units = ROTARY_UNITS if rotary else LINEAR_UNITS
    if _is(signal.unit, units[field]):
        return f"{field} = {_table(signal.name, signal.unit)} # {span}"
    unit, why = _assumed(units[field], column), ""
    if field.endswith("velocity") and position is not None:
        base = position.unit or _assumed(units["position"], columns[position.name])
        unit = f"{base}/s"
        ratio = ratio_of_rates(columns[position.name], column, step)
        if field == "velocity" and abs(ratio - 1.0) > _ALIKE:
            why = f", but one of it is {ratio:.3g} {unit} by the position: correct one of the units"
    return f"{field} = {_table(signal.name, unit)} # {span}; unit ASSUMED{why}"


def _assumed(si: str, column: Array) -> str:
    far, other = _FAR.get(si, (np.inf, si))
    return other if np.ptp(column) > far else si


def _table(name: str, unit: str | None) -> str:
    return f"{{column = {json.dumps(name)}, unit = {json.dumps(unit, ensure_ascii=False)}}}"
