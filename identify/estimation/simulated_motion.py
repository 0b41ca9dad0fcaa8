"""Fit of simulated motion (output error): the model driven by the command alone, over whole logs.

L. Ljung, System Identification (1999), section 4.3: least squares on simulated less measured
position, without a restart. An integrating axis sums every force error up, so the search begins at
a fit of the force residual, and again from places around it. Where each log begins (position,
velocity, states of the friction) is estimated as well, with its first readings as a prior: left
free altogether, it would take over what the model lacks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from identify.dataset.prepared_log import PreparedLog
from identify.estimation.evidence import effective_samples
from identify.estimation.fit import NEGLIGIBLE, Outcome, rms
from identify.estimation.levenberg_marquardt import Solution, minimise
from identify.estimation.open_loop import START_FIT, as_logged, open_loop, states_along
from identify.estimation.scaling import Scaling
from twin.core.native import Table
from twin.effect import Kind
from twin.errors import InputError
from twin.model.machine import AxisModel, MachineModel
from twin.model.parameters import ParameterReference, free_parameters
from twin.signals import local_cubic
from twin.simulator import ReducedSimulator

Array = NDArray[np.float64]

STARTS = 4  # of the search: the axis as given, and places around it
AROUND = 0.1  # standard deviation of those, in parts of each value
FIRST_EVALUATIONS = 10  # of the search from each, after which the best goes on with all
MOST_EVALUATIONS = 100
MOST_COMPARED = 20_000  # samples of a log
WEIGHINGS = 2  # of the beginnings against the error, which falls on the way
PROBE = 1e-2  # of the error, by which a difference step should change the position
TURNS = 4  # tries to find such a step
FIRST_STEP = 1e-4  # of a value
LEAST_READING = 1e-9  # m, below which no reading is trusted
SEED = 0  # of the places around
OF_OTHER_AXIS = ("X_OTHER", "V_OTHER", "A_OTHER")


@dataclass(frozen=True, eq=False)
class Beginning:
    """Where a log begins at sample ``first``: position m, velocity m/s, effect states (n,)."""

    first: int
    position: float
    velocity: float
    states: Array


@dataclass(frozen=True, eq=False, repr=False)
class MotionFit:
    """An axis fitted to the motion of logs.

    begun: before. beginnings: of each log. starts: RMS errors (m) at which the searches from the
    several starts stood when the best was chosen; the first is that of the axis as given.
    """

    axis: AxisModel
    begun: AxisModel
    logs: Sequence[PreparedLog]
    beginnings: Sequence[Beginning]
    outcome: Outcome
    starts: Sequence[float]

    def __repr__(self) -> str:
        return f"<MotionFit: {self.error:.4g} m over {len(self.logs)} logs>"

    @cached_property
    def errors(self) -> tuple[Array, ...]:
        """Simulated less measured position of each log, (n,) m."""
        pairs = zip(self.logs, self.beginnings, strict=True)
        return tuple(motion_error(self.axis, log, begin) for log, begin in pairs)

    @property
    def error(self) -> float:
        """RMS over all logs, m."""
        return rms(np.concatenate(self.errors))

    @cached_property
    def error_begun(self) -> float:
        """The same before the fit, begun as measured."""
        return simulated_error(self.begun, self.logs)


def fit_simulated_motion(axis: AxisModel, logs: Sequence[PreparedLog]) -> MotionFit:
    """Fit the free parameters of an axis, and the beginnings of the logs, to the motion.

    axis: with the values to start from, best those of a fit of the force residual. Raises
    InputError where an effect depends on the other axis, or no start gives a finite motion.
    """
    problem = _Problem(axis, logs)
    rng = np.random.default_rng(SEED)
    starts = [problem.start, *(problem.around(rng) for _ in range(STARTS - 1))]
    tried = [problem.solve(start, FIRST_EVALUATIONS) for start in starts]
    costs = [problem.cost(s.x) for s in tried]
    if not np.isfinite(costs).any():
        raise InputError(
            f"axis {logs[0].motion.axis}: the motion that the model makes of the command alone is "
            "not finite; fit the force residual first (--objective force)"
        )
    found = tried[int(np.nanargmin(costs))]
    for _ in range(WEIGHINGS):
        problem.weigh(found.x)
        found = problem.solve(found.x, MOST_EVALUATIONS)
    return MotionFit(
        axis=problem.axis_at(found.x),
        begun=axis,
        logs=logs,
        beginnings=problem.beginnings_at(found.x),
        outcome=Outcome.CONVERGED if found.converged else Outcome.NOT_CONVERGED,
        starts=[problem.error(s.x) for s in tried],
    )


def simulated_error(axis: AxisModel, logs: Sequence[PreparedLog]) -> float:
    """RMS of simulated less measured position over whole logs, m, each begun as measured."""
    return rms(np.concatenate([motion_error(axis, log) for log in logs]))


def motion_error(axis: AxisModel, log: PreparedLog, beginning: Beginning | None = None) -> Array:
    """Simulated less measured position (n,) m of one log; begun as measured where None."""
    return _Run(axis, log).error(axis, beginning or measured_beginning(axis, log)[0])


def measured_beginning(axis: AxisModel, log: PreparedLog) -> tuple[Beginning, Array]:
    """Where a log begins by its first readings, and how sure that is (2 + n_states,).

    As standard deviations: of position m and velocity m/s by the noise of the readings, and of each
    state of the friction by its usual size along the measured motion; 0 for a state that is known.
    """
    run = _Run(axis, log)
    table, position, period = run.model.table(), run.position, log.motion.sample_period
    side = run.first
    reading = max(log.motion.position_noise, log.motion.resolution / 12**0.5, LEAST_READING)
    around = position[: 2 * side + 1]
    x, v, _ = local_cubic(around, period)
    unit = [local_cubic(row, period)[:2] for row in np.eye(2 * side + 1)]
    surely = reading * np.linalg.norm(np.array(unit, dtype=float), axis=0)
    places = np.linspace(side, len(position) - 1, 50).astype(np.int64)
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


class _Run:
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


class _Problem:
    """Simulated less measured position as a function of internal variables.

    These are the parameters by their scaling, and the beginnings in standard deviations from what
    was measured. Rows: every log at no more than MOST_COMPARED samples, then the beginnings.
    """

    def __init__(self, axis: AxisModel, logs: Sequence[PreparedLog]) -> None:
        _require_alone(axis, logs)
        self.axis, self.logs = axis, logs
        self.scaling = Scaling(free_parameters(axis))
        self.runs = [_Run(axis, log) for log in logs]
        self.measured, self.surely = zip(
            *(measured_beginning(axis, log) for log in logs), strict=True
        )
        self.open = [np.flatnonzero(surely > 0.0) for surely in self.surely]
        low, high = self.scaling.bounds()
        begun = np.zeros(sum(len(o) for o in self.open))
        self.bounds = np.r_[low, begun - np.inf], np.r_[high, begun + np.inf]
        self.start = np.r_[np.clip(self.scaling.inside(axis), low, high), begun]
        self.parameters = len(low)
        sizes = np.where(self.scaling.is_logarithm(), 1.0, np.abs(self.start[: len(low)]))
        self.sizes = np.where(sizes > 0.0, sizes, _usual_sizes(self.scaling.where))
        self.steps = np.r_[FIRST_STEP * self.sizes, begun + 1.0]
        self.weight = 0.0
        self.weigh(self.start)

    def weigh(self, internal: Array) -> None:
        """How much a standard deviation of a beginning counts beside the error, m.

        The error is coloured, so that it holds as much as its effective number of samples.
        """
        error = np.concatenate(self._errors(internal))
        if np.isfinite(error).all():
            self.weight = rms(error) * np.sqrt(len(error) / effective_samples(error))

    def around(self, rng: np.random.Generator) -> Array:
        """A place around the start."""
        moved = self.start.copy()
        moved[: self.parameters] += AROUND * self.sizes * rng.standard_normal(self.parameters)
        return np.clip(moved, *self.bounds)

    def axis_at(self, internal: Array) -> AxisModel:
        return self.scaling.outside(self.axis, internal[: self.parameters])

    def beginnings_at(self, internal: Array) -> list[Beginning]:
        out, at = [], self.parameters
        for begun, surely, free in zip(self.measured, self.surely, self.open, strict=True):
            values = np.r_[begun.position, begun.velocity, begun.states]
            values[free] += surely[free] * internal[at : at + len(free)]
            out.append(Beginning(begun.first, values[0], values[1], values[2:]))
            at += len(free)
        return out

    def _errors(self, internal: Array) -> list[Array]:
        axis = self.axis_at(internal)
        with np.errstate(all="ignore"):
            errors = [
                run.error(axis, begin)
                for run, begin in zip(self.runs, self.beginnings_at(internal), strict=True)
            ]
        return [e[:: -(-len(e) // MOST_COMPARED)] for e in errors]

    def rows(self, internal: Array) -> Array:
        """(n,) m; not finite where the motion is not."""
        with np.errstate(all="ignore"):
            return np.r_[*self._errors(internal), self.weight * internal[self.parameters :]]

    def cost(self, internal: Array) -> float:
        rows = self.rows(internal)
        with np.errstate(all="ignore"):
            return float(rows @ rows)

    def error(self, internal: Array) -> float:
        """RMS over all logs, m."""
        with np.errstate(all="ignore"):
            return rms(np.concatenate(self._errors(internal)))

    def slopes(self, internal: Array) -> Array:
        """Differences (n, k) by steps that change the position by a small part of its error."""
        base = self.rows(internal)
        out = np.empty((len(base), len(internal)))
        wanted = PROBE * max(rms(base), LEAST_READING)
        for i in range(len(internal)):
            for _ in range(TURNS):
                step = self.steps[i]
                if internal[i] + step > self.bounds[1][i]:
                    step = -step
                moved = internal.copy()
                moved[i] += step
                change = self.rows(moved) - base
                size = rms(change) / wanted
                if not np.isfinite(size):
                    self.steps[i] *= 0.1
                elif size == 0.0 or 0.1 < size < 10.0:
                    break
                else:
                    self.steps[i] /= min(max(size, 1e-3), 1e3)
            out[:, i] = np.nan_to_num(change / step)
        return out

    def solve(self, start: Array, evaluations: int) -> Solution:
        tolerance = NEGLIGIBLE / effective_samples(np.nan_to_num(self.rows(start)))
        return minimise(
            self.rows, self.slopes, start, self.bounds,
            tolerance=tolerance, most_evaluations=evaluations,
        )  # fmt: skip


def _usual_sizes(where: Sequence[ParameterReference]) -> Array:
    """Sizes (k,) of parameters that are zero: their start value, or one."""
    return np.array([abs(c.parameter.start) or 1.0 for c in where])


def _require_alone(axis: AxisModel, logs: Sequence[PreparedLog]) -> None:
    for f in axis.effects:
        if any(f.effect.reads(signal) for signal in OF_OTHER_AXIS):
            raise InputError(
                f"axis {logs[0].motion.axis}: '{f.effect.name}' depends on the other axis, whose "
                "motion a simulation of this axis alone does not hold; use --objective force"
            )
