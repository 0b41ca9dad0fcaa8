"""Fit an axis model to logs: least squares on the force residual with priors, and its errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from identify.dataset.coordinates import covered
from identify.dataset.noise_floor import NoiseFloor, noise_beside
from identify.dataset.prepared_log import PreparedLog, motor_gain, moving, split_by_log, sticks
from identify.dataset.spectrum import lines_in_time
from identify.estimation.evidence import SURE, effective_samples, rms
from identify.estimation.force_balance import jacobian, residual
from identify.estimation.least_squares import minimise, orthonormal, unabsorbed
from identify.estimation.scaling import AT_EDGE, Scaling
from identify.estimation.spatial_periods import spatial_periods
from identify.rules import RULE
from twin.curve import Part
from twin.effect import Kind
from twin.model.machine import AxisModel, Fitted
from twin.model.parameters import ParameterReference, read
from twin.signals import Array
from twin.threads import trim_beside

MOST_EVALUATIONS = 40  # of the residual; most fits end within ten
LINES = 6  # of a spectrum that are looked at, the surest first


class Outcome(Enum):
    """How a fit ended."""

    CONVERGED = "converged"
    NOT_CONVERGED = "not converged"
    AT_BOUND = "at bound"


@dataclass(frozen=True, eq=False, repr=False)
class Fit:
    """A fitted axis.

    residual (n,): N at the end, in the force as it was logged, of the test functions that carry
    information (kept). begun: the axis as it was given; in a search it has nothing of what was
    changed since.
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
    def gain(self) -> float:
        """RMS force of the motor over the RMS command; a force over it is as it was logged."""
        return motor_gain(self.axis, self.logs)

    @cached_property
    def jacobian(self) -> Array:
        """Derivative of the residual by the free parameters, (n, k) N per unit."""
        return jacobian(self.axis, self.logs, self.scaling.where, self.kept)

    @cached_property
    def basis(self) -> Array:
        """Orthonormal basis (n, r) of the forces that the free parameters can add."""
        return orthonormal(self.jacobian)

    def forget(self) -> None:
        """Let go of what is most of its memory, matrices above all; it is computed again."""
        for name in ("by_log", "jacobian", "basis", "unabsorbed"):
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
        return lines_in_time(list(zip(self.by_log, steps, strict=True)), LINES)

    @cached_property
    def pitches(self) -> tuple[float, ...]:
        """Periods (m) at which the residual repeats along the track."""
        return self._repeating(np.ones(len(self.residual)))

    @cached_property
    def thrust_pitches(self) -> tuple[float, ...]:
        """The same of the residual over the command."""
        return self._repeating(np.concatenate([log.command for log in self.logs])[self.kept])

    @cached_property
    def friction_pitches(self) -> tuple[float, ...]:
        """The same of the residual over the direction of motion."""
        ways = [log.test_function.mean(np.sign(log.motion.velocity)) for log in self.logs]
        return self._repeating(np.concatenate(ways)[self.kept])

    def _repeating(self, weight: Array) -> tuple[float, ...]:
        position = [log.test_function.mean(log.motion.position) for log in self.logs]
        place = np.concatenate(position)[self.kept]
        return spatial_periods(place, self.residual, weight, self.jacobian)

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
        each = zip(self.scaling.where, self.scaling.limits, values, strict=True)
        for i, (c, limits, value) in enumerate(each):
            low, high = (abs(value - edge) <= AT_EDGE * abs(edge) for edge in limits)
            if not (low or high):  # as most are; derivatives on whole logs take long
                continue
            column = self.jacobian[:, i]
            pushed = -float(column @ self.residual)  # > 0: a larger value would be better
            sure = abs(pushed) > SURE * noise * float(np.linalg.norm(column))
            if sure and (high if pushed > 0.0 else low):
                out.append(c.label)
        return tuple(out)

    @property
    def ended(self) -> Outcome:
        """How the optimisation ended, bounds considered."""
        held = self.outcome is Outcome.CONVERGED and self.at_bound
        return Outcome.AT_BOUND if held else self.outcome

    @property
    def at_floor(self) -> bool:
        """Whether the error is at the noise floor, or within what is sure of it."""
        return self.error < self.noise.sure

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
    # Near the end they are weighed by what no values take: what they hold back would sustain them.
    while len(internal) and converged:
        left = problem.force(internal)
        before, basis = rms(left), orthonormal(problem.columns(internal))
        samples = problem.set_priors(internal, unabsorbed(left, basis))
        # 1e-3 is twice a gain in log likelihood, below which a fit has converged
        internal, converged = problem.solve(internal, 1e-3 / samples)
        if not rms(problem.force(internal)) < RULE.fallen * before:
            break
    return _ended(problem, internal, converged)


def turned(begun: AxisModel, axis: AxisModel, logs: Sequence[PreparedLog]) -> list[str]:
    """Names of the laws that were themselves when a fit began, and are others as it ended.

    One of which hardly anything is left is none.
    """
    seen, first = (
        covered(tuple(log.motion for log in logs)),
        {f.effect.name: f for f in begun.effects},
    )

    def is_left(now: Fitted, was: Fitted) -> bool:
        pairs = [(now.values[p.name], was.values[p.name]) for p in now.effect.strengths]
        return any(abs(after) > RULE.collapse * abs(before) for after, before in pairs)

    both = [(f, first[f.effect.name]) for f in axis.effects if f.effect.name in first]
    return [
        now.effect.name
        for now, was in both
        if now.effect.imitation(now.values, seen)
        and not was.effect.imitation(was.values, seen)
        and is_left(now, was)
    ]


def fit_themselves(axis: AxisModel, logs: Sequence[PreparedLog]) -> Fit:
    """The same with each law as it began that would become another one, such as the one taken out.

    What sticks and slips can be the spring that the axis lacks; then it does not tell whether the
    spring is needed.
    """
    fit = fit_axis(axis, logs)
    others = turned(axis, fit.axis, logs)
    if not others:
        return fit
    held = axis
    for name in others:
        names = frozenset(p.name for p in axis[name].effect.parameters)
        held = held.with_effect(replace(axis[name], fixed=names))
    fitted = fit_axis(held, logs)
    free = fitted.axis
    for name in others:
        free = free.with_effect(axis[name])
    return finished(free, axis, logs, fitted.outcome)


def fit_roughly(
    axis: AxisModel, logs: Sequence[PreparedLog], most_evaluations: int = MOST_EVALUATIONS
) -> Fit:
    """Fit the free parameters until the squared error falls by less than a thousandth."""
    return _ended(*_begun(axis, logs, most_evaluations), converged=False)


def _begun(
    axis: AxisModel, logs: Sequence[PreparedLog], most_evaluations: int
) -> tuple[FitProblem, Array]:
    """The problem, and the variables at which the squared error hardly falls further."""
    problem = FitProblem(axis, logs, most_evaluations)
    internal = problem.start
    if len(internal):
        problem.set_priors(internal, problem.force(internal))
        # 1e-3 is a relative fall of the squared error, at which the priors are weighed again
        internal, _ = problem.solve(internal, 1e-3)
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


def _is_added(axis: AxisModel, c: ParameterReference) -> bool:
    """Whether it is a strength of a physical effect other than mass and friction."""
    if not (c.effect and c.parameter.strength):
        return False
    effect = axis[c.effect].effect
    return effect.kind is not Kind.FRICTION and not effect.is_nonparametric


def is_linear(axis: AxisModel, c: ParameterReference) -> bool:
    """Whether the residual is linear in it, the others held: the mass, a strength of a force."""
    if not c.effect:
        return True
    effect = axis[c.effect].effect
    return c.parameter.strength and (effect.is_nonparametric or effect.kind is Kind.FORCE)


def is_constant(axis: AxisModel, c: ParameterReference) -> bool:
    """Whether it is a strength whose column no free parameter changes: of a force with no other."""
    if not (c.effect and is_linear(axis, c)):
        return False
    own, sensed = axis[c.effect], any(f.effect.kind is Kind.SENSING for f in axis.effects)
    alone = all(p.strength or p.name in own.fixed for p in own.effect.parameters)
    return own.effect.is_nonparametric or (alone and not sensed)


NOWHERE = b"no place yet"  # where nothing is free, a place has no bytes


class FitProblem:
    """Residual and Jacobian of one fit in internal variables, with priors as extra rows.

    The prior on an effect beside the friction is a force of a tenth of the force to be explained.
    It matters only for parameters that the data cannot separate, such as a constant force and a
    Coulomb asymmetry: it keeps both small, where they could be large and opposite. A strength that
    the motion hardly reaches, as of bumps passed one way alone, stays where the fit starts. Static
    friction is expected within a few times the Coulomb friction, or a few test functions at creep
    would set it to whatever else the model lacks there. Beside a nonparametric effect the prior of
    the physical effects is centred where the fit starts, so that a force that both could explain
    stays with the physics. The nonparametric effect is smoothed.
    """

    def __init__(self, axis: AxisModel, logs: Sequence[PreparedLog], most_evaluations: int) -> None:
        self.axis = axis
        self.most_evaluations = most_evaluations
        self.logs = logs
        self.scaling = Scaling.of(axis, logs)
        self.kept = moving(logs, sticks(axis))
        self.bounds = self.scaling.bounds()
        self.start = np.clip(self.scaling.inside(axis), *self.bounds)
        self.added = np.array([_is_added(axis, c) for c in self.scaling.where], dtype=bool)
        self.excess = np.array([bool(c.parameter.at_least) for c in self.scaling.where], dtype=bool)
        near_none = (self.excess | self.added) & (not has_nonparametric(axis))
        self.neutral = self.centre = np.where(near_none, 0.0, self.start)
        kinds = [(c.effect, c.parameter.unit) for c in self.scaling.where]
        self.alike = np.array([kinds.index(kind) for kind in kinds], dtype=int)
        self.pull = np.zeros(len(self.start))
        self.smooth = smoothing(axis, self.scaling.where, int(self.kept.sum()))
        linear = np.array([is_constant(axis, c) for c in self.scaling.where], dtype=bool)
        self.bent = ~(linear & self.scaling.is_itself())
        self._slopes, self._place = self._constant_slopes(), NOWHERE
        self._last_force = NOWHERE, np.zeros(0)

    def set_priors(self, internal: Array, left: Array) -> float:
        """Weigh the priors by the size of an error, its colour, and the force to be explained.

        left: of the residual (n,) N at these variables, all or a part. Returns its effective sample
        size.
        """
        # standard deviation of the prior on a logarithm, about a factor 20, and of static friction
        # beyond the Coulomb friction over that
        prior_spread = 3.0
        axis = self.scaling.outside(self.axis, internal)
        inertia = axis.mass * np.concatenate([log.acceleration for log in self.logs])
        command = np.concatenate([log.command for log in self.logs])
        explained = rms((command - inertia)[self.kept])
        samples = effective_samples(left)
        noise = rms(left) * np.sqrt(len(left) / samples)
        columns = self.columns(internal)
        size = np.linalg.norm(columns, axis=0) / np.sqrt(max(len(left), 1))
        # 0.1 of the force to explain is expected of an effect beside the friction
        expected = max(0.1 * explained, noise)
        alike = np.zeros(len(size))
        np.maximum.at(alike, self.alike, size)
        alike = alike[self.alike]
        # 1e-3 of the force of another strength of the effect, below which one is not excited
        unseen = self.added & (size < 1e-3 * alike)
        self.centre = np.where(unseen, self.start, self.neutral)
        self.pull = np.where(self.added, noise * np.where(unseen, alike, size) / expected, 0.0)
        self.pull[self.scaling.is_logarithm() & ~self.added] = noise / prior_spread
        least = self.scaling.least(axis)
        beyond = self.excess & (least > 0.0)
        self.pull[beyond] = noise / (prior_spread * least[beyond])
        return samples

    def _constant_slopes(self) -> Array:
        """Memory of the slopes, with what stays: a force is linear in its strengths."""
        stays = ~self.bent
        columns = jacobian(self.axis, self.logs, self.scaling.part(stays).where, self.kept)
        n, k = len(columns), len(stays)
        out = np.empty((n + k + len(self.smooth), k))
        out[:n, stays], out[n + k :] = columns, self.smooth
        return out

    def columns(self, internal: Array) -> Array:
        """Derivative of the kept residual by the internal variables, (n, k) N per unit.

        Those of the last place are held: the priors and the search that follows ask for the same.
        They are most of the memory of a fit, so that the next place overwrites them.
        """
        columns, place = self._slopes[: self.kept.sum()], internal.tobytes()
        if self._place != place:
            axis, own = self.scaling.outside(self.axis, internal), self.scaling.part(self.bent)
            changed = jacobian(axis, self.logs, own.where, self.kept)
            columns[:, self.bent] = own.chain(axis, changed)
            trim_beside(columns.nbytes)
            self._place = place
        return columns

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
        """Derivative of the rows, (n + k + m, k), until it is asked for at another place."""
        n, k = len(self.columns(internal)), len(internal)
        self._slopes[n : n + k] = np.diag(self.pull)
        return self._slopes

    def solve(self, internal: Array, tolerance: float) -> tuple[Array, bool]:
        """Least squares from these values; the solution and whether it converged."""
        solution = minimise(
            self.rows, self.slopes, internal, self.bounds,
            tolerance=tolerance, most_evaluations=self.most_evaluations,
        )  # fmt: skip
        return solution.x, solution.converged


def has_nonparametric(axis: AxisModel) -> bool:
    """Whether the axis has a nonparametric effect."""
    return any(f.effect.is_nonparametric for f in axis.effects)


def part_rows(part: Part, effect: str, where: Sequence[ParameterReference]) -> Array:
    """Rows (m, len(where)) of a part at unit stiffness; zero for what is not among ``where``."""
    index = {c.parameter.name: i for i, c in enumerate(where) if c.effect == effect}
    own = [index.get(name) for name in part.strengths]
    rows = part.rows(len(own))
    out = np.zeros((len(rows), len(where)))
    for column, at in zip(rows.T, own, strict=True):
        if at is not None:
            out[:, at] = column
    return out


def smoothing(axis: AxisModel, where: Sequence[ParameterReference], samples: int) -> Array:
    """Penalty rows (m, len(where)), N per unit, weighted for ``samples`` residuals in N."""
    rows = [
        np.sqrt(samples) * f.values[part.stiffness] * part_rows(part, f.effect.name, where)
        for f in axis.effects
        for part in f.effect.parts
    ]
    return np.vstack([np.zeros((0, len(where))), *rows])
