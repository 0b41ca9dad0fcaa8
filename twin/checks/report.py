"""The findings of a check, as sentences."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

WHOLE = "whole log"


class Severity(Enum):
    """ERROR: do not fit this log. WARNING: it limits what a fit can identify."""

    ERROR = "error"
    WARNING = "warning"


class Fault(Enum):
    """The kinds of fault."""

    INCOMPLETE = "a signal is missing"
    NOT_FINITE = "a sample is no number"
    TOO_SHORT = "the log is too short"
    FLAT = "a signal never changes"
    ASSUMED = "the import map assumes something"
    UNIT = "a signal is in another unit"
    SIGN = "a signal is reversed"
    PARTIAL = "a part of the force is missing"
    LAG = "one channel is late"
    MISSING = "samples are missing"
    STUCK = "the encoder stands still"
    WRAPPED = "a counter wraps"
    JOINED = "logs were joined"
    STEP = "the position steps"
    HELD = "a signal is held"
    UNEVEN = "the clock is uneven"
    DRIFT = "two clocks drift apart"
    SWAPPED = "channels are swapped"
    NOISE = "the command is noisy"
    OUTLIERS = "samples that cannot be"
    SATURATION = "the command is limited"
    COARSE_POSITION = "the position is too coarse"
    WEAK_EXCITATION = "the motion excites too little"
    COPY = "the log is a copy of another"
    ODD = "the log disagrees with the others"


@dataclass(frozen=True)
class LogFinding:
    """One fault of one axis: what and where with numbers and units, and the remedy."""

    severity: Severity
    fault: Fault
    axis: str
    what: str
    where: str
    remedy: str

    def __str__(self) -> str:
        return f"axis {self.axis}, {self.where}: {self.what}; {self.remedy}"


@dataclass(frozen=True)
class CheckReport:
    """All findings of a log, axis by axis."""

    findings: tuple[LogFinding, ...]

    @property
    def ok(self) -> bool:
        """Whether the log may be fitted: there is no error, warnings aside."""
        return all(f.severity is not Severity.ERROR for f in self.findings)
