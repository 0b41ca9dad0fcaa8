"""Why the force error of a machine that runs has changed: the diagnosis of the last minutes.

It runs in a process of its own, as it takes longer than a window, and the machine goes on.
"""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor, Future
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from identify.fleet.watch import Window
from identify.results.fleet import LiveAlarm, LiveCause
from identify.workflow import diagnose
from twin.effects import load_catalogue
from twin.engine import local
from twin.errors import InputError
from twin.logs import Log
from twin.logs.log import joined
from twin.model.machine import MachineModel
from twin.parallel import parallel
from twin.telling import heard

KEPT = 180.0  # s that are held: three minutes at 1 kHz of two axes are 12 MB
ENOUGH = 30.0  # s since the change, from which on it is diagnosed
LEAST = 9.0  # s, with which it is tried where no more comes
ROLES = 3  # one log to fit, one to choose, one to test
POLITE = 10  # by how much it gives way to what watches


@dataclass
class Background:
    """The last minutes of a machine, and the diagnoses that are asked for and those that run."""

    model: MachineModel
    executor: Executor
    effects: tuple[Path, ...] = ()
    held: deque[Window] = field(default_factory=deque)
    asked: list[LiveAlarm] = field(default_factory=list)
    running: list[tuple[LiveAlarm, Future[tuple[str, ...]]]] = field(default_factory=list)

    def take(self, window: Window) -> None:
        """Hold a window, remember its alarms, and begin what can be diagnosed by now."""
        if self.held and _is_apart(self.held[-1], window):  # what lies behind it is another log
            self._begin(LEAST)
            self.held.clear()
        self.held.append(window)
        while self.held[-1].end - self.held[0].end > KEPT:
            self.held.popleft()
        # Only a residual that grew has a cause that the model lacks.
        self.asked += [alarm for alarm in window.alarms if alarm.after > alarm.before]
        self._begin(ENOUGH)

    def ended(self) -> Iterator[LiveCause]:
        """What came out of those that have ended."""
        for alarm, future in self.running:
            if future.done():
                yield _cause(alarm, future)
        self.running = [(a, f) for a, f in self.running if not f.done()]

    def rest(self) -> Iterator[LiveCause]:
        """What comes out of all that are asked for or run; waits for them."""
        self._begin(LEAST)
        for alarm in self.asked:
            yield LiveCause(alarm.axis, alarm.changed, (), f"less than {LEAST:g} s since then")
        for alarm, future in self.running:
            yield _cause(alarm, future)
        self.asked, self.running = [], []

    def _begin(self, least: float) -> None:
        """Begin those with so many seconds since their change."""
        for alarm in list(self.asked):
            since = [w.log for w in self.held if w.end - _length(w) >= alarm.changed - w.log.period]
            if sum(len(log) * log.period for log in since) >= least:
                self.asked.remove(alarm)
                log = joined(since)
                job = self.executor.submit(named_in, self.model, alarm.axis, log, self.effects)
                self.running.append((alarm, job))


@contextmanager
def background(model: MachineModel, effects: Sequence[Path] = ()) -> Iterator[Background]:
    """A process that diagnoses, which is started with the first alarm; it ends with this."""
    with local(1) as (executor, _):
        yield Background(model, executor, tuple(effects))


def named_in(
    model: MachineModel, axis: str, log: Log, effects: Sequence[Path] = ()
) -> tuple[str, ...]:
    """The effects that a diagnosis of a log names on an axis. Raises InputError."""
    if hasattr(os, "nice"):
        os.nice(POLITE - os.nice(0))
    own = MachineModel(model.name, {axis: model.axes[axis]}, log.sample_rate)
    each = len(log) // ROLES
    parts: list[Mapping[str, Log]] = [
        {f"part {i + 1}": log.part(i * each, (i + 1) * each)} for i in range(ROLES)
    ]
    with heard(), parallel(1):
        found = diagnose(own, *parts, catalogue=load_catalogue(effects))
    return tuple(found.axes[axis].named) if axis in found.axes else ()


def _cause(alarm: LiveAlarm, future: Future[tuple[str, ...]]) -> LiveCause:
    try:
        return LiveCause(alarm.axis, alarm.changed, future.result())
    except InputError as error:
        return LiveCause(alarm.axis, alarm.changed, (), str(error))


def _is_apart(before: Window, window: Window) -> bool:
    """Whether there is a gap between two windows."""
    return abs(before.end + _length(window) - window.end) > window.log.period


def _length(window: Window) -> float:
    return len(window.log) * window.log.period
