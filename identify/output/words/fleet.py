"""What is said of a fleet."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from identify.output.blocks import Row, TableBlock
from identify.output.numbers import NOTHING, listed, number, percent, quantity, with_band
from identify.output.text import to_text
from identify.results.fleet import (
    Alarm,
    Floor,
    Ingested,
    KindParameter,
    LiveAlarm,
    LiveCause,
    LiveParameter,
    MachineState,
    Off,
    Told,
)


def ingested_in_words(done: Ingested) -> str:
    """What became of the logs of a folder."""
    counts = {
        "fitted": done.fitted, "known before": done.known, "faulty": done.faulty,
        "still being written": done.unfinished,
    }  # fmt: skip
    parts = ", ".join(f"{count} {what}" for what, count in counts.items() if count)
    return f"{done.store}: {done.logs} logs, {parts or 'nothing to do'}"


def table_text(columns: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """A table for the terminal, its columns one beside the other."""
    return to_text([TableBlock(columns, [Row([_cell(value) for value in row]) for row in rows])])


def _cell(value: Any) -> str:
    if value is None:
        return NOTHING
    digits = 6  # significant, of a number that may be used elsewhere
    return number(value, digits) if isinstance(value, float) else str(value)


def named(parameter: str) -> str:
    """What a parameter is called in a sentence."""
    return "force error of the fit" if parameter == "force_error" else parameter


def size_in_words(alarm: Alarm) -> str:
    """By how much a parameter changed: with its band, and as a share of what it was."""
    share = f" ({'+' if alarm.size > 0 else ''}{percent(alarm.relative)})" if alarm.before else ""
    return f"{with_band(alarm.size, alarm.half_width, alarm.unit)}{share}"


def change_in_words(alarm: Alarm) -> str:
    """What changed, by how much and since when."""
    what, verb = named(alarm.parameter), "rose" if alarm.size > 0 else "fell"
    before, after = (quantity(v, alarm.unit) for v in (alarm.before, alarm.after))
    said = f"{what} of axis {alarm.axis} {verb} on {night_in_words(alarm)}: "
    said += f"{size_in_words(alarm)}, from {before} to {after}"
    if alarm.trend is not None:
        said += f", and goes on by {quantity(alarm.trend, alarm.unit)} a night"
    return said + (f"; with it changed {listed(alarm.others)}" if alarm.others else "")


def night_in_words(alarm: Alarm) -> str:
    """The date of a change with its band."""
    if alarm.earliest == alarm.latest:
        return f"{alarm.changed}"
    return f"{alarm.changed} ({alarm.earliest} to {alarm.latest})"


def alarm_in_words(alarm: Alarm, cause: Sequence[str] = ()) -> str:
    """An alarm in a sentence, with what a diagnosis names as its cause."""
    who = alarm.machine or f"all machines of kind {alarm.model}"
    why = f"; a diagnosis of the nights after it names {listed(cause)}" if cause else ""
    return f"{who}: {change_in_words(alarm)}, told after the night of {alarm.night}{why}"


def off_in_words(off: Off) -> str:
    """By how much a machine is off from its kind."""
    own, usual = (quantity(v, off.unit) for v in (off.value, off.usual))
    return (
        f"{named(off.parameter)} of axis {off.axis} is {own}, of its kind {usual} is usual: "
        f"{number(off.far, 2)} standard deviations of what machines differ by"
    )


def state_in_words(state: MachineState) -> str:
    """What a machine needs attention for, in a few words."""
    parts = [named(a.parameter) for a in state.alarms]
    parts += [f"{named(o.parameter)} off from its kind" for o in state.off]
    bad = f"{state.faulty} bad log{'s' if state.faulty > 1 else ''}"
    parts += [bad] if state.faulty else []
    return ", ".join(dict.fromkeys(parts)) or NOTHING


def floor_in_words(floor: Floor) -> str:
    """All alarms, those of the hall first."""
    lines = [alarm_in_words(alarm) for alarm in floor.hall]
    lines += [alarm_in_words(a, floor.causes.get(a, ())) for a in floor.alarms]
    lines += [f"{o.machine}: {off_in_words(o)}" for m in floor.machines for o in m.off]
    count = len({a.machine for a in floor.alarms})
    head = f"{len(floor.machines)} machines, {count} of them changed"
    return "\n".join([head, *lines])


def demo_in_words(planted: Sequence[Told], floor: Floor, right: bool, page: Path) -> str:
    """What was planted, and what was told of it."""
    lines = [f"planted: {p.what} on {p.machine}, from {p.night} on" for p in planted]
    verdict = "all of it was found, and nothing else" if right else "not all that was told is right"
    return "\n".join([*lines, floor_in_words(floor), verdict, f"page: {page}"])


def kind_in_words(kind: str, told: Sequence[KindParameter], machine: str | None) -> str:
    """What a kind is, and what is expected of a machine of it."""
    who = machine or "a new machine"
    lines = [f"kind {kind}, by {max(p.machines for p in told)} machines"]
    for one in told:
        spread = (
            f"{quantity(one.mean, one.unit)}, {quantity(one.spread, one.unit)} between machines"
        )
        own = with_band(one.expected, 1.645 * one.deviation, one.unit)
        lines.append(f"  {one.parameter} of axis {one.axis}: {spread}; of {who} {own} is expected")
    return "\n".join(lines)


def live_in_words(alarm: LiveAlarm) -> str:
    """An alarm of a machine that runs."""
    errors = f"{quantity(alarm.before, alarm.unit)} to {quantity(alarm.after, alarm.unit)} RMS"
    return (
        f"force error of axis {alarm.axis} {'rose' if alarm.after > alarm.before else 'fell'} from "
        f"{errors} since {alarm.changed:.1f} s, told at {alarm.time:.1f} s"
    )


def unlike_in_words(axis: str, begun: float, fitted: float) -> str:
    """That an axis was never as its model; its errors over the noise floor, now and in the fit."""
    return (
        f"axis {axis}: its force error is {begun:.3g} times its noise floor from the beginning, "
        f"{fitted:.3g} times in the fit of the model, which is of another machine, or of another "
        "state of it: fit it to logs of this one"
    )


def cause_in_words(cause: LiveCause) -> str:
    """What a diagnosis of the minutes after an alarm came to."""
    since = f"axis {cause.axis}, since {cause.changed:.1f} s"
    if cause.failed:
        return f"{since}: is not diagnosed: {cause.failed}"
    return f"{since}: a diagnosis names {listed(cause.named) if cause.named else 'no effect'}"


def parameter_in_words(one: LiveParameter) -> str:
    """A parameter as it is now, beside what was fitted."""
    return f"{with_band(one.value, one.half, one.unit)} (fitted {quantity(one.fitted, one.unit)})"
