"""The model beside the machine that runs now: the residual of each window, alarms when it changes.

A window is to a minute what a night is to a year: the same sequential test asks after each whether
the force error has changed, with the machine's own first windows for what is usual.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from time import monotonic, sleep
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from identify.dataset.bodies import bodies_along
from identify.dataset.given_logs import is_driven, telling_in
from identify.dataset.motion import motion_of
from identify.dataset.noise_floor import floor_of
from identify.dataset.prepared_log import PreparedLog, moving, sticks
from identify.dataset.readings import ripples_of_widest
from identify.dataset.test_function import LEAST_BLOCKS
from identify.estimation.force_balance import residual
from identify.fleet.alarms import DEAD_ERROR
from identify.fleet.change_point import AFTER, BEFORE, changes
from identify.fleet.recursion import Recursion
from identify.results.fleet import LiveAlarm, LiveAxis
from twin.errors import InputError
from twin.logs import Log
from twin.logs.log import joined, thinned
from twin.model.machine import MachineModel
from twin.parallel import parallel
from twin.signals import Array
from twin.telling import heard

WINDOW = 1.0  # s
HISTORY = 3.0  # s before a window, in which what a law remembers comes to what it is
RATE = 1000.0  # Hz: what is slower than this needs no more samples
LENGTH = 0.05  # s, of the test functions
LEVEL = 5.0  # of the test: 4 false changes in a million windows, before the dead band
LEAST = 1e-15  # N, so that no error is none: their ratios are compared
KEPT = 200  # windows that are compared with
AGAIN = 0.25  # s between two looks at the file
WINDOW_NAME = "window"  # of its log


class WindowSource(Protocol):
    """Where windows come from: a file that grows, or topics of a server."""

    ended: bool
    told: list[str]

    def windows(self, length: float) -> Iterator[tuple[float, Log]]:
        """The whole windows of that length (s) that are there by now, with their times."""
        ...

    def close(self) -> None:
        """Leave it."""


@dataclass(frozen=True, eq=False)
class Window:
    """What a window told: of each axis that moved, the alarms after it, and its samples.

    log: at about ``RATE``; end: s.
    """

    end: float
    log: Log
    axes: tuple[LiveAxis, ...] = ()
    alarms: tuple[LiveAlarm, ...] = ()


@dataclass
class Watcher:
    """What is known of a machine that runs: of each axis the force errors of the last windows.

    past: the samples before the next window, at about ``RATE``; then: when these end, s. begun: the
    error of the first windows over its noise floor.
    """

    model: MachineModel
    errors: dict[str, list[float]] = field(default_factory=dict)
    ends: dict[str, list[float]] = field(default_factory=dict)
    slow: dict[str, Recursion] = field(default_factory=dict)
    ripples: dict[str, tuple[float, ...]] = field(default_factory=dict)
    begun: dict[str, float] = field(default_factory=dict)
    windows: int = 0
    past: Log | None = None
    then: float = 0.0

    @property
    def unlike(self) -> dict[str, tuple[float, float]]:
        """By axis that was never as its model: error over noise floor as it began, and in the fit.

        No change tells of it; of a model that was not fitted it is not known.
        """
        far = 4.0  # times as far above noise, which another motion alone does to no sound model
        fits = {axis: own.above_floor for axis, own in self.model.intervals.items()}
        both = {axis: (ratio, fits[axis]) for axis, ratio in self.begun.items() if axis in fits}
        return {axis: pair for axis, pair in both.items() if pair[0] > far * max(pair[1], 1.0)}

    def take(self, start: float, log: Log) -> Window:
        """What a window tells that begins at a time, s. An axis at rest tells nothing."""
        self.windows += 1
        new = thinned(log, max(int(log.sample_rate / RATE), 1))
        follows = self.past is not None and abs(start - self.then) < new.period
        known = joined([self.past, new]) if follows and self.past is not None else new
        self.then = start + len(log) * log.period
        history = round(HISTORY * new.sample_rate)
        self.past = known.part(max(len(known) - history, 0), len(known)).copied()
        if len(known) < history + len(new):
            return Window(self.then, new)
        axes, alarms = list[LiveAxis](), list[LiveAlarm]()
        for told in self._axes(known, len(new) / len(known)):
            axes.append(told)
            errors, ends = (of.setdefault(told.axis, []) for of in (self.errors, self.ends))
            errors.append(told.error)
            ends.append(self.then)
            alarms += self._asked(told.axis)
            del errors[:-KEPT], ends[:-KEPT]
        return Window(self.then, new, tuple(axes), tuple(alarms))

    def _axes(self, log: Log, share: float) -> Iterator[LiveAxis]:
        """The axes of the model that move in the last share of a log."""
        for name, axis in self.model.axes.items():
            if name not in log.axes:
                continue
            try:
                with heard(), parallel(1):
                    logs = [self._prepared(name, log)]
                    left, some = residual(axis, logs), moving(logs, sticks(axis))
                    some[: round((1.0 - share) * len(left))] = False
                    if some.any():
                        yield self._axis_in_window(name, logs, left, some, share)
            except InputError:
                continue

    def _prepared(self, name: str, log: Log) -> PreparedLog:
        """An axis in a log. Raises InputError where it tells nothing.

        The encoder's own periods are sought once: to seek them takes as long as all else.
        """
        machine, driven = tuple(self.model.axes), is_driven(self.model.axes[name])
        if not telling_in({WINDOW_NAME: log}, name, machine, driven=driven)[0]:
            raise InputError(f"axis {name} is at rest")
        if name not in self.ripples:
            self.ripples[name] = ripples_of_widest([log], name)
        bodies = bodies_along(self.model, log, WINDOW_NAME).get(name)
        motion = motion_of(
            log, name, WINDOW_NAME, machine, LENGTH / LEAST_BLOCKS, self.ripples[name], bodies
        )
        return PreparedLog.of(motion, LENGTH)

    def _axis_in_window(
        self,
        name: str,
        logs: Sequence[PreparedLog],
        left: Array,
        some: NDArray[np.bool_],
        share: float,
    ) -> LiveAxis:
        """An axis by its residual (n,) N in these test functions, of which some (n,) count."""
        axis, errors = self.model.axes[name], self.errors.get(name, [])
        error = max(float(np.sqrt(np.mean(left[some] ** 2))), LEAST)
        usual = float(np.median(errors)) if len(errors) >= AFTER else None
        if usual is not None and name not in self.begun:
            self.begun[name] = usual / floor_of(axis, logs)
        slow = self.slow.setdefault(name, Recursion.of(axis))
        place = logs[0].motion.position
        way = float(np.abs(np.diff(place[round((1.0 - share) * len(place)) :])).sum())
        slow.take(logs, left, some, way)
        log = logs[0]
        time = self.then - log.motion.time[-1] + log.time[some]
        return LiveAxis(name, axis.units.force, time, left[some], error, usual, slow.parameters())

    def _asked(self, axis: str) -> list[LiveAlarm]:
        """The alarm of an axis, where its force error has changed."""
        errors, ends = self.errors[axis], self.ends[axis]
        if len(errors) <= BEFORE:
            return []
        told = changes(np.log(errors), np.zeros(len(errors)), DEAD_ERROR, LEVEL)
        if not told:
            return []
        first = told[-1].first
        before, after = (float(np.sqrt(np.mean(np.square(part)))) for part in
                         (errors[:first], errors[first:]))  # fmt: skip
        alarm = LiveAlarm(
            axis, ends[-1], ends[first - 1], before, after, self.model.axes[axis].units.force
        )
        del errors[:first], ends[:first]  # what is usual from now on
        return [alarm]


def watch(
    source: WindowSource, watcher: Watcher, seconds: float = WINDOW, patience: float = 10.0
) -> Iterator[Window]:
    """The windows of a machine that runs, as they come, until its writer has closed the log.

    patience: s without anything new after which it ends too. Raises InputError.
    """
    last = monotonic()
    while not source.ended and monotonic() - last < patience:
        for start, log in source.windows(seconds):
            last = monotonic()
            yield watcher.take(start, log)
        if not source.ended:
            sleep(AGAIN)
