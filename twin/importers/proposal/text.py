"""A proposal as the text of an import map: each entry says why, how sure, and what it lacks."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

from twin.importers.proposal.channels import SI, channel_unit
from twin.importers.proposal.courses import TableColumn
from twin.importers.proposal.lexicon import Quantity
from twin.importers.proposal.signals import File, ProposedAxis, Signal
from twin.importers.proposal.units import (
    ANGLES,
    LENGTHS,
    SURE,
    customary,
    drive_unit,
    is_counted,
    is_raw,
    moves_straight,
    near,
    position_unit,
    rate_ratio,
    turns,
    unit_as_large,
)
from twin.importers.units import is_unit
from twin.logs.log import LINEAR_UNITS, ROTARY_UNITS

ORDER = ("position", "velocity", "setpoint_position", "setpoint_velocity", "force", "current", *SI)
CONSTANT = "force_constant"
SCALE, UNIT = "scale", "unit"
TURN, METRE = "counts_per_turn", "counts_per_metre"
PER_ONE = (SCALE, TURN, METRE)  # entries without which a raw column has no size
Answers = Mapping[tuple[str, str, str], str]
"""What the user knows: (axis, field, scale or unit) -> the entry."""


@dataclass(frozen=True)
class Need:
    """What the file does not tell, of an axis' field. entry: in the map, such as scale or unit.

    what: the quantity that is asked for. assumed: what is taken if nobody says otherwise, None
    where nothing can be. other: an entry that may be given in its place.
    """

    axis: str
    field: str
    entry: str
    what: str
    assumed: str | None = None
    other: str | None = None

    def given(self, answers: Answers) -> tuple[str, str] | None:
        """The entry that a user gave, and its value; None where none was."""
        entries = (e for e in (self.entry, self.other) if e is not None)
        told = ((e, answers.get((self.axis, self.field, e))) for e in entries)
        return next(((e, value) for e, value in told if value is not None), None)

    @property
    def key(self) -> tuple[str, str, str]:
        """Under which an answer to it stands."""
        return self.axis, self.field, self.entry


@dataclass(frozen=True)
class MapEntry:
    """A line of the map: a signal in its unit. needs: what is not known of it.

    size: of one of it, the entry and its value, where it is known.
    """

    signal: Signal
    unit: str
    remarks: tuple[str, ...] = ()
    needs: tuple[Need, ...] = ()
    size: tuple[str, str] | None = None

    def line(self, column: TableColumn) -> str:
        """As it stands in the map."""
        values = {"column": _quoted(self.signal.column)}
        if (parts := self.signal.name.parts) is not None:
            more = "true" if parts[2] is None else _quoted(parts[2])
            values = {"column": _quoted(parts[0]), parts[1]: more}
        values["unit"] = _quoted(self.unit)
        if self.size is not None:
            entry, value = self.size
            values[entry] = value
        if self.signal.sign < 0:
            values["sign"] = "-1"
        if column.wraps is not None:
            values["wraps"] = f"{column.wraps:.17g}"
        table = ", ".join(f"{key} = {value}" for key, value in values.items())
        why = ", ".join(self.signal.reasons)
        span = f"{column.values.min():.4g} to {column.values.max():.4g}"
        span += " in SI" if self.signal.name.is_integral else ""
        jumps = () if column.wraps is None else (f"jumps back by {column.wraps:.6g}: it wraps",)
        assumed = (f"{self.signal.assumed} ASSUMED",) if self.signal.assumed else ()
        sure = f"{self.signal.certainty.value}: {why}"
        told = "; ".join((sure, span, *jumps, *assumed, *self.remarks))
        return f"{self.signal.field} = {{{table}}} # {told}"

    def answered(self, answers: Answers) -> MapEntry:
        """The same with what the user knows."""
        entry = self
        for need in self.needs:
            if (size := need.given(answers)) is None:
                continue
            left = tuple(n for n in entry.needs if n is not need)
            entry = replace(entry, needs=left, remarks=(f"{size[0]} as given",))
            states_unit = need.entry == UNIT
            entry = replace(entry, unit=size[1]) if states_unit else replace(entry, size=size)
        return entry


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


def entries_of(file: File, axis: ProposedAxis) -> list[MapEntry]:
    """The signals of an axis in their units."""
    return [_entry(file, axis, axis.signals[f]) for f in ORDER if f in axis.signals]


def _entry(file: File, axis: ProposedAxis, signal: Signal) -> MapEntry:
    if signal.field == "position":
        return _of_position(file, axis, signal)
    if signal.field == "setpoint_position":
        return _of_setpoint(file, axis, signal)
    if signal.field.endswith("velocity"):
        return _of_velocity(file, axis, signal)
    if signal.field in SI:
        return _of_channel(file, axis, signal)
    return _of_drive(file, axis, signal)


def _of_channel(file: File, axis: ProposedAxis, signal: Signal) -> MapEntry:
    unit, stated = channel_unit(signal, file.column(signal.name))
    if is_raw(unit):
        return _without_scale(axis, signal, unit, SI[signal.field])
    return MapEntry(signal, unit) if stated else _assumed(axis, signal, unit)


def _of_position(file: File, axis: ProposedAxis, signal: Signal) -> MapEntry:
    if (parts := signal.name.parts) and signal.name.is_integral:
        known = file.names[parts[0]].unit
        unit = known or ("rad/s" if turns(axis) else "m/s")
        return MapEntry(signal, unit) if known else _assumed(axis, signal, unit)
    unit, stated = position_unit(file, axis)
    if is_raw(unit):
        how = _by_velocity(file, axis, signal, unit)
        return _without_scale(axis, signal, unit, _angle_or_length(axis), how)
    return MapEntry(signal, unit) if stated else _assumed(axis, signal, unit)


def _by_velocity(file: File, axis: ProposedAxis, position: Signal, unit: str) -> str:
    """How many of a counted position a velocity in a stated unit makes a turn, or a metre."""
    velocity = axis.signals.get("velocity")
    if velocity is None or velocity.name.unit is None or is_raw(velocity.name.unit):
        return ""
    one = rate_ratio(file, position, velocity, unit, velocity.name.unit)  # rad or m for a count
    if one == 0.0:
        return ""
    whole = (2.0 * math.pi if is_unit(velocity.name.unit, "rad/s") else 1.0) / abs(one)
    return f"about {whole:.0f} by {velocity.column}"


def _angle_or_length(axis: ProposedAxis) -> str:
    """The unit of a position that is counted; either where nothing tells whether the axis turns."""
    return "rad" if turns(axis) else "m" if moves_straight(axis) else "rad or m"


def _of_setpoint(file: File, axis: ProposedAxis, signal: Signal) -> MapEntry:
    unit, stated = position_unit(file, axis)
    found = file.course(axis.signals["position"].name, signal.name)
    own = None if found is None else unit_as_large(
        signal.name, abs(found.slope), found.likeness, unit
    )  # fmt: skip
    if found is not None and found.slope < 0.0:
        signal = replace(signal.because("reversed against the position"), sign=-1)
    if own is not None and is_raw(own):
        return _without_scale(axis, signal, own, _angle_or_length(axis))
    if own is not None:
        told = f"as large as the position in {own}" if signal.name.unit is None else ""
        signal = signal.because(told) if told else signal
        return MapEntry(signal, own) if stated or signal.name.unit else _assumed(axis, signal, own)
    said = f"one of it is {1.0 / found.slope:.4g} of the position" if found else "its unit is open"
    of = signal.name.unit or unit
    if is_raw(of) or is_raw(unit) or signal.name.unit is None:
        return _without_scale(axis, signal, "counts" if not is_raw(of) else of,
                              _angle_or_length(axis), said)  # fmt: skip
    return MapEntry(signal, of, (f"but {said}: correct one of the units",))


def _of_velocity(file: File, axis: ProposedAxis, signal: Signal) -> MapEntry:
    position = axis.signals["position"]
    base, _ = position_unit(file, axis)
    unit = signal.name.unit
    if is_raw(unit) or (is_raw(base) and unit is None):
        si = "rad/s" if turns(axis) else "m/s"
        return _without_scale(axis, signal, unit or "counts", si)
    if unit is not None:
        ratio = 0.0 if is_raw(base) else rate_ratio(file, position, signal, base, unit)
        return MapEntry(signal, unit, _off(ratio, unit, signal.field))
    if (own := customary(signal.name)) is None:
        own = f"{base}/s"
    family = ANGLES if base in ANGLES else LENGTHS
    for other in (own, *(f"{u}/s" for u in family), "rpm"):
        if near(rate_ratio(file, position, signal, base, other), SURE):
            told = signal if other == own else signal.because(f"as large as the rate in {other}")
            return _assumed(axis, told, other)
    ratio = rate_ratio(file, position, signal, base, own)
    entry = _assumed(axis, signal, own)
    return replace(entry, remarks=(*entry.remarks, *_off(ratio, own, signal.field)))


def _off(ratio: float, unit: str, field: str) -> tuple[str, ...]:
    """That a velocity is not as large as the rate of the position, where that is so."""
    alike = 1.1  # times as large, which a filter's lag may make
    if field != "velocity" or ratio == 0.0 or near(ratio, alike):
        return ()
    return (f"but one of it is {1.0 / ratio:.3g} {unit} by the position: correct one of the units",)


def _of_drive(file: File, axis: ProposedAxis, signal: Signal) -> MapEntry:
    rotary = turns(axis)
    unit, stated = drive_unit(signal.name, file.column(signal.name), rotary)
    si = "A" if signal.field == "current" else "N m" if rotary else "N"
    if unit is None and signal.name.unit is not None:  # a torque beside a length
        other = ROTARY_UNITS if not rotary else LINEAR_UNITS
        of = signal.name.unit if is_unit(signal.name.unit, *other.values()) else "one"
        hint = "2 pi / lead of the screw in m, times the gear ratio" if not rotary else "the radius"
        return _without_scale(axis, signal, "counts", si, f"for one {of}: {hint}")
    if unit is None or is_raw(unit):
        return _without_scale(axis, signal, unit or "1", si)
    return MapEntry(signal, unit) if stated else _assumed(axis, signal, unit)


def _assumed(axis: ProposedAxis, signal: Signal, unit: str) -> MapEntry:
    need = Need(axis.name, signal.field, UNIT, f"the unit of {signal.column}", unit)
    return MapEntry(signal, unit, ("unit ASSUMED",), (need,))


def _without_scale(
    axis: ProposedAxis, signal: Signal, unit: str, si: str, how: str = ""
) -> MapEntry:
    """An entry that the map cannot be used with until somebody gives its scale."""
    what, entry, hint = f"{si} for one of {signal.column}", SCALE, f", {how}" if how else ""
    remark = f"scale NOT KNOWN: {si} for one{hint}"
    if is_counted(unit) and signal.field not in ("force", "current"):
        entry = METRE if si.startswith("m") else TURN
        either = "" if " or " not in si else f", or {METRE} where the axis travels"
        what = f"{entry} of the encoder of {signal.column}{either}"
        remark = f"{entry} NOT KNOWN{either}{hint}"
    what += f" ({how})" if how else ""
    other = METRE if entry == TURN and " or " in si else None
    need = Need(axis.name, signal.field, entry, what, other=other)
    return MapEntry(signal, unit, (remark,), (need,))


# --- the lines of an axis -------------------------------------------------------------------------


def lines_of(file: File, axis: ProposedAxis, answers: Answers) -> Iterator[str]:
    """The table of an axis, with what is asked for and what is not used."""
    yield ""
    yield f"[axes.{axis.name}]"
    entries = [entry.answered(answers) for entry in entries_of(file, axis)]
    for entry in entries:
        yield entry.line(file.columns[entry.signal.column])
    asked = {n.entry: n for e in entries for n in e.needs if n.entry in (TURN, METRE)}
    for name, lacks in asked.items():
        travels = f", or {METRE} where the axis travels" if METRE in lacks.what[len(name) :] else ""
        yield f"# {name} = ? # NOT KNOWN, of the encoder{travels}"
    for field, what in axis.asked.items():
        yield f'# {field} = {{column = "?", unit = "?"}} # {what}'
    if (need := constant_of(axis)) is not None:
        given, unit = answers.get(need.key), _constant_unit(axis)
        if given is not None:
            yield f"{CONSTANT} = {given} # {unit}, as given"
        else:
            yield f"# {CONSTANT} = 1.0 # {unit}: NOT KNOWN, see the motor's data sheet"
    kept: dict[str, list[str]] = {}
    for column in axis.columns:
        if column not in {s.column for s in axis.signals.values()}:
            kept.setdefault(why_not(file, axis, column), []).append(column)
    for why, alike in kept.items():
        yield f"# not used: {', '.join(alike)}: {why}"


def _constant_unit(axis: ProposedAxis) -> str:
    return "N m/A" if turns(axis) else "N/A" if moves_straight(axis) else "N/A or N m/A"


def constant_of(axis: ProposedAxis) -> Need | None:
    """The force constant, where an axis has a current and no force."""
    if "current" not in axis.signals or "force" in axis.signals or "force" in axis.asked:
        return None
    return Need(axis.name, CONSTANT, CONSTANT, 
                f"the force constant of axis {axis.name} in {_constant_unit(axis)}")  # fmt: skip


def needs_of(file: File, axis: ProposedAxis) -> list[Need]:
    """All that the columns do not tell of an axis."""
    needs = [need for entry in entries_of(file, axis) for need in entry.needs]
    constant = constant_of(axis)
    return needs if constant is None else [*needs, constant]


_KINDS: Mapping[Quantity, str] = {
    Quantity.OTHER: "no signal of an axis by its name",
    Quantity.ACCELERATION: "an acceleration, which the position tells too",
    Quantity.DRIVE: "no force by its name",
}


def why_not(file: File, axis: ProposedAxis, column: str) -> str:
    """Why a column of an axis is none of its signals."""
    if column in axis.not_used:
        return axis.not_used[column]
    name, position = file.names[column], axis.signals.get("position")
    if name.quantity is Quantity.VELOCITY and position is not None:
        samples = file.samples_of_a_rate
        how, _ = file.column(position.name).rate(file.columns[column], samples)
        least = 0.3  # likeness of what is called one
        if how < least:
            return f"correlates with the rate of {position.column} by {how:.2f} only"
    for signal in axis.signals.values():
        alike = name.quantity is not None and signal.name.quantity is name.quantity
        if alike and (signal.name.role is name.role or signal.field in ("force", "current")):
            return f"{signal.column} is taken for the {signal.field}"
    unlike = "neither name nor course tells a signal"
    return unlike if name.quantity is None else _KINDS.get(name.quantity, unlike)
