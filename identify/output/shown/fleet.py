"""The page of a fleet: machines by what needs attention, their parameters over time, alarms."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import date
from pathlib import Path

import numpy as np

from identify.output.blocks import (
    AnswerBlock,
    Block,
    Chart,
    Drawn,
    Ink,
    LineStyle,
    Listing,
    TableBlock,
    Tile,
    Tone,
)
from identify.output.numbers import (
    NOTHING,
    DisplayUnit,
    capitalised,
    listed,
    number,
    quantity,
)
from identify.output.report.page import Section
from identify.output.report.page import page as whole_page
from identify.output.words.fleet import (
    alarm_in_words,
    change_in_words,
    named,
    night_in_words,
    off_in_words,
    size_in_words,
    state_in_words,
)
from identify.results.fleet import Alarm, Course, Floor, MachineState
from twin.files import write_atomically
from twin.signals import Array

DAY = 86_400.0  # s
MOST_ROWS = 200  # of machines that need no attention


def write_fleet(path: Path, floor: Floor) -> None:
    """Write the page of a floor, whole or not at all. Raises InputError."""
    drawn = [m for m in floor.machines if m.machine in floor.courses]
    shown = [
        Section("answer", "What needs attention", [_answer(floor)]),
        Section("alarms", "Alarms", _alarms(floor)),
        Section("machines", "All machines", [_machines(floor)]),
        *(Section(f"machine-{i}", m.machine, _machine(floor, m)) for i, m in enumerate(drawn)),
    ]
    facts = [("Store", str(floor.store)), ("Machines", str(len(floor.machines)))]
    last = max((m.last for m in floor.machines if m.last), default=None)
    facts += [("Last night", str(last))] if last else []
    warnings = [("Store", line) for line in floor.faults]
    made = [("Date", date.today().isoformat())]
    text = whole_page("Machines over time", facts, shown, (), made, warnings)
    write_atomically(path, text.encode("utf-8"))


def _answer(floor: Floor) -> Block:
    changed = [m for m in floor.machines if m.alarms]
    apart = [m for m in floor.machines if m.off]
    bad = sum(m.faulty for m in floor.machines)
    names = listed([m.machine for m in changed[:5]]) if changed else ""
    more = f" and {len(changed) - 5} more" if len(changed) > 5 else ""
    headline = f"{len(changed)} of {len(floor.machines)} machines changed"
    sentences = [f"Look first at {names}{more}."] if changed else ["No machine has changed."]
    if floor.hall:
        sentences.append("What all machines did at once is told as the hall's, not as theirs.")
    tiles = [
        Tile("Machines that changed", str(len(changed)), f"of {len(floor.machines)}"),
        Tile("Off from their kind", str(len(apart)), "by more than machines differ"),
        Tile("Changes of the hall", str(len(floor.hall)), "in all machines at once"),
        Tile("Bad logs", str(bad), "were not fitted"),
    ]
    remarks = [
        "A healthy machine raises one alarm in 1000 nights or more, by simulation. A change below "
        "1 % of a parameter, or 25 % of the force error, is no alarm.",
    ]
    return AnswerBlock(
        headline, " ".join(sentences), tiles, remarks, Tone.STRONG if changed else Tone.PLAIN
    )


def _alarms(floor: Floor) -> list[Block]:
    told = [*floor.hall, *floor.alarms]
    if not told:
        return [Listing(["None."])]
    columns = {
        "Machine": lambda a: a.machine or f"hall (all of kind {a.model})",
        "What": lambda a: named(a.parameter),
        "Axis": lambda a: a.axis,
        "Changed on": night_in_words,
        "Size": size_in_words,
        "Told after": lambda a: str(a.night),
        "With it": lambda a: listed(a.others) if a.others else NOTHING,
        "Diagnosed": lambda a: listed(floor.causes[a]) if floor.causes.get(a) else NOTHING,
    }
    caption = (
        "Size: mean of the last nights less the mean before the change, with half its 90 % band. "
        "Changed on: the most likely night, with its 90 % band."
    )
    return [TableBlock.of(told, columns, caption, tone=_tone)]


def _tone(alarm: Alarm) -> Tone:
    return Tone.STRONG if alarm.machine else Tone.PLAIN


def _machines(floor: Floor) -> Block:
    told = [m for m in floor.machines if any(m.attention)]
    quiet = [m for m in floor.machines if not any(m.attention)]
    columns = {
        "Machine": lambda m: m.machine,
        "Kind": lambda m: m.model or NOTHING,
        "Attention for": state_in_words,
        "Nights": lambda m: str(m.nights),
        "Last night": lambda m: str(m.last or NOTHING),
        "Force error / noise floor": lambda m: number(m.ratio, 2),
        "Bad logs": lambda m: str(m.faulty),
    }
    shown = [*told[:MOST_ROWS], *quiet[:MOST_ROWS]]
    left = len(floor.machines) - len(shown)
    caption = f"{left} more machines are not shown; `twin fleet sql` has all." if left else ""
    return TableBlock.of(
        shown, columns, caption, tone=lambda m: Tone.STRONG if m.alarms else Tone.PLAIN
    )


def _machine(floor: Floor, state: MachineState) -> list[Block]:
    said = [capitalised(alarm_in_words(a, floor.causes.get(a, ()))) for a in state.alarms]
    said += [capitalised(off_in_words(off)) for off in state.off]
    blocks: list[Block] = [Listing(said)] if said else []
    courses = floor.courses[state.machine]
    blocks.append(_parameters(courses))
    for course in _ordered(state, courses):
        told = [a for a in state.alarms if (a.axis, a.parameter) == (course.axis, course.parameter)]
        caption = capitalised(". ".join(change_in_words(a) for a in told)) if told else ""
        lines = _lines(course, told)
        over_time = ("Night (month-day)", DAY * course.days)
        blocks.append(Chart(over_time, _label(course), lines, caption, dates=True))
        if told:
            over_distance = (f"Travelled in its logs ({course.distance_unit})", course.distance)
            blocks.append(Chart(over_distance, _label(course), lines))
    return blocks


def _ordered(state: MachineState, courses: Sequence[Course]) -> list[Course]:
    """What changed first, the strongest of it before all; of a machine that is well the error."""
    names = [(a.axis, p) for a in state.alarms for p in (a.parameter, *a.others)]
    first = [c for name in dict.fromkeys(names) for c in courses if (c.axis, c.parameter) == name]
    rest = [c for c in courses if (c.axis, c.parameter) not in names]
    return [*first, *rest] if first else rest[-1:]


def _parameters(courses: Sequence[Course]) -> Block:
    columns = {
        "Parameter": lambda c: f"{named(c.parameter)}, axis {c.axis}",
        "First nights": lambda c: quantity(_mean(c.alone, slice(None, 5)), c.unit),
        "Last nights": lambda c: quantity(_mean(c.alone, slice(-5, None)), c.unit),
        "Its kind": lambda c: quantity(_mean(c.usual, slice(-5, None)), c.unit),
        "Travelled in its logs": lambda c: quantity(float(c.distance[-1]), c.distance_unit),
    }
    return TableBlock.of(courses, columns)


def _mean(values: Array, part: slice) -> float | None:
    known = values[np.isfinite(values)][part]
    return float(known.mean()) if len(known) else None


def _label(course: Course) -> str:
    scale = DisplayUnit.of(course.unit, course.values)
    return scale.label(capitalised(named(course.parameter)).rstrip("."))


def _lines(course: Course, alarms: Sequence[Alarm]) -> list[Drawn]:
    """A parameter as fitted with its band, alone, and the level before and after each alarm."""
    scale = DisplayUnit.of(course.unit, course.values)
    low, high = np.nanmin(course.values), np.nanmax(course.values)
    within = np.clip(course.half, 0.0, high - low)  # else one night would leave nothing to be seen
    lines = []
    if np.isfinite(within).any() and np.nanmax(within) > 0.0:
        edges = {"high": course.values + within, "low": course.values - within}
        lines += [
            Drawn(f"90 % band within the log, {end} end", scale(edge), LineStyle.BAND)
            for end, edge in edges.items()
        ]
    lines.append(Drawn("as fitted", scale(course.values), ink=Ink.SOFT))
    if not np.array_equal(course.alone, course.values, equal_nan=True):
        lines.append(Drawn("less what all machines do", scale(course.alone)))
    lines.append(Drawn("median of its kind", scale(course.usual), LineStyle.DASH, Ink.SOFT))
    for alarm in alarms:
        changed = (alarm.changed - date(1970, 1, 1)).days
        level = np.where(course.days < changed, alarm.before, alarm.after)
        lines.append(Drawn(f"level before and after {alarm.changed}", scale(level), ink=Ink.AFTER))
    return lines
