"""The model driven by a logged command alone: how a log is stepped, and from which states.

For the free run that is compared with the measured motion, and for a fit of simulated motion.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from identify.dataset.prepared_log import PreparedLog
from twin.core.control import Controller, gain_table
from twin.core.loop import N_SIGNALS, POSITION_COLUMN
from twin.core.native import Table
from twin.core.walks import walk
from twin.model.machine import MachineModel
from twin.signals import Array, between, local_parabola
from twin.simulator import Stepper

START_FIT = 5e-3  # s on each side of a start from which its position and velocity are taken


def as_logged(model: MachineModel, logs: Mapping[str, PreparedLog]) -> MachineModel:
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


def states_along(
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
    pair = len(table.axes) == 2  # no law of a larger machine reads the other axis
    smooth = None
    if pair and accelerated:
        smooth = _smooth_acceleration(between(position.T, period), period)
    states = np.zeros(table.n_states)
    out = np.empty((len(starts), table.n_states))
    begin = 0
    for i, start in enumerate(map(int, starts)):
        span = slice(begin, start)
        x = position[begin : start + 1].T
        middle, velocity = 0.5 * (x[:, 1:] + x[:, :-1]), between(x, period)
        acceleration = np.zeros_like(velocity) if smooth is None else smooth[:, span]
        rows = np.empty((len(table.entries), start - begin))
        for a, (first, last, at, _, _) in enumerate(table.axes):
            motion = np.stack([middle[a], velocity[a], command[span, a]])
            others = np.zeros_like(motion)
            if pair:
                b = 1 - a
                others = np.stack([middle[b], velocity[b], acceleration[b]])
            walk(
                table.entries, first, last, table.parameters, states, at, motion, others, period,
                begin, rows, table.masses[a], origin,
            )  # fmt: skip
        out[i] = states
        begin = start
    return out


def _smooth_acceleration(velocity: Array, period: float) -> Array:
    """Acceleration (n_axes, n) m/s^2 of a velocity, over the time of a start's fit."""
    samples = min(2 * max(round(START_FIT / period), 2) + 1, (velocity.shape[1] - 1) // 2 * 2 + 1)
    return local_parabola(velocity, samples, derivative=1, period=period)


def open_loop(
    model: MachineModel, table: Table, simulation: Stepper, first: int, command: Array
) -> Array:
    """True positions (n, n_axes) m under a command (n, n_axes) N from sample ``first`` on."""
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
