"""The model beside the machine that runs now: the residual of each window, alarms when it changes.

A window is to a minute what a night is to a year: the same sequential test asks after each whether
the force error has changed, with the machine's own first windows for what is usual.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from time import monotonic, sleep

import numpy as np

from identify.dataset.preparation import datasets
from identify.dataset.prepared_log import moving, sticks
from identify.estimation.force_balance import residual
from identify.fleet.alarms import DEAD_ERROR
from identify.fleet.change_point import BEFORE, changes
from identify.results.fleet import LiveAlarm
from twin.errors import InputError
from twin.logs import Log
from twin.logs.follow import Follower
from twin.logs.log import joined, thinned
from twin.model.machine import MachineModel
from twin.parallel import parallel
from twin.telling import heard

WINDOW = 1.0  # s
HISTORY = 3.0  # s before a window, in which what a law remembers comes to what it is
RATE = 1000.0  # Hz: what is slower than this needs no more samples
LENGTH = 0.05  # s, of the test functions
LEVEL = 5.0  # of the test: 4 false changes in a million windows, before the dead band
LEAST = 1e-15  # N, so that no error is none: their ratios are compared
KEPT = 200  # windows that are compared with
AGAIN = 0.25  # s between two looks at the file


@dataclass
class Watcher:
    """What is known of a machine that runs: of each axis the force errors of the last windows.

    past: the samples before the next window, at about ``RATE``; then: when these end, s.
    """

    model: MachineModel
    errors: dict[str, list[float]] = field(default_factory=dict)
    ends: dict[str, list[float]] = field(default_factory=dict)
    windows: int = 0
    past: Log | None = None
    then: float = 0.0

    def take(self, start: float, log: Log) -> Iterator[LiveAlarm]:
        """The alarms of a window that begins at a time, s. An axis at rest tells nothing."""
        self.windows += 1
        new = thinned(log, max(int(log.sample_rate / RATE), 1))
        follows = self.past is not None and abs(start - self.then) < new.period
        known = joined([self.past, new]) if follows and self.past is not None else new
        self.then = start + len(log) * log.period
        history = round(HISTORY * new.sample_rate)
        self.past = known.part(max(len(known) - history, 0), len(known)).copied()
        if len(known) < history + len(new):
            return
        for axis, error in self._errors(known, len(new) / len(known)):
            errors, ends = (of.setdefault(axis, []) for of in (self.errors, self.ends))
            errors.append(error)
            ends.append(self.then)
            alarm = self._asked(axis)
            if alarm is not None:
                yield alarm
            del errors[:-KEPT], ends[:-KEPT]

    def _errors(self, log: Log, share: float) -> Iterator[tuple[str, float]]:
        """By axis the RMS force error of the model as it is in the last share of a log, N."""
        for axis, own in self.model.axes.items():
            if axis not in log.axes:
                continue
            alone = MachineModel(self.model.name, {axis: own}, log.sample_rate)
            try:
                with heard(), parallel(1):
                    found = datasets(alone, {"window": log}, {}, LENGTH)[axis].training
            except InputError:
                continue
            left, moves = residual(own, found), moving(found, sticks(own))
            first = round((1.0 - share) * len(left))
            seen = left[first:][moves[first:]]
            if len(seen):
                yield axis, max(float(np.sqrt(np.mean(seen**2))), LEAST)

    def _asked(self, axis: str) -> LiveAlarm | None:
        errors, ends = self.errors[axis], self.ends[axis]
        if len(errors) <= BEFORE:
            return None
        told = changes(np.log(errors), np.zeros(len(errors)), DEAD_ERROR, LEVEL)
        if not told:
            return None
        first = told[-1].first
        before, after = (float(np.sqrt(np.mean(np.square(part)))) for part in
                         (errors[:first], errors[first:]))  # fmt: skip
        alarm = LiveAlarm(
            axis, ends[-1], ends[first - 1], before, after, self.model.axes[axis].units.force
        )
        del errors[:first], ends[:first]  # what is usual from now on
        return alarm


def watch(
    follower: Follower, watcher: Watcher, seconds: float = WINDOW, patience: float = 10.0
) -> Iterator[LiveAlarm]:
    """The alarms of a log that is being written, as they come, until its writer has closed it.

    patience: s without anything new after which it ends too. Raises InputError.
    """
    last = monotonic()
    while not follower.ended and monotonic() - last < patience:
        for start, log in follower.windows(seconds):
            last = monotonic()
            yield from watcher.take(start, log)
        if not follower.ended:
            sleep(AGAIN)
