"""Free-running position error: the model driven by the logged command, restarted now and then.

Each window starts from the measured motion, with the effects' states as they are after following
the measured motion so far; then only the command acts, and the position drifts with every force
that the model has wrong.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from twin.control import Controller, gain_table
from twin.errors import InputError
from twin.log import Log
from twin.loop import N_SIGNALS, POSITION_COLUMN
from twin.model import StageModel
from twin.mujoco_link import passive_callback
from twin.native import Table, walk
from twin.simulator import MujocoStage, ReducedStage, Stepper

Array = NDArray[np.float64]

WINDOW = 0.5  # s between restarts
START_FIT = 5e-3  # s on each side of a restart from which its position and velocity are taken


@dataclass(frozen=True, eq=False)
class FreeRun:
    """Simulated minus measured position, axis -> (n,) m, with a restart every ``window`` s."""

    error: dict[str, Array]
    window: float


def free_run(
    model: StageModel, log: Log, stage: type[MujocoStage] | type[ReducedStage] = ReducedStage
) -> FreeRun:
    """Run the model on the logged commands. Raises InputError where an axis is not in the log."""
    missing = [a for a in model.axes if a not in log.axes]
    if missing:
        raise InputError(f"the log has no axis {', '.join(missing)}; it has {', '.join(log.axes)}")
    model = _as_logged(model, log)
    position = np.stack([log.axes[a].position for a in model.axes], axis=1)
    command = np.stack([log.axes[a].force for a in model.axes], axis=1)
    n = len(position)
    count = max(round(WINDOW / log.period), 2)
    side = max(round(START_FIT / log.period), 2)
    starts = np.arange(side, n - side, count)
    table = model.table()
    states = _states_at(table, position, command, log.period, starts)
    out = np.full((n, len(model.axes)), np.nan)
    simulation: Stepper
    with passive_callback():
        simulation = stage(model, table)
        for start, state in zip(starts, states, strict=True):
            x, v = _local_motion(position[start - side : start + side + 1], log.period)
            # The stepped position leads the true one by half a sample (see twin.loop).
            simulation.place(x + 0.5 * log.period * v, v, state, int(start))
            span = slice(start, min(start + count, n))
            simulated = _open_loop(model, table, simulation, int(start), command[span])
            out[span] = simulated - position[span]
    return FreeRun({a: out[:, i] for i, a in enumerate(model.axes)}, WINDOW)


def rms_error(run: FreeRun, axis: str) -> float:
    """RMS of the free-running position error of one axis, in m; infinite where the run diverges."""
    with np.errstate(over="ignore"):
        return float(np.sqrt(np.nanmean(run.error[axis] ** 2)))


def _as_logged(model: StageModel, log: Log) -> StageModel:
    """The model at the log's rate, with ideal sensors and no force limit: the log has both."""
    axes = {
        name: replace(
            axis,
            hardware=replace(axis.hardware, encoder_resolution=0.0, force_limit=np.inf),
        )
        for name, axis in model.axes.items()
    }
    return replace(model, axes=axes, sample_rate=log.sample_rate)


def _states_at(
    table: Table, position: Array, command: Array, period: float, starts: NDArray[np.int64]
) -> Array:
    """Effect states (n_starts, n_states) after following the measured motion up to each start."""
    middle = 0.5 * (position[1:] + position[:-1]).T
    velocity = np.diff(position, axis=0).T / period
    states = np.zeros(table.n_states)
    out = np.empty((len(starts), table.n_states))
    rows = np.empty((len(table.entries), middle.shape[1]))
    zero = np.zeros((3, middle.shape[1]))
    begin = 0
    for i, start in enumerate(starts):
        span = slice(begin, int(start))
        for a, (first, last, at, _, _) in enumerate(table.axes):
            motion = np.ascontiguousarray(
                np.stack([middle[a, span], velocity[a, span], command[span, a]])
            )
            others = zero[:, span]
            if len(table.axes) == 2:
                others = np.stack([middle[1 - a, span], velocity[1 - a, span], zero[0, span]])
            walk(
                table.entries, first, last, table.parameters, states, at, motion,
                np.ascontiguousarray(others), period, begin, np.ascontiguousarray(rows[:, span]),
                table.masses[a],
            )  # fmt: skip
        out[i] = states
        begin = int(start)
    return out


def _local_motion(position: Array, period: float) -> tuple[Array, Array]:
    """Position and velocity (n_axes,) in the middle of some samples, by a cubic."""
    half = len(position) // 2
    t = (np.arange(len(position)) - half) * period
    fit = np.polynomial.polynomial.polyfit(t / t[-1], position, 3)
    return fit[0], fit[1] / t[-1]


def _open_loop(
    model: StageModel, table: Table, simulation: Stepper, first: int, command: Array
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
