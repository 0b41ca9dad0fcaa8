"""What the signals of an imported log say against the map that they were imported with."""

from __future__ import annotations

from collections.abc import Iterator

from twin.importers.proposal.courses import Column, course, follows
from twin.importers.proposal.motion import Explained, explained
from twin.importers.proposal.units import near
from twin.logs.log import AxisLog, Log


def motion_of_force(axis: AxisLog) -> Explained | None:
    """What the motion of an axis explains of its force or current; None where it has neither."""
    name = next((n for n in ("force", "current") if n in axis.columns), None)
    if name is None or "position" not in axis.columns:
        return None
    position, force = (Column(n, axis.columns[n]).short for n in ("position", name))
    return explained(position, [force])[0]


def doubts_of_log(log: Log) -> Iterator[str]:
    """What the signals of a log contradict: signs, exchanged columns, sizes; a sentence each."""
    for name, axis in log.axes.items():
        motion = motion_of_force(axis)
        if motion is not None:
            yield from (f"axes.{name}: {what}" for what in _of_force(motion))
        if {"position", "setpoint_position"} <= axis.columns.keys():
            yield from (f"axes.{name}: {what}" for what in _of_setpoint(axis, motion))


def _of_force(motion: Explained) -> Iterator[str]:
    if motion.is_reversed:
        yield (
            f"the motion explains {percent(motion.forward)} of the force, and with the sign "
            f"reversed {percent(motion.backward)}; give the force or the position sign = -1"
        )
    elif motion.pushes:
        yield (
            "the force helps the motion where friction resists it (negative friction); a part of "
            "the command is missing in this column, such as its feedforward: map the whole force; "
            "or its sign is reversed"
        )


def _of_setpoint(axis: AxisLog, motion: Explained | None) -> Iterator[str]:
    position, setpoint = (Column(n, axis.columns[n]) for n in ("position", "setpoint_position"))
    found = course(position, setpoint)
    if found is None:
        return
    size = 2.0  # times a position, its setpoint, which no loop misses
    if not near(found.slope, size):
        yield (
            f"the setpoint is {found.slope:.4g} times as large as the position; correct the unit, "
            "the scale or the sign of one of them"
        )
    force = next((n for n in ("force", "current") if n in axis.columns), None)
    column = None if force is None else Column(force, axis.columns[force])
    sign = -1 if motion is not None and motion.is_reversed else 1
    if follows(position, setpoint, column, sign) <= -2:
        yield (
            "position and setpoint_position look exchanged: the setpoint has the noise of a "
            "reading, and the force answers to it; exchange their columns"
        )


def percent(share: float) -> str:
    """A share of a force as it is told."""
    return f"{100.0 * max(share, 0.0):.0f} %"
