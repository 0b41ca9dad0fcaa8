"""One log simulated again: the motion that the command alone makes, from where the log begins."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identify.dataset.prepared_log import PreparedLog
from identify.estimation.evidence import rms
from identify.estimation.open_loop import START_FIT, as_logged, open_loop, states_along
from twin.core.native import Table
from twin.effect import Kind
from twin.model.machine import AxisModel, MachineModel
from twin.signals import local_cubic
from twin.simulator import ReducedSimulator

Array = NDArray[np.float64]

LEAST_READING = 1e-9  # m, below which no reading is trusted
PLACES = 50  # along a log, at which the usual size of a state is seen


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
    return Replay(axis, log).error(axis, beginning or measured_beginning(axis, log)[0])


def measured_beginning(axis: AxisModel, log: PreparedLog) -> tuple[Beginning, Array]:
    """Where a log begins by its first readings, and how sure that is (2 + n_states,).

    As standard deviations: of position m and velocity m/s by the noise of the readings, and of each
    state of the friction by its usual size along the measured motion; 0 for a state that is known.
    """
    run = Replay(axis, log)
    table, position, period = run.model.table(), run.position, log.motion.sample_period
    side = run.first
    reading = max(log.motion.position_noise, log.motion.resolution / 12**0.5, LEAST_READING)
    around = position[: 2 * side + 1]
    x, v, _ = local_cubic(around, period)
    unit = [local_cubic(row, period)[:2] for row in np.eye(2 * side + 1)]
    surely = reading * np.linalg.norm(np.array(unit, dtype=float), axis=0)
    places = np.linspace(side, len(position) - 1, PLACES).astype(np.int64)
    along = states_along(table, position[:, None], run.command[:, None], period, places, 0.0, False)
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


class Replay:
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
        # The stepped position leads the true one by half a sample (see twin.core.loop).
        lead = 0.5 * self.period * begin.velocity
        states = begin.states.copy()
        simulation.place(
            np.array([begin.position + lead]), np.array([begin.velocity]), states, begin.first,
            self.origin,
        )  # fmt: skip
        command = self.command[begin.first :, None]
        simulated = open_loop(model, table, simulation, begin.first, command)[:, 0]
        return simulated - self.position[begin.first :]
