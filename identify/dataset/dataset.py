"""The logs of one axis, prepared for identification: those to fit on and those held out."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, cached_property, partial

import numpy as np
from numpy.typing import NDArray

from identify.dataset.beginning import beginnings
from identify.dataset.excitation import excitation
from identify.dataset.motion import LONGEST_BLOCK, Motion, motion_of
from identify.dataset.prepared_log import PreparedLog
from identify.dataset.test_function import LEAST_BLOCKS
from identify.dataset.time_scale import choose_length
from twin.effect import Excitation
from twin.errors import InputError
from twin.log import Log
from twin.log.check import moves
from twin.memory import give_back
from twin.model.machine import AxisModel, MachineModel
from twin.model.units import AxisUnits

Array = NDArray[np.float64]

TRIED = 8.0  # s of motion on which nonlinear parameters are scanned before all of it is used
SHORTEST_HEAD = 2.0  # s of each log
MARGIN = 0.05  # of the range of the fit logs, by which a held-out log may exceed it
LEAST_SHARED = 0.2  # part of the held-out logs that must lie within it


@dataclass(frozen=True, eq=False, repr=False)
class Dataset:
    """One axis: its prepared fit logs and held-out logs (may be none), and what they cover.

    The held-out logs take part in the choice of effects; no parameter is fitted on them.
    covered: gives what the fit logs cover, which takes a while. channel_delay: s, by which the
    force of the logs was shifted to earlier samples. still: names of logs that were left out
    because the axis stands still in them. begun: s that were left out at the beginning of logs, by
    name, as the axis did not yet move freely.
    """

    axis: str
    fit: tuple[PreparedLog, ...]
    holdout: tuple[PreparedLog, ...]
    covered: Callable[[], Excitation]
    channel_delay: float = 0.0
    still: tuple[str, ...] = ()
    begun: Mapping[str, float] = field(default_factory=dict)

    @property
    def beyond(self) -> dict[str, float]:
        """Part of each held-out log, 0..1 by name, that lies where no fit log has been."""
        parts = {log.motion.name: 1.0 - float(np.mean(log.reached)) for log in self.holdout}
        return {name: part for name, part in parts.items() if part > 0.0}

    def __repr__(self) -> str:
        return (
            f"<Dataset of {self.axis}: {len(self.fit)} logs to fit, {len(self.holdout)} held out>"
        )

    @property
    def excitation(self) -> Excitation:
        """What the motions of the fit logs cover."""
        return self.covered()

    @property
    def logs(self) -> tuple[PreparedLog, ...]:
        """All logs, those to fit first."""
        return (*self.fit, *self.holdout)

    @cached_property
    def heads(self) -> tuple[PreparedLog, ...]:
        """The beginnings of the fit logs, long enough together to scan nonlinear parameters on."""
        each = max(TRIED / len(self.fit), SHORTEST_HEAD)
        return tuple(PreparedLog.of(w.motion.head(each), w.test_function.length) for w in self.fit)

    @cached_property
    def in_heads(self) -> NDArray[np.bool_]:
        """Which test functions of the fit logs are in their heads."""
        pairs = zip(self.heads, self.fit, strict=True)
        return np.concatenate([np.arange(len(w)) < len(h) for h, w in pairs])

    @property
    def force_noise(self) -> float:
        """N RMS by test functions, of force noise that no sensor makes."""
        return max(log.force_noise for log in self.fit)

    def with_force_noise(self, size: float) -> Dataset:
        """The same with force noise that no sensor makes, N RMS by test functions, in all logs."""
        fit, holdout = (
            tuple(replace(log, force_noise=size) for log in logs)
            for logs in (self.fit, self.holdout)
        )
        return replace(self, fit=fit, holdout=holdout)

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
) -> dict[str, Dataset]:
    """A dataset for each axis of the model that the logs hold and in which it moves.

    logs, holdout: by name, for messages. test_function: length in s; where None, chosen from what
    the logs hold. Raises InputError where no axis of the model moves in any log, where a signal is
    not a number, and where a held-out log is also one to fit.
    """
    out = _prepared(model, dict(logs), dict(holdout), test_function)  # each log is read once
    give_back()
    return out


def _prepared(
    model: MachineModel,
    logs: Mapping[str, Log],
    holdout: Mapping[str, Log],
    test_function: float | None,
) -> dict[str, Dataset]:
    _require_apart(logs, holdout)
    out: dict[str, Dataset] = {}
    for name, axis in model.axes.items():
        _require_one_kind({**logs, **holdout}, name, axis)
        going, still = _moving(logs, name)
        if not going:
            continue
        held_going, still_held = _moving(holdout, name)
        made = cache(partial(_motions, going, held_going, name, tuple(model.axes)))
        motions_at = partial(_long_enough, made)
        length = test_function or choose_length(motions_at, imposed=axis.is_imposed)
        fit, held = motions_at(length)
        begun = {} if axis.is_imposed else beginnings([*fit, *held])
        fit, held = (
            [m.after(begun[m.name]) if m.name in begun else m for m in some] for some in (fit, held)
        )
        out[name] = Dataset(
            axis=name,
            fit=tuple(PreparedLog.of(m, length) for m in fit),
            holdout=_held_out(held, length, fit),
            covered=cache(partial(excitation, fit, axis.hardware.travel)),
            still=(*still, *still_held),
            begun=begun,
        )
    if not out:
        known = sorted({a for log in logs.values() for a in log.axes})
        raise InputError(
            f"no axis of the model ({', '.join(model.axes)}) moves in the logs, which have "
            f"{', '.join(known)}; name the axes alike, or give a log in which one moves"
        )
    return out


def _held_out(
    held: Sequence[Motion], length: float, fit: Sequence[Motion]
) -> tuple[PreparedLog, ...]:
    """The held-out logs, which test a fit where its logs have been.

    Beyond, a force of position is extrapolated, and says nothing of what is there. All of them
    where they have little in common with the fit logs.
    """
    low, high = min(m.position.min() for m in fit), max(m.position.max() for m in fit)
    margin = MARGIN * (high - low)
    within = [PreparedLog.of(m, length, (low - margin, high + margin)) for m in held]
    if sum(np.count_nonzero(w.reached) for w in within) < LEAST_SHARED * sum(map(len, within)):
        return tuple(PreparedLog.of(m, length) for m in held)
    return tuple(within)


def by_log(found: Mapping[str, Dataset]) -> dict[str, dict[str, PreparedLog]]:
    """The logs to fit by name, each prepared for the axes that move in it."""
    out: dict[str, dict[str, PreparedLog]] = {}
    for axis, dataset in found.items():
        for log in dataset.fit:
            out.setdefault(log.motion.name, {})[axis] = log
    return out


def _require_apart(logs: Mapping[str, Log], holdout: Mapping[str, Log]) -> None:
    """Raise InputError where a held-out log has the samples of one to fit."""
    for held, other in holdout.items():
        for name, log in logs.items():
            if _same(log, other):
                raise InputError(
                    f"{held}: held out, but has the same samples as {name}, which is fitted, and "
                    "so cannot test the fit; give a log of another experiment"
                )


def _same(one: Log, other: Log) -> bool:
    shared = one.axes.keys() & other.axes.keys()
    return len(one) == len(other) and any(
        np.array_equal(one.axes[a].position, other.axes[a].position)
        for a in shared
        if moves(one, a)
    )


def _require_one_kind(logs: Mapping[str, Log], name: str, axis: AxisModel) -> None:
    """Raise InputError where an axis is rotary in a log and linear in the model, or vice versa."""
    units = axis.units
    for log_name, log in logs.items():
        if name in log.axes and (logged := log.axes[name].kind) != units:
            raise InputError(
                f"{log_name}: axis {name} is {logged.kind} (position in {logged.position}), but in "
                f"the model it is {units.kind} (position in {units.position}); give the model "
                f"{logged.mass_name} in {logged.mass}, or correct the units in the import map"
            )


def _moving(logs: Mapping[str, Log], axis: str) -> tuple[dict[str, Log], list[str]]:
    """The logs in which the axis moves, by name, and the names of those in which it does not."""
    held = {name: log for name, log in logs.items() if axis in log.axes}
    for name, log in held.items():
        _require_numbers(name, log, axis, "position", log.axes[axis].position)
    going = {name: log for name, log in held.items() if moves(log, axis)}
    for name, log in going.items():
        _require_numbers(name, log, axis, "force", log.axes[axis].force)
    return going, [name for name in held if name not in going]


def _long_enough(
    made: Callable[[float], tuple[list[Motion], list[Motion]]], length: float | None
) -> tuple[list[Motion], list[Motion]]:
    """Motions whose blocks suit test functions of a length (s), made anew only where they do not.

    None: in blocks as long as their noise asks for.
    """
    usual = made(LONGEST_BLOCK)
    if length is None or length >= LEAST_BLOCKS * max(m.period for some in usual for m in some):
        return usual
    return made(length / LEAST_BLOCKS)


def _motions(
    logs: Mapping[str, Log],
    holdout: Mapping[str, Log],
    axis: str,
    machine: tuple[str, ...],
    longest: float,
) -> tuple[list[Motion], list[Motion]]:
    """Motions to fit and held out, in blocks of at most a length (s)."""
    fit, held = (
        [motion_of(log, axis, name, machine, longest) for name, log in some.items()]
        for some in (logs, holdout)
    )
    return fit, held


def _require_numbers(name: str, log: Log, axis: str, signal: str, values: Array) -> None:
    """Raise InputError where a signal (n,) is not a number somewhere."""
    bad = np.flatnonzero(~np.isfinite(values))
    if len(bad):
        raise InputError(
            f"{name}: {signal} of axis {axis} is not a finite number in {len(bad)} of {len(log)} "
            f"samples, from {bad[0] * log.period:.6g} s; cut the log there, or give another"
        )
