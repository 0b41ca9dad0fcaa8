"""Fit an axis model to logs: least squares on the force residual.

Weak priors keep parameters that the data do not determine near their start values.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from identify.dataset.drive import forces_lessened
from identify.dataset.noise_floor import floor_of
from identify.dataset.prepared_log import PreparedLog, moving, sticks
from identify.dataset.spectral_lines import lines_in_time
from identify.estimation.decision import RULE
from identify.estimation.evidence import effective_samples
from identify.estimation.force_balance import jacobian, residual
from identify.estimation.levenberg_marquardt import minimise
from identify.estimation.pitches import pitches
from identify.estimation.scaling import Scaling
from identify.estimation.smoothing import has_nonparametric, smoothing
from identify.estimation.subspace import orthonormal, unabsorbed
from twin.effect import Kind
from twin.model.machine import AxisModel
from twin.model.parameters import ParameterReference, free_parameters, read

Array = NDArray[np.float64]

PRIOR_FORCE = 0.1  # expected force of an effect beside the friction, over the force to explain
PRIOR_SPREAD = 3.0  # standard deviation of the prior on a logarithm, about a factor 20
MOST_EVALUATIONS = 40
NEGLIGIBLE = 1e-3  # twice a gain in log likelihood, below which a fit has converged
PUSHED = 3.0  # standard errors by which the gradient must point beyond a bound
RESIDUAL_LINES = 6  # spectral lines of the residual that are told
AT_EDGE = 1e-6  # of a bound, within which a value is at it


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
    def floor(self) -> float:
        """RMS noise floor in N."""
        return floor_of(self.axis, self.logs)

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

    @cached_property
    def unabsorbed(self) -> Array:
        """The residual (n,) N after a linear step of the free parameters.

        Priors, smoothing and bounds keep a fit from taking it.
        """
        return unabsorbed(self.residual, self.basis)

    @cached_property
    def lines(self) -> tuple[float, ...]:
        """Frequencies (Hz) at which the residual repeats in time, the surest first."""
        every = np.zeros(len(self.kept))
        every[self.kept] = self.residual
        ends = np.cumsum([len(log) for log in self.logs])[:-1]
        steps = [log.test_function.stride * log.test_function.period for log in self.logs]
        return lines_in_time(list(zip(np.split(every, ends), steps, strict=True)), RESIDUAL_LINES)

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
        plain, thrust = (pitches(place, self.residual, w, self.jacobian) for w in weights)
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
        for c, value, column in zip(self.scaling.where, values, self.jacobian.T, strict=True):
            pushed = -float(column @ self.residual)  # > 0: a larger value would be better
            p = c.parameter
            edge = p.upper if pushed > 0.0 else p.lower
            sure = abs(pushed) > PUSHED * noise * float(np.linalg.norm(column))
            if sure and abs(value - edge) <= AT_EDGE * max(abs(edge), abs(p.start)):
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


def _is_added(axis: AxisModel, c: ParameterReference) -> bool:
    """Whether it is a strength of a physical effect other than mass and friction."""
    if not (c.effect and c.parameter.strength):
        return False
    effect = axis[c.effect].effect
    return effect.kind is not Kind.FRICTION and not effect.is_nonparametric


def is_constant(axis: AxisModel, c: ParameterReference) -> bool:
    """Whether it is a strength whose column no free parameter changes: of a force with no other."""
    if not (c.effect and c.parameter.strength):
        return False
    own, sensed = axis[c.effect], any(f.effect.kind is Kind.SENSING for f in axis.effects)
    alone = all(p.strength or p.name in own.fixed for p in own.effect.parameters)
    return own.effect.is_nonparametric or (own.effect.kind is Kind.FORCE and alone and not sensed)


def rms(values: Array) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(values**2))) if len(values) else float("nan")


class _Problem:
    """Residual and Jacobian of one fit in internal variables, with priors as extra rows.

    The prior on an effect beside the friction is a force of a tenth of the force to be explained.
    It matters only for parameters that the data cannot separate, such as a constant force and a
    Coulomb asymmetry: it keeps both small, where they could be large and opposite. Beside a
    nonparametric effect the prior of the physical effects is centred where the fit starts, so that
    a force that both could explain stays with the physics. The nonparametric effect is smoothed.
    """

    def __init__(self, axis: AxisModel, logs: Sequence[PreparedLog], most_evaluations: int) -> None:
        self.axis = axis
        self.most_evaluations = most_evaluations
        self.logs = logs
        self.scaling = Scaling(free_parameters(axis))
        self.kept = moving(logs, sticks(axis))
        self.bounds = self.scaling.bounds()
        self.start = np.clip(self.scaling.inside(axis), *self.bounds)
        self.added = np.array([_is_added(axis, c) for c in self.scaling.where], dtype=bool)
        self.centre = np.where(self.added & (not has_nonparametric(axis)), 0.0, self.start)
        self.pull = np.zeros(len(self.start))
        self.smooth = smoothing(axis, self.scaling.where, int(self.kept.sum()))
        # A force is linear in its strengths, so their columns are computed once.
        self.constant = np.array([is_constant(axis, c) for c in self.scaling.where], dtype=bool)
        self.constant_columns = jacobian(axis, logs, self._where(self.constant))
        self._last: tuple[bytes, Array] = b"", np.zeros((0, 0))
        self._last_force: tuple[bytes, Array] = b"", np.zeros(0)

    def set_priors(self, internal: Array) -> float:
        """Weigh the priors by the residual's size, its colour, and the force to be explained.

        Returns the effective sample size of the residual there.
        """
        axis = self.scaling.outside(self.axis, internal)
        left = self.force(internal)
        inertia = axis.mass * np.concatenate([log.acceleration for log in self.logs])
        command = np.concatenate([log.command for log in self.logs])
        explained = rms((command - inertia)[self.kept])
        samples = effective_samples(left)
        noise = rms(left) * np.sqrt(len(left) / samples)
        columns = self.columns(internal)
        size = np.linalg.norm(columns, axis=0) / np.sqrt(max(len(left), 1))
        expected = max(PRIOR_FORCE * explained, noise)
        self.pull = np.where(self.added, noise * size / expected, 0.0)
        self.pull[self.scaling.is_logarithm() & ~self.added] = noise / PRIOR_SPREAD
        return samples

    def _where(self, mask: NDArray[np.bool_]) -> list[ParameterReference]:
        return [c for c, wanted in zip(self.scaling.where, mask, strict=True) if wanted]

    def jacobian(self, axis: AxisModel) -> Array:
        """Derivative of the residual by the free parameters, (n, k) N per unit."""
        columns = np.empty((len(self.kept), len(self.constant)))
        columns[:, self.constant] = self.constant_columns
        columns[:, ~self.constant] = jacobian(axis, self.logs, self._where(~self.constant))
        return columns

    def columns(self, internal: Array) -> Array:
        """Derivative of the kept residual by the internal variables, (n, k) N per unit.

        Those of the last place are kept: the priors and the search that follows ask for the same.
        """
        place = internal.tobytes()
        if self._last[0] != place:
            axis = self.scaling.outside(self.axis, internal)
            self._last = place, self.scaling.chain(axis, self.jacobian(axis))[self.kept]
        return self._last[1]

    def force(self, internal: Array) -> Array:
        """The kept residual (n,) N; that of the last place is kept, as the columns are."""
        place = internal.tobytes()
        if self._last_force[0] != place:
            axis = self.scaling.outside(self.axis, internal)
            self._last_force = place, residual(axis, self.logs)[self.kept]
        return self._last_force[1]

    def rows(self, internal: Array) -> Array:
        pulled = self.pull * (internal - self.centre)
        return np.concatenate([self.force(internal), pulled, self.smooth @ internal])

    def slopes(self, internal: Array) -> Array:
        return np.vstack([self.columns(internal), np.diag(self.pull), self.smooth])

    def solve(self, internal: Array, tolerance: float) -> tuple[Array, bool]:
        """Least squares from these values; the solution and whether it converged."""
        solution = minimise(
            self.rows, self.slopes, internal, self.bounds,
            tolerance=tolerance, most_evaluations=self.most_evaluations,
        )  # fmt: skip
        return solution.x, solution.converged


def fit_axis(
    axis: AxisModel, logs: Sequence[PreparedLog], most_evaluations: int = MOST_EVALUATIONS
) -> Fit:
    """Fit the free parameters of an axis from its present values."""
    problem = _Problem(axis, logs, most_evaluations)
    internal, converged = problem.start, True
    if len(internal):
        problem.set_priors(internal)
        internal, _ = problem.solve(internal, 1e-3)
        samples = problem.set_priors(internal)
        internal, converged = problem.solve(internal, NEGLIGIBLE / samples)
    outcome = Outcome.CONVERGED if converged else Outcome.NOT_CONVERGED
    fitted, left = problem.scaling.outside(axis, internal), problem.force(internal)
    return Fit(fitted, logs, problem.scaling, outcome, left, problem.kept, axis)


def finished(
    axis: AxisModel, begun: AxisModel, logs: Sequence[PreparedLog], outcome: Outcome
) -> Fit:
    """The fit object of an axis with its present values, without fitting."""
    kept, scaling = moving(logs, sticks(axis)), Scaling(free_parameters(axis))
    return Fit(axis, logs, scaling, outcome, residual(axis, logs)[kept], kept, begun)


def error_on(axis: AxisModel, logs: Sequence[PreparedLog]) -> Array:
    """Force residual (n,) N of a model on other logs, without refitting."""
    return residual(axis, logs)[moving(logs, sticks(axis))]
