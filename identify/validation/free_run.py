"""Free-running position error: the model driven by the logged command, restarted at intervals.

Each prediction starts from the measured motion, with the states that the effects reach along the
measured motion up to then. After that only the command acts, and the position drifts with every
wrong force of the model.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from identify.dataset.dataset import Dataset, by_log
from identify.dataset.noise import noise_of
from identify.dataset.prepared_log import PreparedLog
from identify.estimation.open_loop import (
    START_FIT,
    as_logged,
    open_loop,
    path_at_samples,
    states_along,
)
from twin.core.native import LAST_ACCELERATION, LAST_VELOCITY
from twin.errors import CannotRun
from twin.model.machine import MachineModel
from twin.signals import Array, local_cubic
from twin.simulation.simulators import MujocoSimulator, ReducedSimulator, Stepper
from twin.telling import tell

HORIZON = 0.5  # s between restarts


@dataclass(frozen=True, eq=False)
class FreeRun:
    """Simulated minus measured position, axis -> (n,) m, with a restart every HORIZON s.

    begun: samples of the log before the run, which some axis leaves out.
    """

    error: dict[str, Array]
    begun: int = 0


def free_run(
    model: MachineModel,
    logs: Mapping[str, PreparedLog],
    simulator: type[MujocoSimulator] | type[ReducedSimulator] = ReducedSimulator,
    noise: np.random.Generator | None = None,
) -> FreeRun:
    """Run the model on the commands of one log, prepared for each of its axes.

    noise: generator of measurement noise of the log's level, added to its readings and commands;
    no noise is added where None. Raises CannotRun where the motion of an axis is imposed, and
    where one of several joints does not move.
    """
    model.require_mass()
    if model.joints:  # which move each other
        simulator = MujocoSimulator
        if lacking := [axis for axis in model.axes if axis not in logs]:
            raise CannotRun(
                f"axis {', '.join(lacking)} does not move in the log, and what holds it there is "
                "not known; give a log in which all joints move"
            )
    model = as_logged(model, logs)
    position, command = _signals(model, logs, noise)
    n, period = len(position), model.period
    count = max(round(HORIZON / period), 2)
    side = max(round(START_FIT / period), 2)
    starts = np.arange(side, n - side, count)
    table = model.table()
    origins = (log.motion.time_origin for log in logs.values())  # one for all axes of the log
    origin = next(filter(None, origins), 0.0)
    accelerated = any(f.effect.reads("A_OTHER") for a in model.axes.values() for f in a.effects)
    path = _path(model, logs, n)
    states = states_along(table, position, path, command, period, starts, origin, accelerated)
    around = position[np.arange(-side, side + 1)[:, None] + starts]
    ends = [*starts[1:], n]  # the last runs on where there is no room for another start
    begun = zip(starts, ends, states, *local_cubic(around, period), strict=True)
    out = np.full((n, len(model.axes)), np.nan)
    simulation: Stepper = simulator(model, table)
    for start, end, state, x, v, a in begun:
        state[table.axes[:, 2] + LAST_ACCELERATION] = a
        state[table.axes[:, 2] + LAST_VELOCITY] = v - period * a
        # The stepped position leads the true one by half a sample (see twin.simulation.loop).
        simulation.place(x + 0.5 * period * v, v, state, int(start), origin)
        span = slice(start, end)
        simulated = open_loop(model, table, simulation, int(start), command[span])
        out[span] = simulated - position[span]
    return FreeRun({a: out[:, i] for i, a in enumerate(model.axes) if a in logs}, _begun(logs))


def drift_of_noise(model: MachineModel, logs: Mapping[str, PreparedLog], run: FreeRun) -> FreeRun:
    """The drift that noise of readings and command alone causes: the exact model has it as well."""
    noisy = free_run(model, logs, noise=np.random.default_rng(0))  # of the added noise
    for axis, error in run.error.items():
        noisy.error[axis] -= error
    return noisy


def _signals(
    model: MachineModel, logs: Mapping[str, PreparedLog], noise: np.random.Generator | None
) -> tuple[Array, Array]:
    """Readings m and commands N, (n, n_axes) each, at the log's own rate."""
    skip = {axis: _begun(logs) - log.motion.left_out for axis, log in logs.items()}
    n = min(log.motion.raw.shape[1] - skip[axis] for axis, log in logs.items())
    position, command = np.zeros((2, n, len(model.axes)))
    for i, axis in enumerate(model.axes):
        if axis not in logs:
            position[:, i] = next(iter(logs.values())).motion.others[0].mean()
            continue
        motion = logs[axis].motion
        there = slice(skip[axis], skip[axis] + n)
        position[:, i] = motion.position_at_samples(0.0)[there]
        command[:, i] = motion.raw[1][there]
        if noise is not None:
            found = noise_of(model.axes[axis], motion)
            for signal, power in ((position, found.reading), (command, found.force)):
                signal[:, i] += np.sqrt(0.5 * power / model.period) * noise.standard_normal(n)
    return position, command


def _path(model: MachineModel, logs: Mapping[str, PreparedLog], n: int) -> Array:
    """Velocities (n, n_axes) m/s that laws follow up to a start, at the log's own rate."""
    out = np.zeros((n, len(model.axes)))
    for i, axis in enumerate(model.axes):
        if axis in logs:
            skip = _begun(logs) - logs[axis].motion.left_out
            out[:, i] = path_at_samples(model.axes[axis], logs[axis])[skip : skip + n]
    return out


def _begun(logs: Mapping[str, PreparedLog]) -> int:
    """Samples of the log before the last axis begins: what one leaves out, no other has."""
    return max(log.motion.left_out for log in logs.values())


def rms_error(run: FreeRun, axis: str) -> float:
    """RMS of the free-running position error of one axis, in m; infinite where the run diverges."""
    with np.errstate(over="ignore"):
        return float(np.sqrt(np.nanmean(run.error[axis] ** 2)))


def errors_of_both(
    before: MachineModel, after: MachineModel, axis: str, prepared: Mapping[str, Dataset]
) -> tuple[tuple[float, float] | None, float | None]:
    """Free-running position error (m RMS) on the first log: before and after, and in MuJoCo after.

    None where the motion is imposed, and where a model runs away on the command of the log.
    """
    if after.is_imposed:
        return None, None
    name, log = next(iter(by_log(prepared).items()))
    with left_out_if_it_cannot_run(name):
        runs = (free_run(before, log), free_run(after, log), free_run(after, log, MujocoSimulator))
        was, now, replayed = (rms_error(run, axis) for run in runs)
        return (was, now), replayed
    return None, None


@contextmanager
def left_out_if_it_cannot_run(name: str) -> Iterator[None]:
    """Go on behind a free run on a log that a model cannot make, and say why."""
    try:
        yield
    except CannotRun as error:
        tell(f"no free run on {name}: {error}")
