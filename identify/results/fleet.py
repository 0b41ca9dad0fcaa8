"""The results of a fleet: what was ingested, what changed, how each machine stands."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import date
from enum import Enum
from pathlib import Path


@dataclass(frozen=True)
class Ingested:
    """What became of the logs below a folder; told: of bad ones, a line each.

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
    deviation. steps: how often it changed that way by now. others: parameters that changed with it.
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
    steps: int = 1
    others: tuple[str, ...] = ()

    @property
    def relative(self) -> float:
        """The size over what was before."""
        return self.size / abs(self.before) if self.before else float("inf")
