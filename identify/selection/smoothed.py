"""The residual linearised beside a base, and smooth curves that are linear in their strengths.

P-splines: each part of a nonparametric effect has a penalty on its bends, whose weight, the
stiffness, is the one with the least cross-validated error; a part that helps nothing is left out.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from identify.dataset.dataset import Dataset
from identify.estimation.evidence import blocks_of
from identify.estimation.fit import Fit
from identify.estimation.force_balance import jacobian
from identify.estimation.smoothing import part_rows, smoothing
from twin.curve import Part
from twin.model.machine import Fitted
from twin.model.parameters import ParameterReference

Array = NDArray[np.float64]

STIFFNESS = tuple(10.0 ** np.arange(1.0, -5.1, -0.5))  # tried for each part
WORTH = 0.99  # a further part must lower the squared cross-validated error below this part
ROUNDING = 1e-12  # of a unit diagonal, keeps a system solvable
RIDGE = 1e-4  # on the physics, in units of their columns


@dataclass(frozen=True, eq=False)
class Linearised:
    """The residual linearised about a base: force (n,) N, columns (n, k) of physics, then of parts.

    physics (k, k): penalty of the base. parts: penalty (k, k) of each part at unit stiffness, and
    which columns belong to it.
    """

    where: Sequence[ParameterReference]
    force: Array
    columns: Array
    physics: Array
    parts: Mapping[str, tuple[Array, NDArray[np.bool_]]]

    @classmethod
    def about(
        cls, base: Fit, dataset: Dataset, fitted: Fitted, among: NDArray[np.bool_] | None = None
    ) -> Linearised:
        """The base's residual, or some of its test functions (n,), with an effect's columns."""
        rows = np.flatnonzero(base.kept)
        some = slice(None) if among is None or among.all() else np.flatnonzero(among)
        effect = fitted.effect
        free = [p for p in effect.strengths if p.name not in fitted.fixed]
        own = [ParameterReference(effect.name, p) for p in free]
        where = [*base.scaling.where, *own]
        alone = replace(base.axis, effects=(fitted,))
        new = jacobian(alone, dataset.fit, own)[rows[some]]
        norms = np.linalg.norm(base.jacobian, axis=0)
        bends = smoothing(base.axis, where, len(base.residual))
        physics = bends.T @ bends + np.diag([*(RIDGE * norms) ** 2, *np.zeros(len(own))])
        return cls(
            where, base.residual[some], np.hstack([base.jacobian[some], new]), physics,
            {
                part.name: _penalty(part, effect.name, where)
                for part in effect.parts if not fitted.fixed.issuperset(part.strengths)
            },
        )  # fmt: skip

    def less(self, effect: str) -> Linearised:
        """The same without the columns of one effect of the base."""
        kept = np.array([c.effect != effect for c in self.where])
        both = np.ix_(kept, kept)
        parts = {name: (rows[both], mask[kept]) for name, (rows, mask) in self.parts.items()}
        where = [c for c, k in zip(self.where, kept, strict=True) if k]
        return Linearised(where, self.force, self.columns[:, kept], self.physics[both], parts)

    def spread(self, stiffness: Mapping[str, float]) -> Array:
        """Covariance (k, k) of all parameters for noise of 1 N; zero for those left out."""
        used, penalty = self._chosen(stiffness)
        columns = self.columns[:, used]
        full = columns.T @ columns + penalty[np.ix_(used, used)]
        out = np.zeros((len(used), len(used)))
        out[np.ix_(used, used)] = solve(full, np.eye(len(full)))
        return out

    def _chosen(self, stiffness: Mapping[str, float]) -> tuple[NDArray[np.bool_], Array]:
        """Which columns are used, and the penalty (k, k), with these parts and their stiffness."""
        used = ~np.any([mask for _, mask in self.parts.values()], axis=0)
        penalty = self.physics.copy()
        for name, value in stiffness.items():
            rows, mask = self.parts[name]
            used = used | mask
            penalty += len(self.force) * value**2 * rows
        return used, penalty

    @cached_property
    def blocks(self) -> tuple[list[slice], Array, Array]:
        """Samples of each block, its Gram matrix (b, k, k), and columns times force (b, k)."""
        spans = blocks_of(len(self.force))
        columns = [self.columns[span] for span in spans]
        grams = np.stack([c.T @ c for c in columns])
        pulls = np.stack([c.T @ self.force[s] for s, c in zip(spans, columns, strict=True)])
        return spans, grams, pulls

    def _without(self, stiffness: Mapping[str, float]) -> tuple[NDArray[np.bool_], Array]:
        """Which columns take part, and the changes (b, k_used) when each block is left out."""
        used, penalty = self._chosen(stiffness)
        _, grams, pulls = self.blocks
        rest = (grams.sum(axis=0) + penalty - grams)[:, used][:, :, used]
        return used, solve(rest, (pulls.sum(axis=0) - pulls)[:, used, None])[..., 0]

    def left_out(self, stiffness: Mapping[str, float]) -> Array:
        """Cross-validated residual (n,) N: each block predicted by a fit to the others."""
        used, changes = self._without(stiffness)
        out = self.force.copy()
        for span, change in zip(self.blocks[0], changes, strict=True):
            out[span] -= self.columns[span][:, used] @ change
        return out

    def left_out_error(self, stiffness: Mapping[str, float]) -> float:
        """Sum of its squares, N^2."""
        used, changes = self._without(stiffness)
        _, grams, pulls = self.blocks
        square = np.einsum("bi,bij,bj->", changes, grams[:, used][:, :, used], changes)
        crossed = np.einsum("bi,bi->", changes, pulls[:, used])
        return float(self.force @ self.force - 2.0 * crossed + square)

    def solution(self, stiffness: Mapping[str, float]) -> tuple[Array, float]:
        """Change (k,) of all parameters that fits best, and its effective degrees of freedom."""
        used, penalty = self._chosen(stiffness)
        columns = self.columns[:, used]
        gram = columns.T @ columns
        full = gram + penalty[np.ix_(used, used)]
        out = np.zeros(len(self.where))
        out[used] = -solve(full, (columns.T @ self.force)[:, None])[:, 0]
        return out, float(np.trace(solve(full, gram)))


def _penalty(
    part: Part, effect: str, where: Sequence[ParameterReference]
) -> tuple[Array, NDArray[np.bool_]]:
    rows = part_rows(part, effect, where)
    mask = np.array([c.effect == effect and c.parameter.name in part.strengths for c in where])
    return rows.T @ rows, mask


def solve(matrix: Array, right: Array) -> Array:
    """Solution (..., k, m) of symmetric positive systems, scaled as their unknowns differ in unit.

    matrix (..., k, k), right (..., k, m).
    """
    own = np.diagonal(matrix, axis1=-2, axis2=-1)[..., None]
    size = np.sqrt(np.where(own > 0.0, own, 1.0))
    scaled = matrix / size / np.swapaxes(size, -1, -2) + ROUNDING * np.eye(matrix.shape[-1])
    return np.asarray(np.linalg.solve(scaled, right / size) / size)


def choose_stiffness(linear: Linearised, tried: Sequence[float] = STIFFNESS) -> dict[str, float]:
    """Stiffness, of those tried, of each part that lowers the cross-validated error.

    Other parts are left out. Parts are added one by one, the most helpful first; then the earlier
    ones are tuned again.
    """
    chosen: dict[str, float] = {}
    error = linear.left_out_error(chosen)
    while len(chosen) < len(linear.parts):
        waiting = [name for name in linear.parts if name not in chosen]
        found = [_best(linear, chosen, name, tried) for name in waiting]
        further, name, value = min(found)
        if not further < WORTH * error:
            break
        earlier, chosen[name] = tuple(chosen), value
        for other in earlier:
            further, _, chosen[other] = _best(linear, chosen, other, tried)
        error = further
    return chosen


def _best(
    linear: Linearised, chosen: Mapping[str, float], name: str, tried: Sequence[float]
) -> tuple[float, str, float]:
    """Squared cross-validated error, name and best stiffness of a part beside the others."""
    errors = [linear.left_out_error({**chosen, name: v}) for v in tried]
    least = int(np.argmin(errors))
    return errors[least], name, float(tried[least])
