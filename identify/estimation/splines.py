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
from identify.dataset.prepared_log import split_by_log
from identify.estimation.evidence import BETTER, blocks_of, by_blocks
from identify.estimation.fit import Fit, part_rows, smoothing
from identify.estimation.force_balance import jacobian
from identify.estimation.least_squares import RIDGE, solve
from twin.curve import Part
from twin.model.machine import Fitted
from twin.model.parameters import ParameterReference
from twin.signals import Array

STIFFNESS = tuple(10.0 ** np.arange(1.0, -5.1, -0.5))  # tried for each part


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
        cls,
        base: Fit,
        dataset: Dataset,
        fitted: Fitted,
        among: NDArray[np.bool_] | None = None,
        less: str | None = None,
    ) -> Linearised:
        """The base's residual, or some of its test functions (n,), with an effect's columns.

        less: name of an effect of the base whose columns are left out.
        """
        some = np.flatnonzero(np.ones(len(base.residual), bool) if among is None else among)
        effect = fitted.effect
        free = [p for p in effect.strengths if p.name not in fitted.fixed]
        own = [ParameterReference(effect.name, p) for p in free]
        rest = np.flatnonzero([c.effect != less for c in base.scaling.where])
        where = [*(base.scaling.where[i] for i in rest), *own]
        alone = replace(base.axis, effects=(fitted,))
        first = len(rest)
        # Who asks for less reads the columns of the effect apart from the others.
        columns = np.empty((len(some), len(where)), order="F" if less else "C")
        columns[:, :first] = base.jacobian[np.ix_(some, rest)]
        asked, end = np.zeros(len(base.kept), dtype=bool), 0
        asked[np.flatnonzero(base.kept)[some]] = True
        for log, kept in zip(dataset.training, split_by_log(asked, dataset.training), strict=True):
            begin, end = end, end + int(kept.sum())  # one by one: there are many columns
            columns[begin:end, first:] = jacobian(alone, [log], own, kept) / base.gain
        norms = np.linalg.norm(base.jacobian, axis=0)[rest]
        bends = smoothing(base.axis, where, len(base.residual))
        physics = bends.T @ bends + np.diag([*(RIDGE * norms) ** 2, *np.zeros(len(own))])
        return cls(
            where, base.residual[some], columns, physics,
            {
                part.name: _penalty(part, effect.name, where)
                for part in effect.parts if not fitted.fixed.issuperset(part.strengths)
            },
        )  # fmt: skip

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
        used = ~self._own
        penalty = self.physics.copy()
        for name, value in stiffness.items():
            rows, mask = self.parts[name]
            used = used | mask
            penalty += len(self.force) * value**2 * rows
        return used, penalty

    @cached_property
    def _own(self) -> NDArray[np.bool_]:
        """Which columns (k,) are the parts'; o in number."""
        return np.any([mask for _, mask in self.parts.values()], axis=0)

    @cached_property
    def _reduced(self) -> tuple[list[slice], Array, Array, Array, Array, Array]:
        """Of b blocks, each to be left out: the samples, and the least squares of the parts alone.

        The penalty of the physics does not change with the stiffness of the parts, so the physics
        are eliminated once (the Schur complement). What follows from 1 and the parts' changes:
        changes of all columns (b, k, 1 + o), normal equations (b, o, o) with their right sides
        (b, o) by the other blocks, products of the block that is left out with itself
        (b, 1 + o, 1 + o) and with the force (b, 1 + o).
        """
        own, spans = self._own, blocks_of(len(self.force))
        grams = by_blocks(self.columns, self.columns, spans)
        pulls = by_blocks(self.columns, self.force, spans)[..., None]
        others, aims = grams.sum(axis=0) - grams + self.physics, pulls.sum(axis=0) - pulls
        base, count = others[:, ~own], int(own.sum())
        follow = np.zeros((len(spans), len(own), 1 + count))
        right = np.concatenate([aims[:, ~own], -base[:, :, own]], axis=2)
        follow[:, ~own] = solve(base[:, :, ~own], right)
        follow[:, own, 1:] = np.eye(count)
        normal, back = others[:, own] @ follow, follow.swapaxes(1, 2)
        wanted = aims[:, own, 0] - normal[..., 0]
        return spans, follow, normal[..., 1:], wanted, back @ grams @ follow, (back @ pulls)[..., 0]

    def _without(self, stiffness: Mapping[str, float]) -> Array:
        """1 and the changes of the parts' columns (b, 1 + o) that fit best without each block."""
        own, (_, _, normal, wanted, _, _) = self._own, self._reduced
        used, penalty = self._chosen(stiffness)
        kept = used[own]
        out = np.zeros((len(wanted), 1 + len(kept)))
        out[:, 0] = 1.0
        matrix = (normal + penalty[np.ix_(own, own)])[:, kept][:, :, kept]
        out[:, 1:][:, kept] = solve(matrix, wanted[:, kept, None])[..., 0]
        return out

    def left_out(self, stiffness: Mapping[str, float]) -> Array:
        """Cross-validated residual (n,) N: each block predicted by a fit to the others."""
        each = zip(*self._reduced[:2], self._without(stiffness), strict=True)
        return self.force - np.concatenate(
            [self.columns[span] @ (f @ own) for span, f, own in each]
        )

    def left_out_error(self, stiffness: Mapping[str, float]) -> float:
        """Sum of its squares, N^2."""
        changes, (_, _, _, _, gram, pull) = self._without(stiffness), self._reduced
        square = np.einsum("bi,bij,bj->", changes, gram, changes)
        return float(self.force @ self.force - 2.0 * np.sum(changes * pull) + square)

    def solution(self, stiffness: Mapping[str, float]) -> tuple[Array, float]:
        """Change (k,) of all parameters that fits best, and its effective degrees of freedom."""
        used, penalty = self._chosen(stiffness)
        columns = self._columns(used)
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
        if not further < BETTER * error:
            break
        earlier, chosen[name] = tuple(chosen), value
        for other in earlier:
            further, _, chosen[other] = _best(linear, chosen, other, tried)
        error = further
    return chosen


def _best(
    linear: Linearised, chosen: Mapping[str, float], name: str, tried: Sequence[float]
) -> tuple[float, str, float]:
    """Squared cross-validated error, name and best stiffness of a part beside the others.

    Every other value is tried first, then those beside the best.
    """

    def error(i: int) -> float:
        return linear.left_out_error({**chosen, name: tried[i]})

    found = {i: error(i) for i in range(0, len(tried), 2)}
    least = min(found, key=lambda i: found[i])
    found |= {i: error(i) for i in (least - 1, least + 1) if 0 <= i < len(tried)}
    least = min(found, key=lambda i: found[i])
    return found[least], name, float(tried[least])
