"""Free-running position error: the model driven by the logged command, restarted at intervals.

Each prediction starts from the measured motion, with the states that the effects reach along the
measured motion up to then. After that only the command acts, and the position drifts with every
wrong force of the model.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identify.dataset.dataset import Dataset, by_log
from identify.dataset.noise_floor import noise_of
from identify.dataset.prepared_log import PreparedLog
from twin.core.control import Controller, gain_table
from twin.core.loop import N_SIGNALS, POSITION_COLUMN
from twin.core.native import LAST_ACCELERATION, LAST_VELOCITY, Table, walk
from twin.model.machine import MachineModel
from twin.signals import Array, between, local_cubic, local_parabola
from twin.simulator import MujocoSimulator, ReducedSimulator, Stepper

HORIZON = 0.5  # s between restarts
SEED = 0  # of the added noise
START_FIT = 5e-3  # s on each side of a restart from which its position and velocity are taken


@dataclass(frozen=True, eq=False)
class FreeRun:
    """Simulated minus measured position, axis -> (n,) m, with a restart every ``horizon`` s."""

    error: dict[str, Array]
    horizon: float


def free_run(
    model: MachineModel,
    logs: Mapping[str, PreparedLog],
    simulator: type[MujocoSimulator] | type[ReducedSimulator] = ReducedSimulator,
    noise: np.random.Generator | None = None,
) -> FreeRun:
    """Run the model on the commands of one log, prepared for each of its axes.

    noise: generator of measurement noise of the log's level, added to its readings and commands;
    no noise is added where None. Raises CannotRun where the motion of an axis is imposed.
    """
    model.require_mass()
    model = _as_logged(model, logs)
    position, command = _signals(model, logs, noise)
    n, period = len(position), model.period
    count = max(round(HORIZON / period), 2)
    side = max(round(START_FIT / period), 2)
    starts = np.arange(side, n - side, count)
    table = model.table()
    origin = _time_origin(logs)
    accelerated = any(f.effect.reads("A_OTHER") for a in model.axes.values() for f in a.effects)
    states = _states_at(table, position, command, period, starts, origin, accelerated)
    around = position[np.arange(-side, side + 1)[:, None] + starts]
    begun = zip(starts, states, *local_cubic(around, period), strict=True)
    out = np.full((n, len(model.axes)), np.nan)
    simulation: Stepper = simulator(model, table)
    for start, state, x, v, a in begun:
        state[table.axes[:, 2] + LAST_ACCELERATION] = a
        state[table.axes[:, 2] + LAST_VELOCITY] = v - period * a
        # The stepped position leads the true one by half a sample (see twin.core.loop).
        simulation.place(x + 0.5 * period * v, v, state, int(start), origin)
        span = slice(start, min(start + count, n))
        simulated = _open_loop(model, table, simulation, int(start), command[span])
        out[span] = simulated - position[span]
    return FreeRun({a: out[:, i] for i, a in enumerate(model.axes) if a in logs}, HORIZON)


def drift_of_noise(model: MachineModel, logs: Mapping[str, PreparedLog], run: FreeRun) -> FreeRun:
    """The drift that measurement noise alone causes in a free run on a log.

    Noise of the measured command drives the free run as well, so even the exact model has this
    error.
    """
    noisy = free_run(model, logs, noise=np.random.default_rng(SEED))
    return FreeRun({a: noisy.error[a] - run.error[a] for a in run.error}, run.horizon)


def _signals(
    model: MachineModel, logs: Mapping[str, PreparedLog], noise: np.random.Generator | None
) -> tuple[Array, Array]:
    """Readings m and commands N, (n, n_axes) each, at the log's own rate."""
    n = min(log.motion.raw.shape[1] for log in logs.values())
    position, command = np.zeros((2, n, len(model.axes)))
    for i, axis in enumerate(model.axes):
        if axis not in logs:
            position[:, i] = next(iter(logs.values())).motion.others[0].mean()
            continue
        motion = logs[axis].motion
        position[:, i] = motion.at_samples(0.0)[0][:n]
        command[:, i] = motion.raw[1][:n]
        if noise is not None:
            found = noise_of(model.axes[axis], motion)
            for signal, power in ((position, found.reading), (command, found.force)):
                signal[:, i] += np.sqrt(0.5 * power / model.period) * noise.standard_normal(n)
    return position, command


def _time_origin(logs: Mapping[str, PreparedLog]) -> float:
    """Time origin of the log, s; the same for all axes."""
    return next((log.motion.time_origin for log in logs.values() if log.motion.time_origin), 0.0)


def rms_error(run: FreeRun, axis: str) -> float:
    """RMS of the free-running position error of one axis, in m; infinite where the run diverges."""
    with np.errstate(over="ignore"):
        return float(np.sqrt(np.nanmean(run.error[axis] ** 2)))


def errors_of_both(
    before: MachineModel, after: MachineModel, axis: str, prepared: Mapping[str, Dataset]
) -> tuple[tuple[float, float] | None, float | None]:
    """Free-running position error (m RMS) on the first log: before and after, and in MuJoCo after.

    None where the motion is imposed.
    """
    if after.is_imposed:
        return None, None
    log = next(iter(by_log(prepared).values()))
    runs = (free_run(before, log), free_run(after, log), free_run(after, log, MujocoSimulator))
    was, now, replayed = (rms_error(run, axis) for run in runs)
    return (was, now), replayed


def _as_logged(model: MachineModel, logs: Mapping[str, PreparedLog]) -> MachineModel:
    """The axes at the log's rate, without sensor errors and force limit, which the log contains.

    On a machine of two axes, one that is not among the logs stands still, because effects of the
    other may depend on its position; on a machine of more it is left out.
    """
    axes = {
        name: replace(
            axis if name in logs else replace(axis, effects=()),
            hardware=replace(axis.hardware, encoder_resolution=0.0, force_limit=np.inf),
        )
        for name, axis in model.axes.items()
        if name in logs or len(model.axes) == 2
    }
    period = next(iter(logs.values())).motion.sample_period
    return replace(model, axes=axes, sample_rate=1.0 / period)


def _states_at(
    table: Table,
    position: Array,
    command: Array,
    period: float,
    starts: NDArray[np.int64],
    origin: float,
    accelerated: bool = True,
) -> Array:
    """Effect states (n_starts, n_states) after following the measured motion up to each start.

    accelerated: whether a law reads the acceleration of the other axis.
    """
    middle = 0.5 * (position[1:] + position[:-1]).T
    velocity = between(position.T, period)
    pair = len(table.axes) == 2  # no law of a larger machine reads the other axis
    acceleration = np.zeros_like(velocity)
    if pair and accelerated:
        acceleration = _smooth_acceleration(velocity, period)
    states = np.zeros(table.n_states)
    out = np.empty((len(starts), table.n_states))
    rows = np.empty((len(table.entries), middle.shape[1]))
    begin = 0
    for i, start in enumerate(starts):
        span = slice(begin, int(start))
        for a, (first, last, at, _, _) in enumerate(table.axes):
            motion = np.stack([middle[a, span], velocity[a, span], command[span, a]])
            others = np.zeros_like(motion)
            if pair:
                b = 1 - a
                others = np.stack([middle[b, span], velocity[b, span], acceleration[b, span]])
            walk(
                table.entries, first, last, table.parameters, states, at, motion, others, period,
                begin, np.ascontiguousarray(rows[:, span]), table.masses[a], origin,
            )  # fmt: skip
        out[i] = states
        begin = int(start)
    return out


def _smooth_acceleration(velocity: Array, period: float) -> Array:
    """Acceleration (n_axes, n) m/s^2 of a velocity, over the time of a start's fit."""
    samples = min(2 * max(round(START_FIT / period), 2) + 1, (velocity.shape[1] - 1) // 2 * 2 + 1)
    return local_parabola(velocity, samples, derivative=1, period=period)


def _open_loop(
    model: MachineModel, table: Table, simulation: Stepper, first: int, command: Array
) -> Array:
    n, n_axes = command.shape
    setpoints = np.zeros((n, n_axes, 4))
    setpoints[:, :, 3] = command
    off = {a: Controller() for a in model.axes}
    shared = (
        model.period,
        (table.entries, table.axes, table.parameters),
        np.zeros(table.n_states),
        gain_table(off, model.axes, model.period),
        np.zeros((n_axes, 3)),
        np.zeros(0, dtype=np.int64),
    )
    signals = np.empty((n, n_axes, N_SIGNALS))
    simulation.run(
        first, shared, setpoints, np.zeros((n, n_axes)),
        (signals, np.zeros((n, len(table.entries))), np.empty((n, 0))),
    )  # fmt: skip
    return signals[:, :, POSITION_COLUMN]
