"""A map proposed from a file alone, each entry with its reason; the user corrects and keeps it."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from twin.errors import InputError
from twin.importers import signals
from twin.importers.importer import table_of
from twin.importers.mapping import EVERY_COLUMN
from twin.importers.table import numbers
from twin.importers.units import find_unit
from twin.logs.container import reading
from twin.logs.log import LINEAR_UNITS, ROTARY_UNITS, Array
from twin.logs.topics import IDENTIFIER

_TIME_WORDS = ("time", "timestamp", "stamp", "t", "zeit", "clock")
_TIME_SIZES = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}
_SLOWEST, _FASTEST = 20.0, 100_000.0  # Hz, of a log that a drive is identified from
_EVEN = 0.01  # of a step; what is less even needs resample
_ALIKE = 0.1  # how far a velocity may be off the rate of its position to be in the same unit


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
        found = signals.signals_of(names, moving, step)
        rotary = signals.turns(found)
        lines += ["", f"[axes.{axis}]"]
        lines += [
            _entry(f, s, moving, rotary, found.get("position"), step) for f, s in found.items()
        ]
        for field in ("position", "force"):
            if field not in found and not (field == "force" and "current" in found):
                missing.append(f"axis {axis}: no column of {', '.join(names)} looks like a {field}")
                lines.append(f'# {field} = {{column = "?", unit = "?"}} # {missing[-1]}')
        if "current" in found and "force" not in found:
            unit = "N m/A" if rotary else "N/A"
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


def _time(columns: Mapping[str, Array]) -> str | None:
    """The column of time stamps: it rises, and is called so or rises evenly."""
    rising = {n: c for n, c in columns.items() if np.mean(np.diff(c) > 0.0) > 0.9}
    called = [n for n in rising if set(signals.words_of(n)) & set(_TIME_WORDS)]
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
    unit, reason = signals.unit_in(time), "its name states the unit"
    if unit is None or not signals.is_unit(unit, "s"):
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
    told = (*signals.WORDS.values(), signals.ASKED, signals.OTHER)
    every = {w for words in told for w in words if len(w) > 1}
    out: dict[str, list[str]] = {}
    for name in columns:
        rest = [w for w in signals.words_of(signals.bare(name)) if w not in every]
        letters = [w for w in rest if w in ("x", "y", "z")]
        digits = re.findall(r"\d+", name.rpartition("/")[2])
        axis = letters[0] if letters else f"axis{digits[-1]}" if digits else (rest or ["x"])[-1]
        out.setdefault(axis, []).append(name)
    whole = {
        axis: names
        for axis, names in out.items()
        if IDENTIFIER.fullmatch(axis)
        and "position" in (found := signals.named(names))
        and {"force", "current"} & found.keys()
    }
    return whole or {"x": list(columns)}


def _entry(
    field: str, signal: signals.Signal, columns: Mapping[str, Array], rotary: bool,
    position: signals.Signal | None, step: float,
) -> str:  # fmt: skip
    """One line of the map, with the reason behind it."""
    column = columns[signal.name]
    span = f"{signal.reason}; {column.min():.4g} to {column.max():.4g}"
    units = ROTARY_UNITS if rotary else LINEAR_UNITS
    if signals.is_unit(signal.unit, units[field]):
        return f"{field} = {_table(signal.name, signal.unit)} # {span}"
    unit, why = signals.assumed(units[field], column), ""
    if field.endswith("velocity") and position is not None:
        base = position.unit or signals.assumed(units["position"], columns[position.name])
        unit = f"{base}/s"
        ratio = signals.ratio_of_rates(columns[position.name], column, step)
        if field == "velocity" and abs(ratio - 1.0) > _ALIKE:
            why = f", but one of it is {ratio:.3g} {unit} by the position: correct one of the units"
    return f"{field} = {_table(signal.name, unit)} # {span}; unit ASSUMED{why}"


def _table(name: str, unit: str | None) -> str:
    return f"{{column = {json.dumps(name)}, unit = {json.dumps(unit, ensure_ascii=False)}}}"
