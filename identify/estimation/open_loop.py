"""The model driven by a logged command alone: how a log is stepped, and from which states.

For the free run that is compared with the measured motion, and for a fit of simulated motion.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identify.dataset.prepared_log import PreparedLog
from identify.estimation.evidence import rms
from identify.estimation.force_balance import settled
from twin.core.native import Table
from twin.core.walks import walk
from twin.effect import Kind
from twin.model.machine import AxisModel, MachineModel
from twin.signals import Array, between, local_cubic, local_parabola
from twin.simulation.loop import N_SIGNALS, POSITION_COLUMN, Controller, gain_table
from twin.simulation.simulators import ReducedSimulator, Stepper

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
    path: Array,
    command: Array,
    period: float,
    starts: NDArray[np.int64],
    origin: float,
    accelerated: bool = True,
) -> Array:
    """Effect states (n_starts, n_states) after following the measured motion up to each start.

    position, command (n, n_axes): as measured, m and N. path (n, n_axes): m/s, the velocity that
    the laws follow. accelerated: whether a law reads the acceleration of the other axis.
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
            motion = np.stack([middle[a], path[span, a], command[span, a]])
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


def path_at_samples(axis: AxisModel, log: PreparedLog) -> Array:
    """Velocity (n,) m/s that an axis' laws follow, at the log's own rate."""
    (log,) = settled(axis, [log])
    motion = log.motion
    if motion.path is None or not any(f.effect.remembers for f in axis.effects):
        return motion.raw[0]
    path = motion.path.at_samples
    return (
        path if motion.slip is None else path + np.repeat(motion.slip.velocity, motion.path.samples)
    )


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


LEAST_READING = 1e-9  # m, below which no reading is trusted


@dataclass(frozen=True, eq=False)
class Beginning:
    """Where a log begins at sample ``first``: position m, velocity m/s, effect states (n,)."""

    first: int
    position: float
    velocity: float
    states: Array


def simulated_error(axis: AxisModel, logs: Sequence[PreparedLog]) -> float:
    """RMS of simulated less measured position over whole logs, m, each begun as measured."""
    return rms(np.concatenate([motion_error(axis, log) for log in logs]))


def motion_error(axis: AxisModel, log: PreparedLog, beginning: Beginning | None = None) -> Array:
    """Simulated less measured position (n,) m of one log; begun as measured where None."""
    return OpenLoopRun(axis, log).error(axis, beginning or measured_beginning(axis, log)[0])


def measured_beginning(axis: AxisModel, log: PreparedLog) -> tuple[Beginning, Array]:
    """Where a log begins by its first readings, and how sure that is (2 + n_states,).

    As standard deviations: of position m and velocity m/s by the noise of the readings, and of each
    state of the friction by its usual size along the measured motion; 0 for a state that is known.
    """
    run = OpenLoopRun(axis, log)
    table, position, period = run.model.table(), run.position, log.motion.sample_period
    side = run.first
    reading = max(log.motion.position_noise, log.motion.resolution / 12**0.5, LEAST_READING)
    around = position[: 2 * side + 1]
    x, v, _ = local_cubic(around, period)
    unit = [local_cubic(row, period)[:2] for row in np.eye(2 * side + 1)]
    surely = reading * np.linalg.norm(np.array(unit, dtype=float), axis=0)
    # along a log, at which the usual size of a state is seen
    places = np.linspace(side, len(position) - 1, 50).astype(np.int64)
    path = path_at_samples(axis, log)[:, None]
    along = states_along(
        table, position[:, None], path, run.command[:, None], period, places, 0.0, False
    )
    usual = np.sqrt(np.mean(along**2, axis=0)) * _of_friction(axis, table)
    return Beginning(side, float(x), float(v), along[0]), np.concatenate([surely, usual])


def _of_friction(axis: AxisModel, table: Table) -> NDArray[np.bool_]:
    """Which states are those of the friction."""
    out = np.zeros(table.n_states, dtype=bool)
    for (_, name), entry in zip(table.labels, table.entries, strict=True):
        effect = axis[name].effect
        if effect.kind is Kind.FRICTION:
            out[int(entry[3]) : int(entry[3]) + len(effect.states)] = True
    return out


class OpenLoopRun:
    """One log to be simulated again and again on one axis."""

    def __init__(self, axis: AxisModel, log: PreparedLog) -> None:
        motion = log.motion
        machine = MachineModel("", {motion.axis: axis}, 1.0 / motion.sample_period)
        self.model = as_logged(machine, {motion.axis: log})
        self.position, _, self.command = motion.at_samples(0.0)
        self.period, self.origin = motion.sample_period, motion.time_origin
        self.first = max(round(START_FIT / self.period), 2)

    def error(self, axis: AxisModel, begin: Beginning) -> Array:
        """(n,) m, from the beginning on."""
        ((name, own),) = self.model.axes.items()
        model = self.model.with_axis(name, replace(axis, hardware=own.hardware))
        table = model.table()
        simulation = ReducedSimulator(model, table)
        # The stepped position leads the true one by half a sample (see twin.simulation.loop).
        lead = 0.5 * self.period * begin.velocity
        states = begin.states.copy()
        simulation.place(
            np.array([begin.position + lead]), np.array([begin.velocity]), states, begin.first,
            self.origin,
        )  # fmt: skip
        command = self.command[begin.first :, None]
        simulated = open_loop(model, table, simulation, begin.first, command)[:, 0]
        return simulated - self.position[begin.first :]
