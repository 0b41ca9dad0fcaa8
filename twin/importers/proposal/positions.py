"""The measured position of an axis, its rate and their setpoints: by names, then by course."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import permutations

from twin.importers.proposal.axes import DRIVING, is_drive, is_position
from twin.importers.proposal.courses import ColumnCourse, follows
from twin.importers.proposal.lexicon import Quantity, SignalRole
from twin.importers.proposal.names import Name
from twin.importers.proposal.signals import Certainty, File, ProposedAxis, Signal
from twin.importers.proposal.units import is_rate, is_raw, near, position_unit, unit_as_large

TOLD = 0.3  # of a force, from which the motion tells that it is one
RATE = 0.9  # of likeness, of a column that nothing but its course calls a rate
AS_LARGE = 1.25  # times a position, its setpoint, which a soft loop may miss


def with_position(file: File, axis: ProposedAxis) -> ProposedAxis:
    """The axis with its position, which is asked for where no column looks like one."""
    called = [n for n in file.some(axis.free, Quantity.POSITION) if is_position(n)]
    sure = [n for n in called if n.sure or n.role is SignalRole.MEASURED or n.unit]
    if names := sure or called:
        return axis.having(_of_those_called(file, axis, names))
    return _by_course(file, axis)


def _rank(name: Name) -> tuple[bool, bool, bool, bool]:
    told = name.sure or name.unit is not None
    return name.role is SignalRole.MEASURED, told, name.unit is not None, not name.smoothed


def _of_those_called(file: File, axis: ProposedAxis, names: Sequence[Name]) -> Signal:
    """The measured one, else the one whose motion makes a force, else the one that follows."""
    alike = [n for n in names if _rank(n) == max(map(_rank, names))]
    if len(alike) == 1:
        why = "so called"
        if alike[0].is_integral:
            why = "of a velocity, as no position is recorded"
        return Signal("position", alike[0], Certainty.LIKELY, (why,))
    forces = [n for n in file.some(axis.free, *DRIVING) if is_drive(n)]
    best, most = alike[0], 0.0
    for name in alike:
        share = max((e.best for e in file.explained(name, forces)), default=0.0)
        same = 0.02  # of a force, by which two readings of one motion differ
        if share > most + same or (
            share > most - same and _is_measured(file, name, best, forces[:1])
        ):
            best, most = name, max(share, most)
    others = ", ".join(n.column for n in alike if n is not best)
    why = f"so called, and measured rather than {others}"
    return Signal("position", best, Certainty.LIKELY, (why,))


def _is_measured(file: File, one: Name, other: Name, forces: Sequence[Name]) -> bool:
    """Whether of two columns of one course and size the other is the setpoint."""
    if one is other or not (found := file.course(other, one)):
        return False
    if not near(found.slope, AS_LARGE):
        return False
    force = file.column(forces[0]) if forces else None
    return follows(file.column(one), file.column(other), force) > 0


# --- a position that no name tells ----------------------------------------------------------------


def _by_course(file: File, axis: ProposedAxis) -> ProposedAxis:
    free = [n for n in file.some(axis.free, None) if not file.column(n).rises]
    if pair := _with_its_rate(file, free):
        position, velocity, how = pair
        why = f"{velocity.column} is its rate ({how:.2f})"
        return axis.having(
            Signal("position", position, Certainty.LIKELY, (why,)),
            Signal("velocity", velocity, Certainty.LIKELY, (f"the rate of {position.column}",)),
        )
    drives = [n for n in file.some(axis.free, *DRIVING) if is_drive(n)]
    if found := _that_drives(file, free, drives):
        return axis.having(found)
    asked = [n for n in file.some(axis.free, Quantity.POSITION) if n.role is SignalRole.ASKED]
    what = f"no column{axis.among} looks like a position"
    if asked:
        what = f"{asked[0].column} is a setpoint; no column looks like the measured position"
    return axis.asking({"position": f"axis {axis.name}: {what}"})


def _with_its_rate(file: File, free: Sequence[Name]) -> tuple[Name, Name, float] | None:
    """A position, its rate and how well they agree: of two such pairs of one course the later."""
    pairs = [
        (one, other, how)
        for one, other in permutations(free, 2)
        if (how := is_rate(file, one, other)) > RATE
    ]
    if not pairs:
        return None
    position = max(pairs, key=lambda p: p[2])[0]
    for one, *_ in pairs:
        if _is_measured(file, one, position, ()):
            position = one
    return max((p for p in pairs if p[0] is position), key=lambda p: p[2])


def _that_drives(file: File, free: Sequence[Name], drives: Sequence[Name]) -> Signal | None:
    """The column whose motion explains another one as its force, the measured of its course."""
    share, position, force = TOLD, None, None
    for name in free:
        others = [n for n in (drives or free) if n is not name and not file.course(name, n)]
        for other, e in zip(others, file.explained(name, others), strict=True):
            if e.both_ways and e.best > share:
                share, position, force = e.best, name, other
    if position is None or force is None:
        return None
    for other in free:
        if _is_measured(file, other, position, [force]):
            position = other
    why = f"its motion explains {100.0 * share:.0f} % of {force.column}"
    return Signal("position", position, Certainty.LIKELY, (why,))


# --- its rate, and what it was to be --------------------------------------------------------------


def with_rates(file: File, axis: ProposedAxis) -> ProposedAxis:
    """The axis with the velocities that names tell, where they go as the rate of the position."""
    position = axis.signals["position"].name
    counted = is_raw(position_unit(file, axis)[0])
    raw = [n for n in file.some(axis.free, Quantity.VELOCITY)
           if is_raw(n.unit) or (counted and n.unit is None)]  # fmt: skip
    axis = axis.without({n.column: "counted: the position tells it too" for n in raw})
    for field, asked in (("velocity", False), ("setpoint_velocity", True)):
        called = [n for n in file.some(axis.free, Quantity.VELOCITY)
                  if (n.role is SignalRole.ASKED) is asked]  # fmt: skip
        if field in axis.signals or not called:
            continue
        likely = {
            n.column: file.column(position).rate(file.column(n), file.samples_of_a_rate)[0]
            for n in called
        }
        best = max(called, key=lambda n: (likely[n.column] > 0.3, _rank(n), likely[n.column]))
        how = likely[best.column]
        # likeness to the rate of a position of what a word, or only a letter, calls one
        least = 0.3 if best.sure else RATE
        if how > least:
            sure = Certainty.SURE if how > RATE else Certainty.UNSURE
            why = f"so called, and goes as the rate of {position.column} ({how:.2f})"
            axis = axis.having(Signal(field, best, sure, (why,)))
    return axis


def with_setpoints(file: File, axis: ProposedAxis) -> ProposedAxis:
    """The axis with its setpoints: so called, or going as the position or its rate."""
    position = axis.signals["position"].name
    asked = [n for n in file.some(axis.free, Quantity.POSITION) if n.role is SignalRole.ASKED]
    called = sorted(asked, key=_rank, reverse=True)
    going = [n for n in called if file.course(position, n)]
    if going and (found := file.course(position, going[0])):
        why = f"so called, {_lag(file, found)}"
        axis = axis.having(Signal("setpoint_position", going[0], Certainty.SURE, (why,)))
    elif called:
        why = f"so called, but does not go as {position.column}"
        axis = axis.having(Signal("setpoint_position", called[0], Certainty.UNSURE, (why,)))
    else:
        axis = _setpoint_by_course(file, axis)
    return _rate_by_course(file, axis)


def _setpoint_by_course(file: File, axis: ProposedAxis) -> ProposedAxis:
    """The columns that go as the position, as large in some unit: its setpoint leads it."""
    position = axis.signals["position"].name
    unit, _ = position_unit(file, axis)
    going = [
        (name, found)
        for name in _unlike(file, axis)
        if (found := file.course(position, name))
        and unit_as_large(name, found.slope, found.likeness, unit)
    ]
    for name, found in sorted(going, key=lambda one: -one[1].likeness):
        why = f"goes as the position, {_lag(file, found)}"
        if follows(file.column(position), file.column(name)) <= 0:
            axis = axis.without({name.column: f"{why}: a second reading of it"})
            axis = replace(axis, twins=(*axis.twins, name))
        elif "setpoint_position" not in axis.signals:
            axis = axis.having(Signal("setpoint_position", name, Certainty.LIKELY, (why,)))
    return axis


def _lag(file: File, found: ColumnCourse) -> str:
    side = "ahead of" if found.behind >= 0.0 else "behind"
    lag = abs(found.behind) * (1e3 * file.step if file.step else 1.0)
    return f"{lag:.2g} {'ms' if file.step else 'rows'} {side} it"


def _rate_by_course(file: File, axis: ProposedAxis) -> ProposedAxis:
    """A setpoint of the velocity that no name tells."""
    position, setpoint = axis.signals["position"].name, axis.signals.get("setpoint_position")
    if setpoint is None or "setpoint_velocity" in axis.signals:
        return axis
    for name in _unlike(file, axis):
        how = is_rate(file, setpoint.name, name)
        if how > max(RATE, is_rate(file, position, name)):
            why = f"goes as the rate of {setpoint.column} ({how:.2f})"
            return axis.having(Signal("setpoint_velocity", name, Certainty.LIKELY, (why,)))
    return axis


def _unlike(file: File, axis: ProposedAxis) -> list[Name]:
    """Columns whose names say nothing, or what the numbers do not."""
    free = file.some(axis.free, None, Quantity.VELOCITY)
    letters = [n for n in file.some(axis.free, Quantity.DRIVE) if not n.sure]
    return [
        *free,
        *letters,
        *(n for n in file.some(axis.free, Quantity.POSITION) if is_position(n)),
    ]
