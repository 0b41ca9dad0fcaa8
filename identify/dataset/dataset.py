"""The logs of one axis, prepared for identification, each in its role."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, cached_property, partial
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from identify.dataset.beginning import beginnings
from identify.dataset.excitation import excitation
from identify.dataset.given_logs import (
    Given,
    Role,
    moving_in,
    nothing_moves,
    require_apart,
    require_one_kind,
    require_samples,
)
from identify.dataset.motion import LONGEST_BLOCK, Motion, motion_of
from identify.dataset.prepared_log import PreparedLog
from identify.dataset.reading_ripple import ripples_of_widest
from identify.dataset.test_function import LEAST_BLOCKS, require_test_function
from identify.dataset.time_scale import choose_length
from twin.effect import Excitation
from twin.logs import Log
from twin.memory import give_back
from twin.model.machine import MachineModel
from twin.model.units import AxisUnits
from twin.parallel import spread

Array = NDArray[np.float64]

TRIED = 8.0  # s of motion on which nonlinear parameters are scanned before all of it is used
SHORTEST_HEAD = 2.0  # s of each log
ENOUGH = 30.0  # s of motion in each role, in which a search is made before all of it is fitted
MARGIN = 0.05  # of the range of the training logs, by which a log of another role may exceed it
LEAST_SHARED = 0.2  # part of the logs of a role that must lie within it


@dataclass(frozen=True, eq=False, repr=False)
class Dataset:
    """One axis: its prepared logs by role, and what they cover.

    fit: the training logs. holdout: the selection logs (may be none), which take part in the choice
    of effects; no parameter is fitted on them. test: the test logs (may be none), on which nothing
    is decided. covered: gives what the training logs cover, which takes a while. channel_delay: s,
    by which the force of the logs was shifted to earlier samples. left_out: the logs that say
    nothing, by name, with the reason of each. begun: s that were left out at the beginning of logs,
    by name, as the axis did not yet move freely.
    """

    axis: str
    fit: tuple[PreparedLog, ...]
    holdout: tuple[PreparedLog, ...]
    covered: Callable[[], Excitation]
    channel_delay: float = 0.0
    left_out: Mapping[str, str] = field(default_factory=dict)
    begun: Mapping[str, float] = field(default_factory=dict)
    test: tuple[PreparedLog, ...] = ()

    @property
    def still(self) -> tuple[str, ...]:
        """Names of the logs that were left out."""
        return tuple(self.left_out)

    @property
    def beyond(self) -> dict[str, float]:
        """Part of each log, 0..1 by name, that lies where no training log has been."""
        others = (*self.holdout, *self.test)
        parts = {log.motion.name: 1.0 - float(np.mean(log.reached)) for log in others}
        return {name: part for name, part in parts.items() if part > 0.0}

    def __repr__(self) -> str:
        fit, holdout, test = (len(self.having(role)) for role in Role)
        return f"<Dataset of {self.axis}: logs: {fit} training, {holdout} selection, {test} test>"

    @property
    def excitation(self) -> Excitation:
        """What the motions of the training logs cover."""
        return self.covered()

    @property
    def logs(self) -> tuple[PreparedLog, ...]:
        """All logs: training, selection, test."""
        return (*self.fit, *self.holdout, *self.test)

    def having(self, role: Role) -> tuple[PreparedLog, ...]:
        """The logs of a role."""
        return {Role.TRAINING: self.fit, Role.SELECTION: self.holdout, Role.TEST: self.test}[role]

    def with_logs(self, logs: Iterable[PreparedLog]) -> Dataset:
        """The same with other logs in the place of ``logs``, in that order."""
        others = iter(logs)
        fit, holdout, test = (tuple(islice(others, len(self.having(role)))) for role in Role)
        return replace(self, fit=fit, holdout=holdout, test=test)

    @property
    def chosen_on(self) -> Role:
        """Role of the logs that choose; without selection logs they are the training logs."""
        return Role.SELECTION if self.holdout else Role.TRAINING

    @property
    def tested_on(self) -> Role:
        """Role of the logs whose error is reported; without test logs they chose as well."""
        return Role.TEST if self.test else self.chosen_on

    @cached_property
    def heads(self) -> tuple[PreparedLog, ...]:
        """The beginnings of the training logs, long enough to scan nonlinear parameters on."""
        each = max(TRIED / len(self.fit), SHORTEST_HEAD)
        return tuple(PreparedLog.of(w.motion.head(each), w.test_function.length) for w in self.fit)

    @cached_property
    def part(self) -> Dataset:
        """The same with the beginnings of its training and selection logs; itself if it is short.

        What a model lacks shows in them many times, and all of a long log tells little more.
        """
        return self._shortened(ENOUGH)

    def _shortened(self, seconds: float) -> Dataset:
        if all(sum(map(_length, logs)) <= seconds for logs in (self.fit, self.holdout)):
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

        return replace(self, fit=cut(self.fit), holdout=cut(self.holdout))

    @cached_property
    def in_heads(self) -> NDArray[np.bool_]:
        """Which test functions of the training logs are in their heads."""
        pairs = zip(self.heads, self.fit, strict=True)
        return np.concatenate([np.arange(len(w)) < len(h) for h, w in pairs])

    @property
    def force_noise(self) -> float:
        """N RMS by test functions, of force noise that no sensor makes."""
        return max(log.force_noise for log in self.fit)

    def with_force_noise(self, size: float) -> Dataset:
        """The same with force noise that no sensor makes, N RMS by test functions, in all logs."""
        return self.with_logs(replace(log, force_noise=size) for log in self.logs)

    @property
    def units(self) -> AxisUnits:
        """The units of the axis."""
        return self.fit[0].motion.units

    @property
    def test_function_length(self) -> float:
        """Length of the test functions, s."""
        return self.fit[0].test_function.length


def datasets(
    model: MachineModel,
    logs: Mapping[str, Log],
    holdout: Mapping[str, Log],
    test_function: float | None = None,
    test: Mapping[str, Log] | None = None,
) -> dict[str, Dataset]:
    """A dataset for each axis of the model that the logs hold and in which it moves.

    logs, holdout, test: by name, of the roles training, selection, test. test_function: length in
    s; where None, chosen from what the training and selection logs hold. Raises InputError where no
    axis of the model moves in any training log, where a log has no samples, where a signal is not a
    number, and where a log has two roles.
    """
    parts = zip(Role, (logs, holdout, test or {}), strict=True)
    given = {role: dict(part) for role, part in parts}  # each log is read once
    training = given[Role.TRAINING].values()
    require_test_function(test_function, max((len(g) * g.period for g in training), default=0.0))
    out = _prepared(model, given, test_function)
    give_back()
    return out


def _prepared(model: MachineModel, given: Given, test_function: float | None) -> dict[str, Dataset]:
    for logs in given.values():
        require_samples(logs)
    require_apart(given)
    out: dict[str, Dataset] = {}
    for name, axis in model.axes.items():
        for logs in given.values():
            require_one_kind(logs, name, axis)
        found = {role: moving_in(logs, name, tuple(model.axes)) for role, logs in given.items()}
        going = {role: moving for role, (moving, _) in found.items()}
        if going[Role.TRAINING]:
            why = f"axis {name} stands still in it; give one in which it moves"
            still = {log: why for _, names in found.values() for log in names}
            out[name] = replace(_of_axis(model, name, going, test_function), left_out=still)
    if not out:
        raise nothing_moves(model.axes, given[Role.TRAINING].values())
    return out


def _of_axis(model: MachineModel, name: str, going: Given, test_function: float | None) -> Dataset:
    """The dataset of one axis from the logs in which it moves; test logs decide nothing of it."""
    axis, machine = model.axes[name], tuple(model.axes)
    ripples = ripples_of_widest(going[Role.TRAINING].values(), name)

    def motions_at(*roles: Role) -> Callable[[float | None], tuple[list[Motion], ...]]:
        made = cache(partial(_motions, [going[r] for r in roles], name, machine, ripples))
        return partial(_long_enough, made)

    deciding = motions_at(Role.TRAINING, Role.SELECTION)
    length = test_function or choose_length(deciding, imposed=axis.is_imposed)
    fit, held = deciding(length)
    (test,) = motions_at(Role.TEST)(length)
    begun = {} if axis.is_imposed else _begun(fit, held, test)
    fit, held, test = (
        [m.after(begun[m.name]) if m.name in begun else m for m in some]
        for some in (fit, held, test)
    )
    return Dataset(
        axis=name,
        fit=tuple(spread(partial(PreparedLog.of, length=length), fit)),
        holdout=_within_reach(held, length, fit),
        test=_within_reach(test, length, fit),
        covered=cache(partial(excitation, fit, axis.hardware.travel)),
        begun=begun,
    )


def _begun(
    fit: Sequence[Motion], held: Sequence[Motion], test: Sequence[Motion]
) -> dict[str, float]:
    """Ends (s) of beginnings that are left out, by log; test logs tell those of none but them."""
    begun = dict(beginnings([*fit, *held]))
    if test:
        names = {m.name for m in test}
        own = beginnings([*fit, *test])
        begun.update({name: end for name, end in own.items() if name in names})
    return begun


def _within_reach(
    motions: Sequence[Motion], length: float, fit: Sequence[Motion]
) -> tuple[PreparedLog, ...]:
    """Logs that test a fit, where its logs have been.

    Beyond, a force of position is extrapolated, and says nothing of what is there. All of them
    where they have little in common with the training logs.
    """
    low, high = min(m.position.min() for m in fit), max(m.position.max() for m in fit)
    margin = MARGIN * (high - low)
    reach = (low - margin, high + margin)
    within = spread(lambda m: PreparedLog.of(m, length, reach), motions)
    if sum(np.count_nonzero(w.reached) for w in within) < LEAST_SHARED * sum(map(len, within)):
        return tuple(PreparedLog.of(m, length) for m in motions)
    return tuple(within)


def _length(log: PreparedLog) -> float:
    """Of its motion, s."""
    return float(log.motion.signals.shape[1] * log.motion.period)


def by_log(found: Mapping[str, Dataset]) -> dict[str, dict[str, PreparedLog]]:
    """The logs to fit by name, each prepared for the axes that move in it."""
    out: dict[str, dict[str, PreparedLog]] = {}
    for axis, dataset in found.items():
        for log in dataset.fit:
            out.setdefault(log.motion.name, {})[axis] = log
    return out


def _long_enough(
    made: Callable[[float], tuple[list[Motion], ...]], length: float | None
) -> tuple[list[Motion], ...]:
    """Motions whose blocks suit test functions of a length (s), made anew only where they do not.

    None: in blocks as long as their noise asks for.
    """
    usual = made(LONGEST_BLOCK)
    longest = max((m.period for some in usual for m in some), default=0.0)
    if length is None or length >= LEAST_BLOCKS * longest:
        return usual
    return made(length / LEAST_BLOCKS)


def _motions(
    parts: Sequence[Mapping[str, Log]],
    axis: str,
    machine: tuple[str, ...],
    ripples: tuple[float, ...],
    longest: float,
) -> tuple[list[Motion], ...]:
    """Motions of each part of the logs, in blocks of at most a length (s); ripples: m."""

    def motion(given: tuple[str, Log]) -> Motion:
        name, log = given
        return motion_of(log, axis, name, machine, longest, ripples)

    made = iter(spread(motion, [given for some in parts for given in some.items()]))
    return tuple([*islice(made, len(some))] for some in parts)
