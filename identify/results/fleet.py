"""The results of a fleet: what was ingested, what changed, how each machine stands."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import date
from enum import Enum
from pathlib import Path

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


@dataclass(frozen=True)
class Alarm:
    """A change of a parameter beyond the stated rate of false alarms, in SI units.

    machine: None where all of the kind changed. night: after which it was told; changed: the first
    night of it, with the ends of its 90 % band. before, after: means; size: their difference, with
    half the width of its 90 % band. strength: size beyond the dead band over its standard
    deviation. trend: how fast it goes on, unit a night; None where it stays. others: parameters
    that changed with it.
    """

    machine: str | None
    axis: str
    model: str
    parameter: str
    unit: str
    night: date
    changed: date
    earliest: date
    latest: date
    before: float
    after: float
    size: float
    half_width: float
    strength: float
    scope: Scope
    trend: float | None = None
    others: tuple[str, ...] = ()

    @property
    def relative(self) -> float:
        """The size over what was before."""
        return self.size / abs(self.before) if self.before else float("inf")


@dataclass(frozen=True)
class Off:
    """A machine whose parameter is far from its kind's; far: in deviations between machines."""

    machine: str
    axis: str
    parameter: str
    unit: str
    value: float
    usual: float
    far: float


@dataclass(frozen=True)
class KindParameter:
    """A parameter of a kind: mean of its machines, and their standard deviation around it.

    expected, deviation: of one machine by its own logs and its kind, and how sure that is; of one
    without a log what the kind is.
    """

    axis: str
    parameter: str
    unit: str
    mean: float
    spread: float
    machines: int
    expected: float
    deviation: float


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


@dataclass(frozen=True)
class MachineState:
    """How a machine stands. nights: that were fitted; last: the last of them; faulty: bad logs.

    ratio: force error over noise floor in the last nights, the largest of its axes.
    """

    machine: str
    model: str
    nights: int
    last: date | None
    faulty: int
    ratio: float
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


@dataclass(frozen=True)
class Told:
    """What changed on a machine, and on which night; of what was found by how much."""

    machine: str
    what: str
    night: date
    size: float | None = None
    unit: str | None = None


@dataclass(frozen=True)
class LiveAlarm:
    """A change of the force error of a machine that runs, in ``unit`` RMS.

    time: s of the log at which it was told; changed: since when.
    """

    axis: str
    time: float
    changed: float
    before: float
    after: float
    unit: str


@dataclass(frozen=True)
class LiveParameter:
    """A parameter of a machine that runs: its value now and half its 90 % band, beside the fitted.

    name: of effect and parameter, as lugre.Fc, or mass.
    """

    name: str
    value: float
    half: float
    fitted: float
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


@dataclass(frozen=True)
class LiveCause:
    """What a diagnosis of the minutes after an alarm names; none where it found nothing.

    failed: why there is none, in words; "" where there is one.
    """

    axis: str
    changed: float
    named: tuple[str, ...]
    failed: str = ""
