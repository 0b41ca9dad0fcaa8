"""The logs of one axis, prepared for identification: those to fit on and those held out."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property, partial

import numpy as np
from numpy.typing import NDArray

from identify.dataset.excitation import excitation
from identify.dataset.motion import Motion, motion_of
from identify.dataset.noise_floor import noise_floor
from identify.dataset.prepared_log import PreparedLog
from identify.dataset.test_function import LEAST_BLOCKS, TestFunction
from twin.effect import Excitation
from twin.errors import InputError
from twin.log import Log
from twin.log.check import moves
from twin.model.machine import INERTIA, MASS, AxisModel, MachineModel
from twin.model.units import AxisUnits

Array = NDArray[np.float64]

TEST_FUNCTIONS = (0.02, 0.05, 0.1, 0.2)  # s, tried in this order
TRIED = 8.0  # s of motion on which nonlinear parameters are scanned before all of it is used
SHORTEST_HEAD = 2.0  # s of each log
QUIET = 0.01  # largest noise floor, as a part of the force that the inertia does not explain


@dataclass(frozen=True, eq=False, repr=False)
class Dataset:
    """One axis: its prepared fit logs and held-out logs (may be none), and what they cover.

    The held-out logs take part in the choice of effects; no parameter is fitted on them.
    covered: gives what the fit logs cover, which takes a while. channel_delay: s, by which the
    force of the logs was shifted to earlier samples. still: names of logs that were left out
    because the axis stands still in them.
    """

    axis: str
    fit: tuple[PreparedLog, ...]
    holdout: tuple[PreparedLog, ...]
    covered: Callable[[], Excitation]
    channel_delay: float = 0.0
    still: tuple[str, ...] = ()

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

    logs, holdout: by name, for messages. test_function: length in s; chosen from the noise where
    None. Raises InputError where no axis of the model moves in any log, where a signal is not a
    number, and where a held-out log is also one to fit.
    """
    _require_apart(logs, holdout)
    out: dict[str, Dataset] = {}
    for name, axis in model.axes.items():
        _require_one_kind({**logs, **holdout}, name, axis)
        fit, still = _moving(logs, name, tuple(model.axes))
        if not fit:
            continue
        held, still_held = _moving(holdout, name, tuple(model.axes))
        length = test_function or choose_test_function(fit, held, imposed=axis.is_imposed)
        out[name] = Dataset(
            axis=name,
            fit=tuple(PreparedLog.of(m, length) for m in fit),
            holdout=tuple(PreparedLog.of(m, length) for m in held),
            covered=cache(partial(excitation, fit, axis.hardware.travel)),
            still=(*still, *still_held),
        )
    if not out:
        known = sorted({a for log in logs.values() for a in log.axes})
        raise InputError(
            f"no axis of the model ({', '.join(model.axes)}) moves in the logs, which have "
            f"{', '.join(known)}; name the axes alike, or give a log in which one moves"
        )
    return out


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


def _moving(
    logs: Mapping[str, Log], axis: str, machine: Sequence[str]
) -> tuple[list[Motion], list[str]]:
    """Motions of the logs in which the axis moves, and the names of those in which it does not."""
    held = {name: log for name, log in logs.items() if axis in log.axes}
    for name, log in held.items():
        _require_numbers(name, log, axis, "position", log.axes[axis].position)
    going = {name: log for name, log in held.items() if moves(log, axis)}
    for name, log in going.items():
        _require_numbers(name, log, axis, "force", log.axes[axis].force)
    still = [name for name in held if name not in going]
    return [motion_of(log, axis, name, machine) for name, log in going.items()], still


def _require_numbers(name: str, log: Log, axis: str, signal: str, values: Array) -> None:
    """Raise InputError where a signal (n,) is not a number somewhere."""
    bad = np.flatnonzero(~np.isfinite(values))
    if len(bad):
        raise InputError(
            f"{name}: {signal} of axis {axis} is not a finite number in {len(bad)} of {len(log)} "
            f"samples, from {bad[0] * log.period:.6g} s; cut the log there, or give another"
        )


def choose_test_function(
    motions: Sequence[Motion], others: Sequence[Motion] = (), *, imposed: bool = False
) -> float:
    """The shortest test function (s) whose noise floor is small against the force to be explained.

    others: motions whose blocks it must also be long enough for. imposed: whether there is no mass.
    """
    mass = 0.0 if imposed else inertia(motions)
    longest_block = max(m.period for m in (*motions, *others))
    for length in TEST_FUNCTIONS:
        if length < LEAST_BLOCKS * longest_block:
            continue
        windows = [TestFunction.of_length(length, m.period) for m in motions]
        rest = np.concatenate(
            [
                w.mean(m.command) - mass * w.acceleration(m.velocity)
                for m, w in zip(motions, windows, strict=True)
            ]
        )
        floor = noise_floor(AxisModel(mass), list(zip(motions, windows, strict=True)))
        if floor < QUIET * np.sqrt(np.mean(rest**2)):
            return length
    return TEST_FUNCTIONS[-1]


def inertia(motions: Sequence[Motion], length: float = 0.1) -> float:
    """Rough moved mass (kg): command regressed on acceleration, direction and speed."""
    rows, forces = [], []
    for m in motions:
        w = TestFunction.of_length(length, m.period)
        direction = w.mean(np.sign(m.velocity))
        rows.append(
            np.stack(
                [w.acceleration(m.velocity), direction, w.mean(m.velocity), np.ones_like(direction)]
            )
        )
        forces.append(w.mean(m.command))
    solution = np.linalg.lstsq(np.hstack(rows).T, np.concatenate(forces), rcond=None)[0]
    least = INERTIA.lower if motions[0].units.rotary else MASS.lower
    return float(max(solution[0], least))
