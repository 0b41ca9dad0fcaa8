"""What the signals of an imported log say against the map that they were imported with."""

from __future__ import annotations

from collections.abc import Iterator

from twin.importers.proposal.courses import TableColumn, course, follows, sign_of
from twin.importers.proposal.motion import Explained, explained
from twin.importers.proposal.units import near
from twin.logs.log import AxisLog, Log

DOUBT, PARTIAL = "doubt.", "partial."  # entries of a log's metadata, which a check reads
PUSHES = (
    "the force helps the motion where friction resists it (negative friction); a part of the "
    "command is missing in this column, such as its feedforward; map the whole force"
)


def motion_of_force(axis: AxisLog) -> Explained | None:
    """What the motion of an axis explains of its force or current; None where it has neither."""
    found = _columns(axis)
    return None if found is None else explained(found[0].short, [found[1].short])[0]


def doubts_as_metadata(log: Log) -> dict[str, str]:
    """What the signals of a log contradict: signs, exchanged columns, sizes; a sentence each.

    As entries of the log's metadata, which a check reads: "doubt.x.0", and
    "partial.x" where a part of the force of an axis is missing for sure: it does work on friction,
    which the others of a machine with several may do. Of an axis whose counter begins again that is
    told, and nothing else is.
    """
    counted = {key.split(".")[1] for key in log.metadata if key.startswith("counter.")}
    found = {
        f"{DOUBT}{name}.{number}": doubt
        for name, axis in log.axes.items()
        if name not in counted
        for number, doubt in enumerate(_of_axis(name, axis))
    }
    alone, *others = log.axes
    motion = None if others else motion_of_force(log.axes[alone])
    if motion is not None and motion.is_partial:
        found = {f"{PARTIAL}{alone}" if PUSHES in d else key: d for key, d in found.items()}
    return found


def _of_axis(name: str, axis: AxisLog) -> Iterator[str]:
    found = _columns(axis)
    if found is None:
        return
    position, force = found
    motion = explained(position.short, [force.short])[0]
    sign = sign_of(motion, position, force)
    yield from (f"axes.{name}: {what}" for what in _of_force(motion, sign))
    if (goal := axis.columns.get("setpoint_position")) is not None:
        setpoint = TableColumn("setpoint_position", goal)
        said = _of_setpoint(position, setpoint, force, sign)
        yield from (f"axes.{name}: {what}" for what in said)


def _columns(axis: AxisLog) -> tuple[TableColumn, TableColumn] | None:
    """Position and force, or current; None where one is missing."""
    name = next((n for n in ("force", "current") if n in axis.columns), None)
    if name is None or "position" not in axis.columns:
        return None
    return TableColumn("position", axis.columns["position"]), TableColumn(name, axis.columns[name])


def _of_force(motion: Explained, sign: int) -> Iterator[str]:
    if sign < 0:
        yield (
            f"the motion explains {percent(motion.forward)} of the force, and with the sign "
            f"reversed {percent(motion.backward)}; give the force or the position sign = -1"
        )
    elif motion.pushes:
        yield PUSHES


def _of_setpoint(
    position: TableColumn, setpoint: TableColumn, force: TableColumn, sign: int
) -> Iterator[str]:
    found = course(position, setpoint)
    if found is None:
        return
    size = 2.0  # times a position, its setpoint, which no loop misses
    if not near(found.slope, size):
        yield (
            f"the setpoint is {found.slope:.4g} times as large as the position; correct the unit, "
            "the scale or the sign of one of them"
        )
    if follows(position, setpoint, force, sign) <= -2:
        yield (
            "position and setpoint_position look exchanged: the setpoint has the noise of a "
            "reading, and the force answers to it; exchange their columns"
        )


def percent(share: float) -> str:
    """A share of a force as it is told."""
    return f"{100.0 * max(share, 0.0):.0f} %"
