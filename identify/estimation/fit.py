"""Fit an axis model to logs: least squares on the force residual, and its errors on other logs.

Weak priors keep parameters that the data do not determine near their start values.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from identify.dataset.dataset import Dataset, Role
from identify.dataset.drive import forces_lessened
from identify.dataset.noise_floor import NoiseFloor, noise_beside
from identify.dataset.prepared_log import PreparedLog, moving, split_by_log, sticks
from identify.dataset.spectrum import lines_in_time
from identify.estimation.evidence import effective_samples, rms
from identify.estimation.fit_problem import FitProblem
from identify.estimation.force_balance import jacobian, residual
from identify.estimation.least_squares import orthonormal, unabsorbed
from identify.estimation.scaling import AT_EDGE, Scaling
from identify.estimation.spatial_periods import spatial_periods
from identify.rules import RULE
from twin.model.machine import AxisModel
from twin.model.parameters import read
from twin.signals import Array

MOST_EVALUATIONS = 40
ROUGHLY = 1e-3  # relative fall of the squared error, at which the priors are weighed again
MOST_WEIGHINGS = 4
WEIGHED = 0.9  # of the error by which the priors were weighed; above it they are not weighed again
NEGLIGIBLE = 1e-3  # twice a gain in log likelihood, below which a fit has converged
PUSHED = 3.0  # standard errors by which the gradient must point beyond a bound
RESIDUAL_LINES = 6  # spectral lines of the residual that are told


class Outcome(Enum):
    """How a fit ended."""

    CONVERGED = "converged"
    NOT_CONVERGED = "not converged"
    AT_BOUND = "at bound"


@dataclass(frozen=True, eq=False, repr=False)
class Fit:
    """A fitted axis.

    residual (n,): N at the end, of the test functions that carry information (kept). begun: the
    axis that the fit started from.
    """

    axis: AxisModel
    logs: Sequence[PreparedLog]
    scaling: Scaling
    outcome: Outcome
    residual: Array
    kept: NDArray[np.bool_]
    begun: AxisModel

    def __repr__(self) -> str:
        return f"<Fit: {self.error:.4g} N over {len(self.residual)} test functions>"

    @cached_property
    def error(self) -> float:
        """RMS force residual in N."""
        return rms(self.residual)

    @cached_property
    def by_log(self) -> list[Array]:
        """The residual (n,) N of each log, zero where a test function carries no information."""
        every = np.zeros(len(self.kept))
        every[self.kept] = self.residual
        return split_by_log(every, self.logs)

    @cached_property
    def noise(self) -> NoiseFloor:
        """The noise floor with its parts and its uncertainty, N RMS."""
        return noise_beside(self.axis, self.logs, self.by_log)

    @property
    def floor(self) -> float:
        """RMS noise floor in N; less than that of the logs where what is left refutes it."""
        return self.noise.value

    @cached_property
    def samples(self) -> float:
        """Effective sample size of the residual."""
        return effective_samples(self.residual)

    @cached_property
    def lessened(self) -> float:
        """RMS force of the motor over the RMS command, where that is less than half; else 1."""
        return forces_lessened(self.axis, [log.motion for log in self.logs])

    @cached_property
    def jacobian(self) -> Array:
        """Derivative of the residual by the free parameters, (n, k) N per unit."""
        return jacobian(self.axis, self.logs, self.scaling.where)[self.kept]

    @cached_property
    def basis(self) -> Array:
        """Orthonormal basis (n, r) of the forces that the free parameters can add."""
        return orthonormal(self.jacobian)

    def forget(self) -> None:
        """Let go of these matrices, which are most of its memory; they are computed again."""
        for name in ("jacobian", "basis"):
            self.__dict__.pop(name, None)

    @cached_property
    def unabsorbed(self) -> Array:
        """The residual (n,) N after a linear step of the free parameters.

        Priors, smoothing and bounds keep a fit from taking it.
        """
        return unabsorbed(self.residual, self.basis)

    @cached_property
    def lines(self) -> tuple[float, ...]:
        """Frequencies (Hz) at which the residual repeats in time, the surest first."""
        steps = [log.test_function.stride * log.test_function.period for log in self.logs]
        return lines_in_time(list(zip(self.by_log, steps, strict=True)), RESIDUAL_LINES)

    @cached_property
    def pitches(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Periods (m) at which the residual repeats along the track, and the same times command."""
        place, command = (
            np.concatenate(parts)[self.kept]
            for parts in zip(
                *((log.test_function.mean(log.motion.position), log.command) for log in self.logs),
                strict=True,
            )
        )
        weights = np.ones(len(place)), command
        plain, thrust = (spatial_periods(place, self.residual, w, self.jacobian) for w in weights)
        return plain, thrust

    @cached_property
    def at_bound(self) -> tuple[str, ...]:
        """Labels of the parameters at a bound whose better values are beyond it.

        The gradient must point outwards by more than the noise of the residual explains.
        """
        if not len(self.residual):
            return ()
        noise = self.error * np.sqrt(len(self.residual) / self.samples)
        values = read(self.axis, self.scaling.where)
        out = []
        each = zip(self.scaling.where, self.scaling.limits, values, self.jacobian.T, strict=True)
        for c, (low, high), value, column in each:
            pushed = -float(column @ self.residual)  # > 0: a larger value would be better
            edge = high if pushed > 0.0 else low
            sure = abs(pushed) > PUSHED * noise * float(np.linalg.norm(column))
            if sure and abs(value - edge) <= AT_EDGE * abs(edge):
                out.append(c.label)
        return tuple(out)

    @property
    def ended(self) -> Outcome:
        """How the optimisation ended, bounds considered."""
        held = self.outcome is Outcome.CONVERGED and self.at_bound
        return Outcome.AT_BOUND if held else self.outcome

    @property
    def at_floor(self) -> bool:
        """Whether the error is at the noise floor."""
        return self.ratio < RULE.at_floor

    @property
    def ratio(self) -> float:
        """Error over noise floor."""
        return self.error / self.floor


def fit_axis(
    axis: AxisModel, logs: Sequence[PreparedLog], most_evaluations: int = MOST_EVALUATIONS
) -> Fit:
    """Fit the free parameters of an axis from its present values."""
    problem, internal = _begun(axis, logs, most_evaluations)
    converged = True
    # Priors weighed by a much larger error than what is left hold the fit back; hence once more.
    for _ in range(MOST_WEIGHINGS if len(internal) else 0):
        before, samples = rms(problem.force(internal)), problem.set_priors(internal)
        internal, converged = problem.solve(internal, NEGLIGIBLE / samples)
        if not converged or rms(problem.force(internal)) > WEIGHED * before:
            break
    return _ended(problem, internal, converged)


def fit_roughly(axis: AxisModel, logs: Sequence[PreparedLog], most_evaluations: int) -> Fit:
    """Fit the free parameters until the squared error falls by less than a thousandth."""
    return _ended(*_begun(axis, logs, most_evaluations), converged=False)


def _begun(
    axis: AxisModel, logs: Sequence[PreparedLog], most_evaluations: int
) -> tuple[FitProblem, Array]:
    """The problem, and the variables at which the squared error hardly falls further."""
    problem = FitProblem(axis, logs, most_evaluations)
    internal = problem.start
    if len(internal):
        problem.set_priors(internal)
        internal, _ = problem.solve(internal, ROUGHLY)
    return problem, internal


def _ended(problem: FitProblem, internal: Array, converged: bool) -> Fit:
    outcome = Outcome.CONVERGED if converged else Outcome.NOT_CONVERGED
    fitted, left = problem.scaling.outside(problem.axis, internal), problem.force(internal)
    return Fit(fitted, problem.logs, problem.scaling, outcome, left, problem.kept, problem.axis)


def finished(
    axis: AxisModel, begun: AxisModel, logs: Sequence[PreparedLog], outcome: Outcome
) -> Fit:
    """The fit object of an axis with its present values, without fitting."""
    kept, scaling = moving(logs, sticks(axis)), Scaling.of(axis, logs)
    return Fit(axis, logs, scaling, outcome, residual(axis, logs)[kept], kept, begun)


def at_bounds(fit: Fit, effect: str) -> tuple[str, ...]:
    """Labels of the free parameters of an effect that ended at a bound: values that are none.

    Zero is no bound: there the effect, or a part of it, is absent.
    """
    edges = fit.scaling.at_limit(read(fit.axis, fit.scaling.where))
    each = zip(fit.scaling.where, edges, strict=True)
    return tuple(c.label for c, at_limit in each if at_limit and c.effect == effect)


def error_on(axis: AxisModel, logs: Sequence[PreparedLog]) -> Array:
    """Force residual (n,) N of a model on other logs, without refitting."""
    return residual(axis, logs)[moving(logs, sticks(axis))]


@dataclass(frozen=True)
class Errors:
    """RMS force errors (N) without a change of a model and with it, on the logs of a role."""

    before: float
    after: float
    on: Role

    @classmethod
    def of(cls, before: Fit, after: Fit, dataset: Dataset, on: Role) -> Errors:
        """The errors of two fits."""
        first = error_in(on, before, dataset)
        return cls(first, first if after is before else error_in(on, after, dataset), on)

    def share_of(self, whole: float, floor: float) -> float:
        """Part of the square of a whole error above a noise floor (N) by which this one falls.

        Of this one before, where that is more: that of a fit without one finding may be.
        """
        above = max(whole, self.before) ** 2 - floor**2
        return min((self.before**2 - self.after**2) / above, 1.0) if above > 0.0 else 0.0


def error_in(role: Role, fit: Fit, dataset: Dataset) -> float:
    """RMS force error (N) on the logs of a role; no number where there are none."""
    return fit.error if role is Role.TRAINING else rms(error_on(fit.axis, dataset.having(role)))


def error_if_any(role: Role, fit: Fit, dataset: Dataset) -> float | None:
    """The same, or None where there are none, or none that say anything of this model."""
    logs = dataset.having(role)
    return error_in(role, fit, dataset) if logs and moving(logs, sticks(fit.axis)).any() else None
