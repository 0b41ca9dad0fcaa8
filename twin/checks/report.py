"""The findings of a check, as sentences."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum


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
    ALIASED = "the steps of the reading come as often as the samples"
    WEAK_EXCITATION = "the motion excites too little"
    COPY = "the log is a copy of another"
    ODD = "the log disagrees with the others"


@dataclass(frozen=True)
class Place:
    """When a fault is seen in a log.

    start: s; None: in all of it. stop: s; None: from the start on. more: how many times more after
    that; parts: in how many other parts of a long log.
    """

    start: float | None = None
    stop: float | None = None
    more: int = 0
    parts: int = 0

    @classmethod
    def first_of(cls, spans: Sequence[tuple[float, float]]) -> Place:
        """The first of some spans of time, s, and how many more there are."""
        return cls(*spans[0], more=len(spans) - 1)

    def __str__(self) -> str:
        more = f" and {self.more} more times" if self.more else ""
        parts = f", and in {self.parts} other parts" if self.parts else ""
        return f"{self._first}{more}{parts}"

    @property
    def _first(self) -> str:
        if self.start is None:
            return "whole log"
        if self.stop is None:
            return f"from {self.start:.6g} s"
        same = self.stop == self.start
        return f"{self.start:.6g} s" if same else f"{self.start:.6g} to {self.stop:.6g} s"


WHOLE = Place()


@dataclass(frozen=True)
class LogFinding:
    """One fault of one axis: what and where with numbers and units, and the remedy."""

    severity: Severity
    fault: Fault
    axis: str
    what: str
    where: Place
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

    def lines(self) -> list[str]:
        """One a finding, or that there is none."""
        every = [f"{f.severity.value}: {f}" for f in self.findings]
        return every or ["suitable for identification"]

    def __str__(self) -> str:
        return "\n".join(self.lines())
