"""The JSON of `twin fleet`."""

from __future__ import annotations

from datetime import date
from typing import Any

from identify.output.answers import Answer, Entry, File, Number, read


class IngestAnswer(Answer):
    """What `twin fleet ingest` prints: what became of the logs below the folder."""

    folder: File
    store: File
    logs: int
    fitted: int
    known: int
    """Logs whose record was there before."""
    faulty: int
    unfinished: int
    """Logs that are being written, or cannot be read now; they are tried again the next time."""
    told: list[str]
    """The first of the bad ones, a line each; all are in the view findings."""


class SqlAnswer(Answer):
    """What `twin fleet sql` prints."""

    columns: list[str]
    rows: list[list[Any]]


class AlarmEntry(Entry):
    """A change of a machine, or of the hall (machine: null), beyond the stated false-alarm rate."""

    machine: str | None
    axis: str
    model: str
    parameter: str
    unit: str
    night: date
    changed: date
    earliest: date
    latest: date
    before: Number
    after: Number
    size: Number
    half_width: Number
    trend: Number
    others: list[str]


class OffEntry(Entry):
    """A parameter far from what its kind has; far: standard deviations between machines."""

    axis: str
    parameter: str
    unit: str
    value: Number
    usual: Number
    far: Number


class MachineEntry(Entry):
    """How a machine stands; ratio: force error over noise floor in the last nights."""

    machine: str
    model: str
    nights: int
    last: date | None
    faulty: int
    ratio: Number
    off: list[OffEntry]


class FloorAnswer(Answer):
    """What `twin fleet report` prints: machines by what needs attention, and all alarms."""

    store: File
    machines: list[MachineEntry]
    alarms: list[AlarmEntry]
    hall: list[AlarmEntry]
    faults: list[str]


class ToldEntry(Entry):
    """What changed on a machine, and on which night."""

    machine: str
    what: str
    night: date


class FoundEntry(ToldEntry):
    """The same as an alarm tells it."""

    size: Number
    unit: str | None


class FleetDemoAnswer(Answer):
    """What `twin fleet demo` prints: what was planted, and what was told."""

    planted: list[ToldEntry]
    alarms: list[FoundEntry]
    hall: list[AlarmEntry] = read("floor.hall")
    false_alarms: int
    page: File


class KindEntry(Entry):
    """A parameter of a kind: mean and standard deviation of its machines; what is expected."""

    axis: str
    parameter: str
    unit: str
    mean: Number
    spread: Number
    machines: int
    expected: Number
    deviation: Number


class KindAnswer(Answer):
    """What `twin fleet kind` prints; machine: whose own logs took part; null: of a new one."""

    kind: str
    machine: str | None
    parameters: list[KindEntry]
    model: File | None


class LiveAlarmEntry(Entry):
    """A change of the force error (RMS); times in s of the log."""

    axis: str
    time: Number
    changed: Number
    before: Number
    after: Number
    unit: str


class LiveCauseEntry(Entry):
    """What a diagnosis of the time after an alarm named; failed: why there is none, or empty."""

    axis: str
    changed: Number
    named: list[str]
    failed: str


class LiveParameterEntry(Entry):
    """A slow parameter in the end: its value, half its 90 % band, and the fitted value."""

    name: str
    value: Number
    half: Number
    fitted: Number
    unit: str


class WatchAnswer(Answer):
    """What `twin watch` prints in the end; ended: whether the writer has closed the log.

    log: the file or the address that was followed. parameters: by axis, as they are in the end.
    """

    log: str
    windows: int
    ended: bool
    alarms: list[LiveAlarmEntry]
    causes: list[LiveCauseEntry]
    parameters: dict[str, list[LiveParameterEntry]]
    told: list[str]
