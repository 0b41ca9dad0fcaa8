"""A proposed map against the truth of its file."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, field
from typing import Any

from benchmarks.door.recordings import CURRENTS, FORCES, Recording, Written
from twin.errors import InputError
from twin.importers.units import find_unit

ASSUMED = "ASSUMED"
_KINDS = ("m", "rad", "m/s", "rad/s", "N", "N m", "A", "Pa", "K")
# what a signal of the map may hold
HOLDS = {
    "position": ("position",), "velocity": ("velocity",), "setpoint_position": ("setpoint",),
    "setpoint_velocity": ("setpoint_velocity",), "force": FORCES, "current": CURRENTS,
    "temperature": ("temperature",), "pressure": ("pressure",), "pressure_2": ("pressure",),
}  # fmt: skip


@dataclass
class Verdict:
    """wrong: what the map says and is not so. assumed: the same, but marked as assumed.

    asked: what it leaves open. missed: axes that it does not have.
    """

    recording: Recording
    wrong: list[str] = field(default_factory=list)
    assumed: list[str] = field(default_factory=list)
    asked: list[str] = field(default_factory=list)
    missed: list[str] = field(default_factory=list)
    seconds: float = 0.0

    @property
    def word(self) -> str:
        """The verdict."""
        if self.wrong:
            return "WRONG"
        if self.missed:
            return "missed"
        if self.assumed:
            return "assumed"
        return "asked" if self.asked else "right"


def judge(recording: Recording, text: str, seconds: float) -> Verdict:
    """The verdict on the text of a map."""
    out = Verdict(recording, seconds=seconds)
    found = tomllib.loads(text)
    lines = _lines(text)
    seen = set()
    for axis, entries in found.get("axes", {}).items():
        position = entries.get("position", {}).get("column")
        truth = _of(recording, position or "")
        for entry, table in entries.items():
            if isinstance(table, dict) and "column" in table:
                _judge_entry(out, entry, table, truth, lines.get((axis, entry), ""))
        if truth is not None:
            seen.add(truth.axis)
        if "position" not in entries:
            out.asked.append(f"{axis}: position")
        if not {"force", "current"} & entries.keys():
            out.asked.append(f"{axis}: force")
        elif "force" not in entries and "force_constant" not in entries:
            out.asked.append(f"{axis}: force constant")
    whole = _whole(recording)
    if not any(a.endswith("position") for a in out.asked) or len(whole) > 1:
        out.missed += sorted(whole - seen)
    _judge_time(out, found, text)
    return out


def _whole(recording: Recording) -> set[str]:
    """Axes of which a position and a force or current are in the file."""
    holds: dict[str, set[str]] = {}
    for written in recording.columns.values():
        holds.setdefault(written.axis, set()).add(written.holds)
    return {a for a, h in holds.items() if "position" in h and h & {*FORCES, *CURRENTS}}


def _of(recording: Recording, name: str) -> Written | None:
    """What a column is; its dialect may have put a unit behind its name."""
    return recording.columns.get(name) or recording.columns.get(name.rpartition(" [")[0])


def _lines(text: str) -> dict[tuple[str, str], str]:
    axis, out = "", {}
    for line in text.splitlines():
        if line.startswith("[axes."):
            axis = line[6:].rstrip("]").strip('"')
        elif " = " in line:
            out[axis, line.split(" = ")[0]] = line
    return out


def _judge_entry(
    out: Verdict, entry: str, table: dict[str, Any], axis: Written | None, line: str
) -> None:
    column = _of(out.recording, table["column"])
    name = f"{entry} = {table['column']}"
    if column is None or entry not in HOLDS or column.holds not in HOLDS[entry]:
        said = (
            out.assumed if "measured ASSUMED" in line or "asked for ASSUMED" in line else out.wrong
        )
        said.append(f"{name}: holds {column.holds if column else 'nothing of an axis'}")
        return
    if axis is not None and column.axis != axis.axis:
        out.wrong.append(f"{name}: of axis {column.axis}, not {axis.axis}")
    if table.get("sign", 1) != column.sign:
        out.wrong.append(f"{name}: sign {table.get('sign', 1)} for {column.sign}")
    _judge_size(out, name, table, column, line)


def _judge_size(out: Verdict, name: str, table: dict[str, Any], column: Written, line: str) -> None:
    try:
        unit = find_unit(table["unit"], *_KINDS)
    except InputError as error:
        out.wrong.append(f"{name}: {error}")
        return
    if unit.si is None and "scale" not in table:
        out.asked.append(f"{name}: scale")
        return
    size = unit.size * float(table.get("scale", 1.0))
    right = column.size is not None and abs(size / column.size - 1.0) < 0.01
    if not right:
        said = out.assumed if ASSUMED in line else out.wrong
        said.append(f"{name}: {size:g} SI for {column.size}")


def _judge_time(out: Verdict, found: dict[str, Any], text: str) -> None:
    """The rate: of times in a unit, which must be those of the file."""
    if "sample_rate" in found:
        line = next(x for x in text.splitlines() if x.startswith("sample_rate"))
        if abs(found["sample_rate"] / out.recording.rate - 1.0) > 0.01:
            (out.assumed if ASSUMED in line else out.wrong).append(line)
    elif "time" not in found:
        out.asked.append("the times")
