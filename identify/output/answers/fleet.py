"""The JSON of `twin fleet`."""

from __future__ import annotations

from typing import Any

from identify.output.answers import Answer, File, read
from identify.results.fleet import (
    Alarm,
    KindParameter,
    LiveAlarm,
    LiveCause,
    LiveParameter,
    MachineState,
    Told,
)  # fmt: skip


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


class FloorAnswer(Answer):
    """What `twin fleet report` prints: machines by what needs attention, and all alarms."""

    store: File
    machines: list[MachineState]
    alarms: list[Alarm]
    hall: list[Alarm]
    faults: list[str]


class FleetDemoAnswer(Answer):
    """What `twin fleet demo` prints: what was planted, and what was told."""

    planted: list[Told]
    alarms: list[Told]
    hall: list[Alarm] = read("floor.hall")
    false_alarms: int
    page: File


class KindAnswer(Answer):
    """What `twin fleet kind` prints; machine: whose own logs took part; null: of a new one."""

    kind: str
    machine: str | None
    parameters: list[KindParameter]
    model: File | None


class WatchAnswer(Answer):
    """What `twin watch` prints in the end; ended: whether the writer has closed the log.

    log: the file or the address that was followed. parameters: by axis, as they are in the end.
    """

    log: str
    windows: int
    ended: bool
    alarms: list[LiveAlarm]
    causes: list[LiveCause]
    parameters: dict[str, list[LiveParameter]]
    told: list[str]
