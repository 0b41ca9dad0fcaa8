"""Fit an axis model to logs: least squares on the windowed force residual.

Several starts where the model has shape parameters; weak priors keep what the data cannot see near
its start. The result says in a full sentence how it ended.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from identify.noise import noise_floor
from identify.residual import Windowed, jacobian, moving, residual
from identify.scaling import Scaling
from twin.effect import Kind
from twin.model import AxisModel, coordinates

Array = NDArray[np.float64]

RIDGE = 1e-4  # pull of collinear strengths towards zero, relative to their own columns
PRIOR_SPREAD = 3.0  # standard deviation of the prior on a logarithm, about a factor 20
MOST_EVALUATIONS = 60


class Outcome(Enum):
    """How a fit ended."""

    CONVERGED = "The fit converged: no parameter change lowers the force error further."
    NOT_CONVERGED = (
        "The fit stopped after its most evaluations before it converged; start nearer or fix some "
        "parameters."
    )
    AT_BOUND = "The fit converged with a parameter at its bound; the data ask for a value beyond."


@dataclass(frozen=True, eq=False)
class Fit:
    """A fitted axis.

    error: RMS force residual in N over the logs. floor: RMS noise floor in N. residual (n,) N and
    jacobian (n, k) N per unit at the end, over the windows that carry information (kept). prior
    (k,): information that the priors add, as squared columns.
    """

    axis: AxisModel
    scaling: Scaling
    outcome: Outcome
    error: float
    floor: float
    residual: Array
    jacobian: Array
    kept: NDArray[np.bool_]

    @property
    def ratio(self) -> float:
        """Error over noise floor."""
        return self.error / self.floor


def sticks(axis: AxisModel) -> bool:
    """Whether the axis' friction is a static one, whose force at rest can be anything."""
    return any(f.effect.kind is Kind.FRICTION and "at_rest" in f.effect.states for f in axis.effects)


def rms(values: Array) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(values**2))) if len(values) else float("nan")


class _Problem:
    """Residual and Jacobian of one fit in internal variables, with priors as extra rows."""

    def __init__(self, axis: AxisModel, logs: Sequence[Windowed], floor: float) -> None:
        self.axis = axis
        self.logs = logs
        self.scaling = Scaling(coordinates(axis))
        self.kept = moving(logs, sticks(axis))
        self.start = self.scaling.inside(axis)
        low, high = self.scaling.bounds()
        self.start = np.clip(self.start, low, high)
        columns = self.columns(self.start)
        strength = self.scaling.is_strength()
        norms = np.linalg.norm(columns, axis=0)
        self.pull = np.where(strength, RIDGE * norms, 0.0)
        self.pull[self.scaling.is_logarithm()] += floor / PRIOR_SPREAD
        self.centre = np.where(strength, 0.0, self.start)

    def columns(self, internal: Array) -> Array:
        axis = self.scaling.outside(self.axis, internal)
        raw = jacobian(axis, self.logs, self.scaling.where)
        return self.scaling.chain(axis, raw)[self.kept]

    def rows(self, internal: Array) -> Array:
        force = residual(self.scaling.outside(self.axis, internal), self.logs)[self.kept]
        return np.concatenate([force, self.pull * (internal - self.centre)])

    def slopes(self, internal: Array) -> Array:
        return np.vstack([self.columns(internal), np.diag(self.pull)])


def fit_axis(axis: AxisModel, logs: Sequence[Windowed]) -> Fit:
    """Fit the free parameters of an axis from its present values."""
    floor = noise_floor(axis.mass, [(log.motion, log.window) for log in logs])
    problem = _Problem(axis, logs, floor)
    if not len(problem.start):
        return _finish(problem, problem.start, Outcome.CONVERGED)
    low, high = problem.scaling.bounds()
    margin = 1e-9 * np.minimum(high - low, 1.0)
    solution = least_squares(
        problem.rows,
        np.clip(problem.start, low + margin, high - margin),
        jac=problem.slopes,
        bounds=(low, high),
        x_scale="jac",
        method="trf",
        ftol=1e-9,
        xtol=1e-9,
        max_nfev=MOST_EVALUATIONS,
    )
    outcome = Outcome.CONVERGED if solution.status > 0 else Outcome.NOT_CONVERGED
    return _finish(problem, solution.x, outcome)


def _finish(problem: _Problem, internal: Array, outcome: Outcome) -> Fit:
    axis = problem.scaling.outside(problem.axis, internal)
    force = residual(axis, problem.logs)[problem.kept]
    floor = noise_floor(axis.mass, [(log.motion, log.window) for log in problem.logs])
    return Fit(
        axis=axis,
        scaling=problem.scaling,
        outcome=outcome,
        error=rms(force),
        floor=floor,
        residual=force,
        jacobian=jacobian(axis, problem.logs, problem.scaling.where)[problem.kept],
        kept=problem.kept,
    )


def error_on(axis: AxisModel, logs: Sequence[Windowed]) -> Array:
    """Windowed force residual (n,) N of a model on other logs, without refitting."""
    return residual(axis, logs)[moving(logs, sticks(axis))]
