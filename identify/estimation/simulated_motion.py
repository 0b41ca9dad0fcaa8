"""Fit of simulated motion (output error): the model driven by the command alone, over whole logs.

L. Ljung, System Identification (1999), section 4.3: least squares on simulated less measured
position, without a restart. An integrating axis sums every force error up, so the search begins at
a fit of the force residual, and again from places around it. Where each log begins (position,
velocity, states of the friction) is estimated as well, with its first readings as a prior: left
free altogether, it would take over what the model lacks.

A model that is wrong comes to rest at other instants than the machine. Each such instant makes a
dent in the error, and a search along slopes ends in the first one; there a population goes on, then
a simplex. R. Storn, K. Price, "Differential evolution", J. Global Optim. 11 (1997); J. Nelder,
R. Mead, "A simplex method for function minimization", Comput. J. 7 (1965), as in the thesis.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from identify.dataset.prepared_log import PreparedLog
from identify.estimation.evidence import effective_samples, rms
from identify.estimation.fit import Outcome
from identify.estimation.least_squares import MOST_EVALUATIONS, Solution, minimise
from identify.estimation.open_loop import (
    LEAST_READING,
    Beginning,
    OpenLoopRun,
    measured_beginning,
    motion_error,
    simulated_error,
)
from identify.estimation.scaling import Scaling
from twin.errors import InputError
from twin.model.machine import AxisModel
from twin.signals import Array

AROUND = 0.1  # standard deviation of those, in parts of each value
FIRST_EVALUATIONS = 10  # of the search from each, after which the best goes on with all
TOLERANCE = 1e-4  # relative fall of the squared error that dents make, below which the search ends
OF_OTHER_AXIS = ("X_OTHER", "V_OTHER", "A_OTHER")


@dataclass(frozen=True, eq=False, repr=False)
class MotionFit:
    """An axis fitted to the motion of logs.

    begun: before. beginnings: of each log. errors_of_starts: RMS (m), at which the searches from
    the several starts stood when the best was chosen; the first is that of the axis as given.
    """

    axis: AxisModel
    begun: AxisModel
    logs: Sequence[PreparedLog]
    beginnings: Sequence[Beginning]
    outcome: Outcome
    errors_of_starts: Sequence[float]

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
    rng = np.random.default_rng(0)  # of the places around
    # of the search: the axis as given, and places around it
    starts = [problem.start, *(problem.around(rng) for _ in range(4 - 1))]
    tried = [problem.solve(problem.begun_well(start), FIRST_EVALUATIONS) for start in starts]
    costs = [problem.cost(s.x) for s in tried]
    if not np.isfinite(costs).any():
        raise InputError(
            f"axis {logs[0].motion.axis}: the motion that the model makes of the command alone is "
            "not finite; fit the force residual first"
        )
    found = problem.settled(tried[int(np.nanargmin(costs))].x)
    if problem.scaling.where and problem.is_rough(found.x):
        found = min(
            (found, problem.settled(problem.searched(found.x, rng))),
            key=lambda solution: problem.error(solution.x),
        )
    return MotionFit(
        axis=problem.axis_at(found.x),
        begun=axis,
        logs=logs,
        beginnings=problem.beginnings_at(found.x),
        outcome=Outcome.CONVERGED if found.converged else Outcome.NOT_CONVERGED,
        errors_of_starts=[problem.error(s.x) for s in tried],
    )


class _Problem:
    """Simulated less measured position as a function of internal variables.

    These are the parameters by their scaling, and the beginnings in standard deviations from what
    was measured. Rows: every log at no more than MOST_COMPARED samples, then the beginnings.
    """

    def __init__(self, axis: AxisModel, logs: Sequence[PreparedLog]) -> None:
        _require_alone(axis, logs)
        self.axis, self.logs = axis, logs
        self.scaling = Scaling.of(axis, logs)
        self.runs = [OpenLoopRun(axis, log) for log in logs]
        self.measured, self.surely = zip(
            *(measured_beginning(axis, log) for log in logs), strict=True
        )
        self.open = [np.flatnonzero(surely > 0.0) for surely in self.surely]
        low, high = self.scaling.bounds()
        begun = np.zeros(sum(len(o) for o in self.open))
        self.bounds = np.r_[low, begun - np.inf], np.r_[high, begun + np.inf]
        self.start = self.off_bounds(np.r_[np.clip(self.scaling.inside(axis), low, high), begun])
        self.parameters = len(low)
        sizes = np.where(self.scaling.is_logarithm(), 1.0, np.abs(self.start[: len(low)]))
        usual = [abs(c.parameter.start) or 1.0 for c in self.scaling.where]
        self.sizes = np.where(sizes > 0.0, sizes, usual)
        self.steps = np.r_[1e-4 * self.sizes, begun + 1.0]  # of a value
        self.weight = 0.0
        self.weigh(self.start, white=True)

    def off_bounds(self, internal: Array) -> Array:
        """The same with logarithms at a bound back at the start that is declared.

        At its bound a positive parameter has no influence left, so that no step would leave it.
        """
        out = internal.copy()
        edge = np.minimum(internal - self.bounds[0], self.bounds[1] - internal)
        for i in np.flatnonzero(self.scaling.is_logarithm()):
            if edge[i] < 2.0:  # from a bound a logarithm this near is not taken as a start
                out[i] = np.log(self.scaling.where[i].parameter.start)
        return out

    def begun_well(self, internal: Array) -> Array:
        """The same with the beginnings fitted alone, lest parameters make up for them."""
        low, high = (bound.copy() for bound in self.bounds)
        own = slice(self.parameters)
        low[own] = high[own] = internal[own]
        return minimise(
            self.rows, self.slopes, internal, (low, high),
            tolerance=TOLERANCE, most_evaluations=FIRST_EVALUATIONS,
        ).x  # fmt: skip

    def weigh(self, internal: Array, white: bool) -> None:
        """How much a standard deviation of a beginning counts beside the error of a sample, m.

        As much as that error; where it is coloured it holds fewer samples, and counts for less.
        """
        error = np.concatenate(self._errors(internal))
        if np.isfinite(size := rms(error)):
            samples = len(error) if white else effective_samples(error)
            self.weight = size * np.sqrt(len(error) / samples)

    def around(self, rng: np.random.Generator) -> Array:
        """A place around the start."""
        moved = self.start.copy()
        moved[: self.parameters] += AROUND * self.sizes * rng.standard_normal(self.parameters)
        return np.clip(moved, *self.bounds)

    def is_rough(self, internal: Array) -> bool:
        """Whether the error is far above what the noise of the readings makes."""
        readings = [max(log.motion.position_noise, LEAST_READING) for log in self.logs]
        # times the noise of the readings, above which the error is the model's, and rough
        rough = 100.0
        return self.error(internal) > rough * max(readings)

    def searched(self, internal: Array, rng: np.random.Generator) -> Array:
        """The same with the parameters of the least error around, the beginnings as they are."""
        own, rest = internal[: self.parameters], internal[self.parameters :]
        low, high = (bound[: self.parameters] for bound in self.bounds)
        found = rough_minimum(
            lambda x: self.error(np.r_[x, rest]), own, AROUND * self.sizes, (low, high), rng
        )
        return np.r_[found, rest]

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
        return [e[:: -(-len(e) // 20_000)] for e in errors]  # so many samples of a log

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
        probe = 1e-2  # of the error, by which a difference step should change the position
        wanted = probe * max(rms(base), LEAST_READING)
        for i in range(len(internal)):
            for _ in range(4):  # tries to find such a step
                step = self.steps[i]
                if internal[i] + step > self.bounds[1][i]:
                    step = -step
                moved = internal.copy()
                moved[i] += step
                change = self.rows(moved) - base
                size = rms(change) / wanted
                if not np.isfinite(size):
                    # 0.1: back towards where the motion stays finite
                    self.steps[i] *= 0.1
                # within a factor ten of what is wanted, differences are true enough
                elif size == 0.0 or 0.1 < size < 10.0:
                    break
                else:
                    # a thousandfold at once at most, as no motion is linear so far
                    self.steps[i] /= min(max(size, 1e-3), 1e3)
            out[:, i] = np.nan_to_num(change / step)
        return out

    def settled(self, internal: Array) -> Solution:
        """The search gone on with, the beginnings weighed against the error that it falls to.

        First as if that error were white, which lets them move; at the end by its colour, lest they
        make up for a model that is wrong.
        """
        for _ in range(6):  # of the beginnings against the error, which falls on the way
            before = self.error(internal)
            self.weigh(internal, white=True)
            internal = self.solve(self.off_bounds(internal), MOST_EVALUATIONS).x
            # 0.9 of the error, above which the weights are right
            if not self.error(internal) < 0.9 * before:
                break
        self.weigh(internal, white=False)
        return self.solve(internal, MOST_EVALUATIONS)

    def solve(self, start: Array, evaluations: int) -> Solution:
        return minimise(
            self.rows, self.slopes, start, self.bounds,
            tolerance=TOLERANCE, most_evaluations=evaluations,
        )  # fmt: skip


def _require_alone(axis: AxisModel, logs: Sequence[PreparedLog]) -> None:
    for f in axis.effects:
        if any(f.effect.reads(signal) for signal in OF_OTHER_AXIS):
            raise InputError(
                f"axis {logs[0].motion.axis}: '{f.effect.name}' depends on the other axis, whose "
                "motion a simulation of this axis alone does not hold; fit the force residual"
            )


def rough_minimum(
    error: Callable[[Array], float],
    start: Array,
    spread: Array,
    bounds: tuple[Array, Array],
    rng: np.random.Generator,
) -> Array:
    """Variables (k,) with the least error that is found, never larger than at the start (k,).

    spread (k,): standard deviation of the population around the start. Where the error is not
    finite the variables are not taken.
    """
    reach = 5.0  # standard deviations of the population, beyond which nothing is tried
    from scipy.optimize import differential_evolution, minimize

    def finite(x: Array) -> float:
        found = error(x)
        return found if np.isfinite(found) else np.inf

    low = np.maximum(bounds[0], start - reach * spread)
    high = np.minimum(bounds[1], start + reach * spread)
    population, most_population = 12, 72  # for each variable, and of all
    size = (min(population * len(start), most_population), len(start))
    first = np.clip(start + spread * rng.standard_normal(size), low, high)
    first[0] = start
    generations = 60  # at most
    alike = 1e-3  # scatter of the population's errors, in parts of their mean, at which it ends
    found = differential_evolution(
        finite, list(zip(low, high, strict=True)), init=first, maxiter=generations, tol=alike,
        polish=False, rng=rng,
    ).x  # fmt: skip
    options = {"maxfev": 600}  # at most
    polished = minimize(
        finite, found, method="Nelder-Mead", bounds=list(zip(low, high, strict=True)),
        options=options,
    ).x  # fmt: skip
    return min((start, found, polished), key=finite)
