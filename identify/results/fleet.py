"""The results of a fleet: what was ingested, what changed, how each machine stands."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import date
from enum import Enum
from pathlib import Path

from twin.record import Number, record
from twin.signals import Array


@dataclass(frozen=True)
class Ingested:
    """What became of the logs below a folder; told: of bad and unfinished ones, a line each.

    fitted and faulty ones have a record now, known ones had one, unfinished ones are being written.
    """

    folder: Path
    store: Path
    logs: int
    fitted: int
    known: int
    faulty: int
    unfinished: int
    told: tuple[str, ...] = ()


class Scope(Enum):
    """What changed: one machine, or all of a kind in one night, as with the hall's temperature."""

    MACHINE = "machine"
    HALL = "hall"


@record
class Alarm:
    """A change of a parameter beyond the stated rate of false alarms, in SI units."""

    machine: str | None
    """None where all of the kind changed."""
    axis: str
    model: str
    parameter: str
    unit: str
    night: date
    """After which it was told."""
    changed: date
    """The first night of it."""
    earliest: date
    """Of the 90 % band of that night."""
    latest: date
    before: Number
    """Mean, as of what was after."""
    after: Number
    size: Number
    half_width: Number
    """Half of the 90 % band of the size."""
    strength: Number
    """The size beyond the dead band over its standard deviation."""
    scope: Scope
    trend: Number | None = None
    """How fast it goes on, unit a night; None where it stays."""
    others: tuple[str, ...] = ()
    """Parameters that changed with it."""

    @property
    def relative(self) -> float:
        """The size over what was before."""
        return self.size / abs(self.before) if self.before else float("inf")


@record
class Off:
    """A machine whose parameter is far from its kind's."""

    machine: str
    axis: str
    parameter: str
    unit: str
    value: Number
    usual: Number
    far: Number
    """In deviations between machines."""


@record
class KindParameter:
    """A parameter of a kind: mean of its machines, and their standard deviation around it."""

    axis: str
    parameter: str
    unit: str
    mean: Number
    spread: Number
    machines: int
    expected: Number
    """Of one machine by its own logs and its kind; of one without a log what the kind is."""
    deviation: Number
    """How sure that is."""


@dataclass(frozen=True, eq=False)
class Course:
    """A parameter of a machine over n nights, not a number where there is none.

    days (n,): since 1970-01-01. distance (n,): travelled by then in its logs, m or rad. values
    (n,): as they were fitted; alone (n,): less what all machines of its kind did; half (n,): of the
    band within which parts of a log scatter (90 %). usual (n,): median of its kind.
    """

    axis: str
    parameter: str
    unit: str
    days: Array
    distance: Array
    values: Array
    alone: Array
    half: Array
    usual: Array

    @property
    def distance_unit(self) -> str:
        """That of the axis, whose torques are in N m where it is rotary."""
        return "rad" if "N m" in self.unit or "kg m" in self.unit else "m"


@record
class MachineState:
    """How a machine stands."""

    machine: str
    model: str
    nights: int
    """That were fitted."""
    last: date | None
    """The last of them."""
    faulty: int
    """Bad logs."""
    ratio: Number
    """Force error over noise floor in the last nights, the largest of its axes."""
    alarms: tuple[Alarm, ...]
    off: tuple[Off, ...]

    @property
    def attention(self) -> tuple[float, float, float]:
        """What machines are ranked by: alarms, being off from the kind, bad logs."""
        return (
            max((a.strength for a in self.alarms), default=0.0),
            max((o.far for o in self.off), default=0.0),
            self.faulty / max(self.nights + self.faulty, 1),
        )


@dataclass(frozen=True, eq=False)
class Floor:
    """All machines of a store, what needs attention first. courses: of those that are drawn.

    hall: what changed in all machines of a kind at once.
    faults: files of the store that cannot be used, a line each; causes: by alarm the effects that
    a diagnosis of the nights after it names.
    """

    store: Path
    machines: tuple[MachineState, ...]
    hall: tuple[Alarm, ...]
    courses: Mapping[str, tuple[Course, ...]]
    causes: Mapping[Alarm, tuple[str, ...]]
    faults: tuple[str, ...]

    @property
    def alarms(self) -> tuple[Alarm, ...]:
        """Those of single machines."""
        return tuple(alarm for machine in self.machines for alarm in machine.alarms)


@record
class Told:
    """What changed on a machine, and on which night; of what was found by how much."""

    machine: str
    what: str
    night: date
    size: Number | None = None
    unit: str | None = None


@record
class LiveAlarm:
    """A change of the force error of a machine that runs, in ``unit`` RMS."""

    axis: str
    time: Number
    """s of the log at which it was told."""
    changed: Number
    """s of the log since when."""
    before: Number
    after: Number
    unit: str


@record
class LiveParameter:
    """A parameter of a machine that runs: its value now, beside the fitted one."""

    name: str
    """Of effect and parameter, as lugre.Fc, or mass."""
    value: Number
    half: Number
    """Half its 90 % band."""
    fitted: Number
    unit: str


@dataclass(frozen=True, eq=False)
class LiveAxis:
    """An axis in a window of a machine that runs.

    time (n,): s; residual (n,): of the model, in ``unit``; error: its RMS. usual: RMS that was
    usual before; None as long as it is not known. parameters: the slow ones, as they are now.
    """

    axis: str
    unit: str
    time: Array
    residual: Array
    error: float
    usual: float | None
    parameters: tuple[LiveParameter, ...]

    @property
    def band(self) -> float | None:
        """Half the band within which 90 % of the residual usually lies."""
        return None if self.usual is None else 1.645 * self.usual


@record
class LiveCause:
    """What a diagnosis of the minutes after an alarm names; none where it found nothing."""

    axis: str
    changed: Number
    """s of the log since when."""
    named: tuple[str, ...]
    failed: str = ""
    """Why there is none, in words; "" where there is one."""
