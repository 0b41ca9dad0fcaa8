"""The least-squares problem of a fit: residual and Jacobian in internal variables, with priors."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from identify.dataset.prepared_log import PreparedLog, moving, sticks
from identify.estimation.evidence import effective_samples, rms
from identify.estimation.force_balance import jacobian, residual
from identify.estimation.least_squares import minimise
from identify.estimation.scaling import Scaling
from twin.curve import Part
from twin.effect import Kind
from twin.model.machine import AxisModel
from twin.model.parameters import ParameterReference
from twin.signals import Array

PRIOR_FORCE = 0.1  # expected force of an effect beside the friction, over the force to explain
UNSEEN = 1e-3  # of the force of another strength of the effect, below which one is not excited
PRIOR_SPREAD = 3.0  # standard deviation of the prior on a logarithm, about a factor 20
PRIOR_EXCESS = 3.0  # the same of static friction beyond the Coulomb friction, over this


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
        alike = np.zeros(len(size))
        np.maximum.at(alike, self.alike, size)
        alike = alike[self.alike]
        unseen = self.added & (size < UNSEEN * alike)
        self.centre = np.where(unseen, self.start, self.neutral)
        self.pull = np.where(self.added, noise * np.where(unseen, alike, size) / expected, 0.0)
        self.pull[self.scaling.is_logarithm() & ~self.added] = noise / PRIOR_SPREAD
        least = self.scaling.least(axis)
        beyond = self.excess & (least > 0.0)
        self.pull[beyond] = noise / (PRIOR_EXCESS * least[beyond])
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
            self._last = b"", np.zeros((0, 0))  # two places would be most of a fit's memory
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
