"""The logs of one axis, prepared for identification, each in its role."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from enum import Enum
from functools import cached_property
from itertools import islice, pairwise

import numpy as np
from numpy.typing import NDArray

from identify.dataset.odd_log import Disagreement
from identify.dataset.prepared_log import EVERYWHERE, PreparedLog, moving, within_reach
from twin.effect import Excitation
from twin.model.machine import AxisModel
from twin.model.units import AxisUnits

Array = NDArray[np.float64]

ENOUGH = 30.0  # s of motion in each role, in which a search is made before all of it is fitted
MOST_EXCHANGES = 2  # of other logs that choose, each of which takes as long as a step of a search


class Role(Enum):
    """What a log is for: parameters are fitted on it, it chooses effects, or it decides nothing."""

    TRAINING = "training"
    SELECTION = "selection"
    TEST = "test"


@dataclass(frozen=True, eq=False, repr=False)
class Dataset:
    """One axis: its prepared logs by role, and what they cover.

    training: parameters are fitted on them. selection (may be none): they take part in the choice
    of effects; no parameter is fitted on them. test: the test logs (may be none), on which nothing
    is decided. covered: gives what the training logs cover, which takes a while. channel_delay: s,
    by which the force of the logs was shifted to earlier samples. left_out: the logs that say
    nothing, by name, with the reason of each. begun: s that were left out at the beginning of logs,
    by name, as the axis did not yet move freely. looks: how many lengths of the test functions were
    looked at, of which one may show by chance what the others do not. odd: a log that disagrees
    with the others; a diagnosis is made without it. asked: s, the length that their test functions
    were made for, each as near to it as its blocks allow; None: that of the first. beside_bodies:
    whether it was asked of all joints of a mechanism at once what must move beside their bodies.
    """

    axis: str
    training: tuple[PreparedLog, ...]
    selection: tuple[PreparedLog, ...]
    covered: Callable[[], Excitation]
    channel_delay: float = 0.0
    left_out: Mapping[str, str] = field(default_factory=dict)
    begun: Mapping[str, float] = field(default_factory=dict)
    test: tuple[PreparedLog, ...] = ()
    looks: int = 1
    odd: Disagreement | None = None
    asked: float | None = None
    beside_bodies: bool = False

    @property
    def beyond(self) -> dict[str, float]:
        """Part of each log, 0..1 by name, that lies where no training log has been."""
        others = (*self.selection, *self.test)
        parts = {log.motion.name: 1.0 - float(np.mean(log.reached)) for log in others}
        return {name: part for name, part in parts.items() if part > 0.0}

    @property
    def clipped(self) -> dict[str, float]:
        """Part of each log, 0..1 by name, in which more force acted than was recorded."""
        return {
            log.motion.name: float(log.clipped.mean()) for log in self.logs if log.clipped.any()
        }

    def __repr__(self) -> str:
        counts = ", ".join(f"{len(self.having(role))} {role.value}" for role in Role)
        return f"<Dataset of {self.axis}: logs: {counts}>"

    @property
    def excitation(self) -> Excitation:
        """What the motions of the training logs cover."""
        return self.covered()

    @property
    def logs(self) -> tuple[PreparedLog, ...]:
        """All logs: training, selection, test."""
        return (*self.training, *self.selection, *self.test)

    def having(self, role: Role) -> tuple[PreparedLog, ...]:
        """The logs of a role."""
        return dict(zip(Role, (self.training, self.selection, self.test), strict=True))[role]

    def with_logs(self, logs: Iterable[PreparedLog]) -> Dataset:
        """The same with other logs in the place of ``logs``, in that order."""
        others = iter(logs)
        training, selection, test = (tuple(islice(others, len(self.having(role)))) for role in Role)
        return replace(self, training=training, selection=selection, test=test)

    def without(self, name: str) -> Dataset:
        """The same without a log; one of the next role trains where none is left.

        Without selection logs, blocks of the training logs choose.
        """
        if self.is_test(name):
            return replace(self, test=tuple(g for g in self.test if g.motion.name != name))
        training, selection, test = (
            tuple(log for log in self.having(role) if log.motion.name != name) for role in Role
        )
        if not training:
            training, selection = selection[:1], selection[1:]
        if not training:
            training, test = test[:1], test[1:]
        training = tuple(replace(log, reach=EVERYWHERE) for log in training)
        selection, test = (within_reach(logs, training) for logs in (selection, test))
        return replace(self, training=training, selection=selection, test=test)

    def at_length(self, length: float) -> Dataset:
        """The same with test functions of another length (s), which is one look more.

        Raises InputError where the logs have too few samples for it.
        """
        moved = self.with_logs(log.at_length(length) for log in self.logs)
        return replace(moved, looks=self.looks + 1, asked=length)

    @property
    def exchanged(self) -> tuple[Dataset, ...]:
        """The same with other logs choosing in turn, and all others training; none where none does.

        As many of the training logs as there are selection logs, or more where that took more turns
        than are asked; those that tell something where the others have been.
        """
        if not self.selection:
            return ()
        turns = min(-(-len(self.training) // len(self.selection)), MOST_EXCHANGES)
        ends = [round(i * len(self.training) / turns) for i in range(turns + 1)]
        others = [self._chosen_by(*span) for span in pairwise(ends)]
        roles = (Role.TRAINING, Role.SELECTION)
        return tuple(d for d in others if all(moving(d.having(r), True).any() for r in roles))

    def _chosen_by(self, first: int, end: int) -> Dataset:
        """The same with these training logs in the place of the selection logs, which train."""
        own = (replace(w, reach=EVERYWHERE) for w in self.selection)
        fit = (*self.training[:first], *self.training[end:], *own)
        return replace(self, training=fit, selection=within_reach(self.training[first:end], fit))

    def is_test(self, name: str) -> bool:
        """Whether the log of a name is a test log, which decides nothing."""
        return any(log.motion.name == name for log in self.test)

    def kept_in(self, axis: AxisModel) -> AxisModel:
        """An axis that was found on these logs, with what others need to tell the same errors."""
        return replace(axis, test_function=self.length, channel_delay=self.channel_delay)

    def forget(self) -> None:
        """Let go of what is made of the columns of its logs, where these are held."""
        shorter = self.__dict__.get("part", self)
        for log in (*self.logs, *shorter.logs, *self.__dict__.get("heads", ())):
            log.motion.forget()

    @property
    def chosen_on(self) -> Role:
        """Role of the logs that choose; without selection logs they are the training logs."""
        return Role.SELECTION if self.selection else Role.TRAINING

    @property
    def tested_on(self) -> Role:
        """Role of the logs whose error is reported; without test logs they chose as well."""
        return Role.TEST if self.test else self.chosen_on

    @cached_property
    def heads(self) -> tuple[PreparedLog, ...]:
        """The beginnings of the training logs, long enough to scan nonlinear parameters on."""
        # 8 s of motion on which nonlinear parameters are scanned before all of it is used
        each = 8.0 / min(len(self.training), 4)  # less of a log tells little
        return tuple(
            PreparedLog.of(w.motion.head(each), w.test_function.length) for w in self.training
        )

    @cached_property
    def part(self) -> Dataset:
        """The same with the beginnings of its training and selection logs; itself if it is short.

        What a model lacks shows in them many times, and all of a long log tells little more.
        """
        return self._shortened(ENOUGH)

    def _shortened(self, seconds: float) -> Dataset:
        # A beginning is whole blocks, and may be longer by half a one.
        lengths = (
            (_length(w) - w.motion.period for w in logs) for logs in (self.training, self.selection)
        )
        if all(sum(own) <= seconds for own in lengths):
            return self

        def cut(logs: tuple[PreparedLog, ...]) -> tuple[PreparedLog, ...]:
            each = seconds / max(len(logs), 1)
            return tuple(
                replace(
                    PreparedLog.of(w.motion.head(each), w.test_function.length, w.reach),
                    force_noise=w.force_noise,
                )
                for w in logs
            )

        return replace(self, training=cut(self.training), selection=cut(self.selection))

    @cached_property
    def in_heads(self) -> NDArray[np.bool_]:
        """Which test functions of the training logs are in their heads."""
        pairs = zip(self.heads, self.training, strict=True)
        return np.concatenate([np.arange(len(w)) < len(h) for h, w in pairs])

    @property
    def force_noise(self) -> float:
        """N RMS by test functions, of force noise that no sensor makes."""
        return max(log.force_noise for log in self.training)

    def with_force_noise(self, size: float) -> Dataset:
        """The same with force noise that no sensor makes, N RMS by test functions, in all logs."""
        return self.with_logs(replace(log, force_noise=size) for log in self.logs)

    @property
    def units(self) -> AxisUnits:
        """The units of the axis."""
        return self.training[0].motion.units

    @property
    def test_function_length(self) -> float:
        """Length of the test functions, s, of the first log."""
        return self.training[0].test_function.length

    @property
    def length(self) -> float:
        """The length, s, that makes the same test functions of the same logs."""
        return self.asked or self.test_function_length


def _length(log: PreparedLog) -> float:
    """Of its motion, s."""
    return float(log.motion.signals.shape[1] * log.motion.period)


def by_log(found: Mapping[str, Dataset]) -> dict[str, dict[str, PreparedLog]]:
    """The logs to fit by name, each prepared for the axes that move in it."""
    out: dict[str, dict[str, PreparedLog]] = {}
    for axis, dataset in found.items():
        for log in dataset.training:
            out.setdefault(log.motion.name, {})[axis] = log
    return out
