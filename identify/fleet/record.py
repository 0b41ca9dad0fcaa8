"""The task of one log: checked, fitted to the model of its machine, kept as one record.

What is wrong with a log is a row of its record, and stops no other.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from identify.estimation.intervals import ModelWrong, scatter
from identify.fleet.found_logs import Origin, Pattern, origin_of
from identify.fleet.models import Machine, Models
from identify.fleet.store import Row, Store
from identify.results.results import FitResult
from identify.workflow import fit
from twin.checks.long import read_checked
from twin.checks.report import CheckReport
from twin.errors import InputError
from twin.files import UNFINISHED
from twin.logs import AxisLog, Log
from twin.logs.container import MAGIC
from twin.logs.decode import log_metadata
from twin.logs.writer import software_version
from twin.parallel import parallel
from twin.telling import heard

SIGNALS = ("position", "velocity", "setpoint_position", "current", "force", "pressure",
           "pressure_2", "temperature")  # fmt: skip

WRITING = "is still being written; it is left for the next time"


class State(Enum):
    """What became of a log."""

    FITTED = "fitted"
    KNOWN = "known"
    FAULTY = "faulty"
    UNFINISHED = "unfinished"


class LogFault(Enum):
    """What keeps a log from being fitted, beside the faults that a check finds."""

    UNREADABLE = "unreadable"
    UNNAMED = "unnamed"
    NO_MODEL = "no model"
    UNFITTED = "unfitted"


class Refused(Exception):
    """A log that cannot be fitted: why, and the error in words."""

    def __init__(self, fault: LogFault, error: str) -> None:
        super().__init__(error)
        self.fault, self.error = fault, error


@dataclass(frozen=True)
class RecordOutcome:
    """What became of the log of this name; what: of one without a fit, in words."""

    name: str
    state: State
    what: str = ""


@dataclass(frozen=True)
class Task:
    """A log below a folder, the store of its record, and how its machine and model are found."""

    folder: Path
    name: str
    store: Store
    models: Models
    pattern: Pattern | None = None

    @property
    def path(self) -> Path:
        return self.folder / self.name

    @cached_property
    def digest(self) -> str:
        """Of the bytes of the log."""
        with self.path.open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()


@dataclass(frozen=True)
class FittedLog:
    """A log with the fits of its axes."""

    log: Log
    report: CheckReport
    fits: FitResult


def record(task: Task) -> RecordOutcome:
    """Make the record of a log where the store has none. It is the same whoever makes it.

    A log that is being written is left for the next time. Raises InputError where the store cannot
    be written.
    """
    try:
        before = task.path.stat()
        if _is_unfinished(task.path):
            return RecordOutcome(task.name, State.UNFINISHED, WRITING)
        about, key, found = _known(task)
        if task.store.has(key):
            return RecordOutcome(task.name, State.KNOWN)
        rows, what = _rows(task, found)
        after = task.path.stat()
    except OSError as error:
        return RecordOutcome(task.name, State.UNFINISHED, error.strerror or str(error))
    if (before.st_size, before.st_mtime_ns) != (after.st_size, after.st_mtime_ns):
        return RecordOutcome(task.name, State.UNFINISHED, WRITING)
    task.store.write(key, [{**about, **row} for row in rows])
    return RecordOutcome(task.name, State.FAULTY if what else State.FITTED, what)


def _is_unfinished(path: Path) -> bool:
    """Whether its writer has not come to an end: the closing bytes are missing."""
    with path.open("rb") as stream:
        size = stream.seek(0, 2)
        stream.seek(max(size - len(MAGIC), 0))
        return stream.read() != MAGIC or path.with_name(path.name + UNFINISHED).exists()


def _known(task: Task) -> tuple[dict[str, Any], str, tuple[Origin, Machine] | Refused]:
    """What every row of a record tells, its key, and the machine of the log or why it has none."""
    version = software_version()
    origin: Origin | None = None
    machine: Machine | None = None
    found: tuple[Origin, Machine] | Refused
    try:
        origin = _origin(task)
        with _refusing(LogFault.NO_MODEL):
            machine = task.models.of(origin.machine)
        found = origin, machine
    except Refused as error:
        found = error
    model = machine.digest if machine else task.models.digest
    parts = (task.digest, model, version, origin.axis if origin else None)
    key = hashlib.sha256(repr(parts).encode()).hexdigest()
    about = {
        "log": task.name, "log_sha256": task.digest, "version": version, "key": key,
        "model_sha256": model if machine else None,
        "model": machine.model.name if machine else None,
        "machine": origin.machine if origin else None,
        "started": origin.started if origin else None, "night": origin.night if origin else None,
    }  # fmt: skip
    return about, key, found


@contextmanager
def _refusing(fault: LogFault, place: str = "") -> Iterator[None]:
    """What cannot be used within keeps the log from being fitted; place: begins the error."""
    try:
        yield
    except InputError as error:
        raise Refused(fault, f"{place}{error}") from error


def _origin(task: Task) -> Origin:
    by_path = task.pattern.read(task.name) if task.pattern else {}
    with _refusing(LogFault.UNREADABLE):
        told = log_metadata(task.path)
    with _refusing(LogFault.UNNAMED, f"{task.name}: "):
        return origin_of(told, by_path)


def _rows(task: Task, found: tuple[Origin, Machine] | Refused) -> tuple[list[Row], str]:
    """The rows of a record, and what is wrong with the log, if anything."""
    try:
        if isinstance(found, Refused):
            raise found
        origin, machine = found
        log, report = _read(task, origin)
        errors = [str(f) for f in report.findings if f.severity.value == "error"]
        rows = list(_of_check(report))
        if not errors:
            rows += _of_fit(FittedLog(log, report, _fits(task, log, machine)))
        return rows, "; ".join(errors)
    except Refused as refused:
        row = {"kind": "finding", "severity": "error", "fault": refused.fault.name}
        return [{**row, "what": refused.error}], refused.error


def _read(task: Task, origin: Origin) -> tuple[Log, CheckReport]:
    with _refusing(LogFault.UNREADABLE):
        log, report = read_checked(task.path, SIGNALS)
    if origin.axis is None:
        return log, report
    axes = {name: axis for name, axis in log.axes.items() if name == origin.axis}
    if not axes:
        there = ", ".join(log.axes)
        text = f"{task.name}: has no axis {origin.axis}; there are {there}"
        raise Refused(LogFault.UNNAMED, text)
    told = tuple(f for f in report.findings if f.axis in axes)
    return replace(log, axes=axes), CheckReport(told)


def _fits(task: Task, log: Log, machine: Machine) -> FitResult:
    with _refusing(LogFault.UNFITTED), parallel(1), heard():
        return fit(machine.model, {task.name: log})


def _of_check(report: CheckReport) -> Iterator[Row]:
    for f in report.findings:
        yield {
            "kind": "finding", "axis": f.axis, "severity": f.severity.value,
            "fault": f.fault.name, "what": str(f),
        }  # fmt: skip


def _of_fit(made: FittedLog) -> Iterator[Row]:
    """A row a parameter that was free."""
    for axis, fitted in made.fits.fits.items():
        told = made.fits.estimates[axis]
        refused = any(isinstance(e.reason, ModelWrong) for e in told)
        # Of a model that is right both are one interval, which takes as long as a third of the fit.
        spreads = scatter(fitted).ends if refused else {e.label: (e.low, e.high) for e in told}
        common = {
            "kind": "fit", "axis": axis, "error": fitted.error, "floor": fitted.floor,
            "force_unit": fitted.axis.units.force, **_of_motion(made.log, made.log.axes[axis]),
        }  # fmt: skip
        for e in told:
            if e.free:
                low, high = spreads.get(e.label, (None, None))
                yield {
                    **common, "parameter": e.label, "unit": e.unit, "value": e.value, "low": e.low,
                    "high": e.high, "no_interval": type(e.reason).__name__ if e.reason else None,
                    "spread": None if low is None or high is None else 0.5 * (high - low),
                }  # fmt: skip


def _of_motion(log: Log, axis: AxisLog) -> Row:
    """How far, how warm and how long."""
    step = max(int(0.01 * log.sample_rate), 1)  # of 10 ms, above the noise of the readings
    temperature = axis.columns.get("temperature")
    return {
        "distance": float(np.abs(np.diff(axis.position[::step])).sum()),
        "temperature": None if temperature is None else float(np.mean(temperature)),
        "duration": len(log) * log.period,
    }
