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
from identify.estimation.evidence import blocks_of, by_blocks
from identify.estimation.fit import Fit
from identify.estimation.fit_problem import part_rows, smoothing
from identify.estimation.force_balance import jacobian
from twin.curve import Part
from twin.model.machine import Fitted
from twin.model.parameters import ParameterReference
from twin.signals import Array

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
        some = np.flatnonzero(np.ones(len(base.residual), bool) if among is None else among)
        effect = fitted.effect
        free = [p for p in effect.strengths if p.name not in fitted.fixed]
        own = [ParameterReference(effect.name, p) for p in free]
        where = [*base.scaling.where, *own]
        alone = replace(base.axis, effects=(fitted,))
        first = len(base.scaling.where)
        columns = np.empty((len(some), len(where)))
        columns[:, :first] = base.jacobian[some]
        rows, end = np.flatnonzero(base.kept)[some], 0
        for log in dataset.fit:  # one after the other: there are many columns
            begin, end = end, end + len(log)
            here = (rows >= begin) & (rows < end)
            columns[here, first:] = jacobian(alone, [log], own)[rows[here] - begin]
        norms = np.linalg.norm(base.jacobian, axis=0)
        bends = smoothing(base.axis, where, len(base.residual))
        physics = bends.T @ bends + np.diag([*(RIDGE * norms) ** 2, *np.zeros(len(own))])
        return cls(
            where, base.residual[some], columns, physics,
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
        columns = self._columns(used)
        full = columns.T @ columns + penalty[np.ix_(used, used)]
        out = np.zeros((len(used), len(used)))
        out[np.ix_(used, used)] = solve(full, np.eye(len(full)))
        return out

    def _columns(self, used: NDArray[np.bool_]) -> Array:
        """The columns used, which are not copied where that is all of them: they are large."""
        return self.columns if used.all() else self.columns[:, used]

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
    def _rest(self) -> _Rest:
        """What the parts meet when each block is left out."""
        own = np.any([mask for _, mask in self.parts.values()], axis=0)
        return _Rest.of(self.columns, self.force, self.physics, own)

    def _without(self, stiffness: Mapping[str, float]) -> tuple[NDArray[np.bool_], Array]:
        """Which of the parts' columns take part, and their changes (b, k) without each block."""
        used, penalty = self._chosen(stiffness)
        own = self._rest.own
        return used[own], self._rest.changes(used[own], penalty[np.ix_(own, own)])

    def left_out(self, stiffness: Mapping[str, float]) -> Array:
        """Cross-validated residual (n,) N: each block predicted by a fit to the others."""
        used, changes = self._without(stiffness)
        every = self._rest.of_all(used, changes)
        out = self.force.copy()
        for span, change in zip(self._rest.spans, every, strict=True):
            out[span] -= self.columns[span] @ change
        return out

    def left_out_error(self, stiffness: Mapping[str, float]) -> float:
        """Sum of its squares, N^2."""
        return self._rest.squared_error(*self._without(stiffness))

    def solution(self, stiffness: Mapping[str, float]) -> tuple[Array, float]:
        """Change (k,) of all parameters that fits best, and its effective degrees of freedom."""
        used, penalty = self._chosen(stiffness)
        columns = self._columns(used)
        gram = columns.T @ columns
        full = gram + penalty[np.ix_(used, used)]
        out = np.zeros(len(self.where))
        out[used] = -solve(full, (columns.T @ self.force)[:, None])[:, 0]
        return out, float(np.trace(solve(full, gram)))


@dataclass(frozen=True, eq=False)
class _Rest:
    """What the columns of parts meet when each block is left out, the physics having followed.

    The penalty of the physics does not change with the stiffness of the parts, so it is eliminated
    once (the Schur complement), and each stiffness solves for the parts alone. spans: samples of
    each of b blocks. own (k,): which columns are the parts'. follows (b, k_physics, k_own) and
    alone (b, k_physics): the physics' change is alone - follows x that of the parts. normal (b,
    k_own, k_own), wanted (b, k_own): of the other blocks. gram (b, k_own, k_own), pull (b, k_own),
    square N^2: of the block that is left out.
    """

    spans: list[slice]
    own: NDArray[np.bool_]
    follows: Array
    alone: Array
    normal: Array
    wanted: Array
    gram: Array
    pull: Array
    square: float

    @classmethod
    def of(cls, columns: Array, force: Array, physics: Array, own: NDArray[np.bool_]) -> _Rest:
        spans = blocks_of(len(force))
        grams, pulls = by_blocks(columns, columns, spans), by_blocks(columns, force, spans)
        others, aims = grams.sum(axis=0) - grams, pulls.sum(axis=0) - pulls
        base = others[:, ~own][:, :, ~own] + physics[np.ix_(~own, ~own)]
        across = others[:, ~own][:, :, own]
        solved = solve(base, np.concatenate([across, aims[:, ~own, None]], axis=2))
        follows, alone = solved[..., :-1], solved[..., -1]
        back = across.swapaxes(1, 2)
        # The block's own products, with the physics taken out of force and columns.
        count = int(own.sum())
        out = np.zeros((len(spans), len(own), count))
        out[:, ~own], out[:, own] = -follows, np.eye(count)
        held = np.zeros((len(spans), len(own)))
        held[:, ~own] = alone
        seen = (grams @ held[..., None])[..., 0]
        square = force @ force - 2.0 * np.sum(held * pulls) + np.sum(held * seen)
        return cls(
            spans, own, follows, alone,
            normal=others[:, own][:, :, own] - back @ follows,
            wanted=aims[:, own] - (back @ alone[..., None])[..., 0],
            gram=out.swapaxes(1, 2) @ grams @ out,
            pull=(out.swapaxes(1, 2) @ (pulls - seen)[..., None])[..., 0],
            square=float(square),
        )  # fmt: skip

    def changes(self, used: NDArray[np.bool_], penalty: Array) -> Array:
        """Changes (b, k_used) of the parts' columns that are used, under a penalty (k_own, k_own).

        Each by the other blocks.
        """
        normal = (self.normal + penalty)[:, used][:, :, used]
        return solve(normal, self.wanted[:, used, None])[..., 0]

    def of_all(self, used: NDArray[np.bool_], changes: Array) -> Array:
        """Changes (b, k) of all columns, with these of the parts."""
        out = np.zeros((len(self.spans), len(self.own)))
        out[:, np.flatnonzero(self.own)[used]] = changes
        followed = (self.follows[..., used] @ changes[..., None])[..., 0]
        out[:, ~self.own] = self.alone - followed
        return out

    def squared_error(self, used: NDArray[np.bool_], changes: Array) -> float:
        """What is left of the blocks' squared force, N^2."""
        square = np.einsum("bi,bij,bj->", changes, self.gram[:, used][:, :, used], changes)
        return float(self.square - 2.0 * np.sum(changes * self.pull[:, used]) + square)


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
