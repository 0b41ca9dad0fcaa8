"""Proof against decoys: whether an effect gains more than its own columns do where they are untrue.

Where something else remains above the noise floor, noise is no yardstick for an effect: a smooth
remainder is lessened by any smooth columns. A decoy has the effect's own columns, shifted in time
within each log by 10 to 90 % of it: as many, as smooth, as large, and true to nothing. Base and
effect are solved in one linear step on the fit logs, and scored on the held-out logs; on blocks
left out where there are none.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from identify.dataset.dataset import Dataset
from identify.dataset.prepared_log import PreparedLog, moving, split_by_log, sticks
from identify.estimation.decision import RULE
from identify.estimation.evidence import Gain, blocks_of, by_blocks
from identify.estimation.fit import Fit
from identify.estimation.force_balance import jacobian, residual
from identify.estimation.time_origin import depends_on_time_origin
from twin.effect import Kind
from twin.model.machine import Fitted
from twin.model.parameters import ParameterReference
from twin.parallel import spread

Array = NDArray[np.float64]
Columns = Callable[[Sequence[PreparedLog]], list[Array]]

DECOYS = 40
RARE = 0.05  # of the decoys take more than that which an effect is set against
SHIFTS = (0.1, 0.9)  # of a log, by which columns are shifted
SEED = 0  # of the shifts, the same for each effect
RIDGE = 1e-4  # of a column's length, which keeps what the motion does not excite finite
ROUNDING = 1e-12  # of a squared force, below which its remainder is not told
TINY = 1e-100  # of anything that is nothing, as a column where the motion excites none


@dataclass(frozen=True)
class Proof:
    """Part of the squared test error that an effect takes, and that only RARE decoys exceed, 0..1.

    The most that one of them takes is chance: some shift nearly repeats a motion that repeats. Both
    may be below zero, where the test error rises. typical: whether of that of a typical block,
    not of all of it.
    """

    gain: float
    decoy: float
    typical: bool = False

    @property
    def holds(self) -> bool:
        """Whether the effect leaves clearly less than its decoys."""
        return 1.0 - self.gain < RULE.beside_decoys * (1.0 - self.decoy)


def proof(without: Fit, fitted: Fitted, dataset: Dataset, fit: Gain | None = None) -> Proof | None:
    """How an effect, at the shape it was found with, does beside a fit without it, and its decoys.

    fit: what the fit with it takes of the held-out logs. The effect gains that where it is more
    than one linear step takes: a law that changes what others' shapes must be does more than its
    columns tell. None where a shift in time makes no decoy: a friction takes the place of another,
    and what depends on the time alone is as true at any other.
    """
    axis = without.axis.with_effect(fitted)
    where = [
        ParameterReference(fitted.effect.name, p)
        for p in fitted.effect.strengths
        if p.name not in fitted.fixed
    ]
    timed = depends_on_time_origin(replace(axis, effects=(fitted,)), dataset)
    if fitted.effect.kind is Kind.FRICTION or timed or not where:
        return None

    size = _ridge(jacobian(axis, dataset.fit, where))

    def columns(logs: Sequence[PreparedLog]) -> list[Array]:
        return split_by_log(jacobian(axis, logs, where) / size, logs)

    whole, typical = Trial.of(without, dataset).proofs(columns, sticking=sticks(axis))
    if fit is not None:
        whole = replace(whole, gain=max(whole.gain, 1.0 - fit.left))
        typical = replace(typical, gain=max(typical.gain, 1.0 - fit.typical))
    return clearer((whole, typical))


def clearer(proofs: tuple[Proof, Proof]) -> Proof:
    """The one that parts an effect and its decoys more."""
    return min(proofs, key=lambda p: (1.0 - p.gain) / (1.0 - p.decoy))


@dataclass(frozen=True, eq=False)
class Trial:
    """A fit beside which forces and their decoys are tried, on its own logs and the held-out ones.

    held: None where blocks of the fit logs are left out instead. quiet: N^2, squared noise floor.
    """

    fit: _Part
    held: _Part | None
    quiet: float = 0.0

    @classmethod
    def of(cls, base: Fit, dataset: Dataset) -> Trial:
        """The trial on the logs of a dataset."""
        size = _ridge(base.jacobian)
        held = _Part.of(base, dataset.holdout, size) if dataset.holdout else None
        return cls(_Part.of(base, dataset.fit, size), held, base.floor**2)

    def of_power(self) -> Trial:
        """The same of the residual's square beside a constant, which of steady noise is all."""
        return Trial(self.fit.of_power(), self.held and self.held.of_power())

    def proofs(
        self, columns: Columns, *, sticking: bool, decoys: int = DECOYS, rare: float = RARE
    ) -> tuple[Proof, Proof]:
        """What columns take of the fit's squared test error in one linear step, and their decoys.

        Of all of it, and of that of a typical block. columns: logs -> forces (m, j) N of each log,
        for strengths with a unit penalty. sticking: whether test functions with standstill are left
        out. rare: part of the decoys that may take more than the one told.
        """
        fit = self.fit.with_columns(columns, sticking)
        held = self.held and self.held.with_columns(columns, sticking)
        count = len(fit.columns) + (len(held.columns) if held else 0)

        def left(shifts: Array | None) -> Array:
            return _left(fit, held, shifts, self.quiet)

        shifts = np.random.default_rng(SEED).uniform(*SHIFTS, (decoys, count))
        before, after, *others = spread(left, [None, np.zeros(count), *shifts])
        gains = 1.0 - after / before
        untrue = [1.0 - other / before for other in others] or [np.full(2, -np.inf)]
        whole, typical = np.stack(
            [gains, np.quantile(untrue, 1.0 - rare, axis=0, method="inverted_cdf")], axis=1
        )
        (gain, decoy), (usual, usual_decoy) = whole.tolist(), typical.tolist()
        return Proof(gain, decoy), Proof(usual, usual_decoy, typical=True)


@dataclass(frozen=True, eq=False)
class _Part:
    """Some logs: residual (n,) N and the base's columns (n, k), of the test functions kept.

    columns: those that are tried, (m, j) for each log. All are for strengths with a unit penalty.
    """

    logs: Sequence[PreparedLog]
    force: Array
    base: Array
    kept: NDArray[np.bool_]
    columns: Sequence[Array] = ()

    @classmethod
    def of(cls, base: Fit, logs: Sequence[PreparedLog], size: Array) -> _Part:
        force = residual(base.axis, logs)
        own = jacobian(base.axis, logs, base.scaling.where)
        own /= size
        return cls(logs, force, own, np.ones(len(force), dtype=bool))

    def of_power(self) -> _Part:
        """The same with the residual's square (n,) N^2 beside a constant."""
        return replace(self, force=self.force**2, base=np.ones((len(self.force), 1)))

    def with_columns(self, columns: Columns, sticking: bool) -> _Part:
        """The same with columns to try; sticking: without test functions with standstill."""
        kept = moving(self.logs, sticking)
        return _Part(self.logs, self.force[kept], self.base[kept], kept, columns(self.logs))

    def products(self, shifts: Array | None) -> Array:
        """Inner products (b, p, p), by blocks, of force, base's columns and those that are tried.

        The latter are shifted by parts of each log; None: they are left out.
        """
        spans, own = self._own
        if shifts is None:
            return own
        tried, first = self._shifted(shifts), own.shape[1]
        both = first + tried.shape[1]
        out = np.empty((len(own), both, both))
        out[:, :first, :first] = own
        out[:, first:, first:] = by_blocks(tried, tried, spans)
        out[:, first:, 0] = by_blocks(tried, self.force, spans)
        out[:, first:, 1:first] = by_blocks(tried, self.base, spans)
        out[:, :first, first:] = out[:, first:, :first].swapaxes(1, 2)
        return out

    @cached_property
    def _own(self) -> tuple[list[slice], Array]:
        """Samples of each block, and the products of force and base's columns, force first."""
        spans = blocks_of(len(self.force))
        both = np.column_stack([self.force, self.base])
        return spans, by_blocks(both, both, spans)

    def _shifted(self, shifts: Array) -> Array:
        """The columns that are tried (n, j), shifted by parts of each log."""
        ends = np.cumsum([len(c) for c in self.columns])[:-1]
        pairs = zip(self.columns, np.split(self.kept, ends), shifts, strict=True)
        return np.concatenate(
            [c[(np.flatnonzero(kept) - round(shift * len(c))) % len(c)] for c, kept, shift in pairs]
        )


def _ridge(columns: Array) -> Array:
    """The size (k,) of columns (n, k), N per unit, by which a weak penalty on them is one.

    Infinite where the fit logs do not excite a strength: it stays, whatever it does in others.
    """
    norms = np.linalg.norm(columns, axis=0)
    return np.where(norms > TINY, RIDGE * norms, np.inf)


def _left(fit: _Part, held: _Part | None, shifts: Array | None, quiet: float = 0.0) -> Array:
    """Squared test error (2,) N^2 after a linear step with columns so shifted: mean and typical.

    Typical is the geometric mean over blocks, so that a few with large errors do not decide alone,
    as where a log creeps at speeds that the fit logs have not; quiet, N^2, is added to it, so that
    a few that hold next to nothing do not either. Products of columns tell it all: force is F, a
    column X, a step s, and what is left |F - X s|^2.
    """
    first = len(fit.columns)
    blocks = fit.products(None if shifts is None else shifts[:first])
    whole = blocks.sum(axis=0)
    penalty = np.eye(len(whole) - 1)
    if held is None:  # each block by the step of the others
        there, others = blocks, whole - blocks
        steps = np.linalg.solve(others[:, 1:, 1:] + penalty, others[:, 1:, :1])[..., 0]
    else:
        there = held.products(None if shifts is None else shifts[first:])
        step = np.linalg.solve(whole[1:, 1:] + penalty, whole[1:, 0])
        steps = np.broadcast_to(step, (len(there), len(step)))
    samples = len((held or fit).force)
    squares = np.maximum(_squares(there, steps), ROUNDING * there[:, 0, 0] + TINY)
    logs = np.log(squares * (len(squares) / samples) + quiet)
    return np.array([squares.sum() / samples, np.exp(logs.mean())])


def _squares(products: Array, steps: Array) -> Array:
    """What steps (b, p - 1) leave of the squared force, (b,) N^2, by products (b, p, p)."""
    change = np.column_stack([np.ones(len(steps)), -steps])
    return np.einsum("bi,bij,bj->b", change, products, change)
