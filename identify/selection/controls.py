"""Controls of a change: what it takes of an error by chance.

Where something else remains above the noise floor, noise is no yardstick: smooth columns take part
of any smooth remainder. A control has the change's own columns, shifted in time within each log by
a random part of it: as many, as smooth, as large. Where a shift hardly changes them, as of a
constant or of a sine in time, stretches of each log get random signs instead: a control has to be
able to fail. What has no columns, as another friction, has its change of the residual as one.
Base and columns are solved together in one linear step on the training logs.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from identify.dataset.prepared_log import Columns, PreparedLog, moving, split_by_log, sticks
from identify.estimation.evidence import blocks_of, by_blocks
from identify.estimation.fit import Fit
from identify.estimation.force_balance import jacobian, residual
from identify.estimation.least_squares import RIDGE, ROUNDING, orthonormal
from identify.estimation.residual_noise import SHIFTS
from identify.rules import RULE
from identify.selection.acceptance import Judged, larger, parts
from twin.parallel import spread

Array = NDArray[np.float64]
Falsify = Callable[[Array, np.random.Generator], Array]

TINY = np.finfo(float).tiny  # of what is nothing, as a column where the motion excites none


@dataclass(frozen=True, eq=False)
class ControlTest:
    """A fit beside which columns are tried, on its own logs and on those that it was not fitted to.

    other: None where blocks of the training logs are left out instead. quiet, other_quiet: squared
    noise floors, N^2.
    """

    training: _Part
    other: _Part | None
    quiet: float
    other_quiet: float

    @classmethod
    @lru_cache(maxsize=2)  # every change is tried beside the same fit, and its controls again
    def beside(cls, judged: Judged) -> ControlTest:
        """The trial beside a fit."""
        fit, holdout = judged.fit, judged.dataset.selection
        size = unit_penalty(fit.jacobian)
        own = _Part(fit.logs, fit.residual, fit.jacobian / size, fit.kept)
        if not holdout:
            return cls(own, None, fit.floor**2, judged.other_floor**2)
        kept = np.isfinite(judged.other)
        columns = jacobian(fit.axis, holdout, fit.scaling.where, kept) / size
        there = _Part(holdout, judged.other[kept], columns, kept)
        return cls(own, there, fit.floor**2, judged.other_floor**2)

    @classmethod
    def together(cls, several: Sequence[Judged]) -> ControlTest:
        """The trial beside fits of several axes, each force in units of its own noise floor."""

        def stacked(parts: Sequence[_Part], floors: Sequence[float]) -> _Part:
            pairs = [*zip(parts, floors, strict=True)]
            return _Part(
                [log for p in parts for log in p.logs],
                np.concatenate([p.force / floor for p, floor in pairs]),
                _apart([p.base / floor for p, floor in pairs]),
                np.concatenate([p.kept for p in parts]),
            )

        trials = [cls.beside(judged) for judged in several]
        training = stacked([t.training for t in trials], [j.fit.floor for j in several])
        others = [t.other for t in trials if t.other]
        if len(others) < len(trials):
            return cls(training, None, 1.0, 1.0)
        return cls(training, stacked(others, [j.other_floor for j in several]), 1.0, 1.0)

    def step(self, columns: Columns, *, sticking: bool) -> Array:
        """The strengths (j,) of columns that one linear step finds, with a unit penalty."""
        training = self._with(columns, sticking).training
        return np.asarray(_steps(training.products(None))[0, training.base.shape[1] :])

    def part(self, columns: Columns, *, sticking: bool) -> float:
        """Part of the error above the floor that a linear step with columns takes (``acceptance``).

        columns: logs -> forces (m, j) N of each log, for strengths with a unit penalty. sticking:
        whether test functions with standstill are left out.
        """
        return self._with(columns, sticking).part(None)

    def control(self, columns: Columns, *, sticking: bool) -> float:
        """The part that all but one in twenty of the columns' controls stay below."""
        tried = self._with(columns, sticking)
        falsify = _signed if _survives_shifts(tried.training.columns) else _shifted
        count = round(1.0 / RULE.chance)  # one of them is left aside
        found = spread(lambda i: tried.part((falsify, i)), range(count))
        return float(np.quantile(found, 1.0 - RULE.chance, method="inverted_cdf"))

    def _with(self, columns: Columns, sticking: bool) -> _Tried:
        training = self.training.with_columns(columns, sticking)
        other = self.other and self.other.with_columns(columns, sticking)
        return _Tried(training, other, self.quiet, self.other_quiet)


def _apart(bases: Sequence[Array]) -> Array:
    """Columns (n, k) of several axes as those of all of them: each zero for the others."""
    rows, columns = (np.cumsum([0, *(b.shape[i] for b in bases)]) for i in (0, 1))
    out = np.zeros((rows[-1], columns[-1]))
    for i, base in enumerate(bases):
        out[rows[i] : rows[i + 1], columns[i] : columns[i + 1]] = base
    return out


def change_of(before: Judged, after: Judged) -> Columns:
    """What a change does to the residual, as one column (m, 1) N of each log."""

    def columns(logs: Sequence[PreparedLog]) -> list[Array]:
        both = [residual(j.fit.axis, logs) for j in (before, after)]
        return split_by_log((both[1] - both[0])[:, None], logs)

    return with_unit_penalty(columns, before.fit)


def with_unit_penalty(columns: Columns, fit: Fit) -> Columns:
    """The same, N per unit -> N, such that a weak penalty on their strengths is one.

    By the test functions that a fit keeps: at rest a late reading of a friction may be any force.
    """
    own = columns(fit.logs)
    size = unit_penalty(np.concatenate(own)[fit.kept])

    def scaled(logs: Sequence[PreparedLog]) -> list[Array]:
        return [part / size for part in (own if logs is fit.logs else columns(logs))]

    return scaled


def change_control(before: Judged, after: Judged) -> float:
    """The part that the controls of a change take that is only known by what it does."""
    resting = sticks(before.fit.axis) or sticks(after.fit.axis)
    return ControlTest.beside(before).control(change_of(before, after), sticking=resting)


def unit_penalty(columns: Array) -> Array:
    """The size (k,) of columns (n, k), N per unit, by which a weak penalty on them is one.

    Infinite where the training logs do not excite a strength: it stays, whatever it does in others.
    """
    norms = np.linalg.norm(columns, axis=0)
    return np.where(norms > TINY, RIDGE * norms, np.inf)


def _shifted(column: Array, rng: np.random.Generator) -> Array:
    return np.roll(column, round(rng.uniform(*SHIFTS) * len(column)), axis=0)


def _signed(column: Array, rng: np.random.Generator) -> Array:
    stretches = 8  # of a log, each with a sign of its own
    signs = rng.choice([-1.0, 1.0], stretches)
    return column * np.repeat(signs, -(-len(column) // stretches))[: len(column), None]


def _survives_shifts(columns: Sequence[Array]) -> bool:
    """Whether columns (m, j) of logs span about the same as themselves shifted in time."""
    own, rng = orthonormal(np.concatenate(columns)), np.random.default_rng(0)
    inside = []
    for _ in range(4):  # shifts by which that is told
        moved = np.concatenate([_shifted(c, rng) for c in columns])
        inside.append(float(np.sum((own.T @ moved) ** 2) / max(np.sum(moved**2), TINY)))
    same = 0.5  # of the square of shifted columns, from which they are in the span of the true ones
    return float(np.mean(inside)) > same


@dataclass(frozen=True, eq=False)
class _Part:
    """Some logs: residual (n,) N and the base's columns (n, k), of the test functions kept (m,).

    columns: those that are tried, (m, j) for each log. All are for strengths with a unit penalty.
    """

    logs: Sequence[PreparedLog]
    force: Array
    base: Array
    kept: NDArray[np.bool_]
    columns: Sequence[Array] = ()

    def with_columns(self, columns: Columns, sticking: bool) -> _Part:
        """The same with columns to try; sticking: without test functions with standstill."""
        kept = moving(self.logs, sticking) & self.kept
        among = kept[self.kept]
        return _Part(self.logs, self.force[among], self.base[among], kept, columns(self.logs))

    @cached_property
    def spans(self) -> list[slice]:
        """Samples of each block."""
        return blocks_of(len(self.force))

    @cached_property
    def own(self) -> Array:
        """Inner products (b, p, p), by blocks, of force and the base's columns, force first."""
        both = np.column_stack([self.force, self.base])
        return by_blocks(both, both, self.spans)

    def products(self, false: tuple[Falsify, np.random.Generator] | None) -> Array:
        """The same with the columns that are tried last; false: made controls."""
        tried, own, first = self._tried(false), self.own, self.own.shape[1]
        both = first + tried.shape[1]
        out = np.empty((len(own), both, both))
        out[:, :first, :first] = own
        out[:, first:, first:] = by_blocks(tried, tried, self.spans)
        out[:, first:, 0] = by_blocks(tried, self.force, self.spans)
        out[:, first:, 1:first] = by_blocks(tried, self.base, self.spans)
        out[:, :first, first:] = out[:, first:, :first].swapaxes(1, 2)
        return out

    def _tried(self, false: tuple[Falsify, np.random.Generator] | None) -> Array:
        made = [c if false is None else false[0](c, false[1]) for c in self.columns]
        return np.concatenate(made)[self.kept]


@dataclass(frozen=True, eq=False)
class _Tried:
    """Columns beside a fit, on both groups of logs."""

    training: _Part
    other: _Part | None
    quiet: float
    other_quiet: float

    def part(self, false: tuple[Falsify, int] | None) -> float:
        """Part of the error above the floor that a linear step takes, the smaller of two groups."""
        rng = None if false is None else (false[0], np.random.default_rng(false[1]))
        blocks = self.training.products(rng)
        steps, without = _steps(blocks), self._without
        own = _parts(self.training, blocks, steps, without, self.quiet)
        if self.other is None:
            left = _steps(blocks, leave_out=True)
            return min(own, _parts(self.training, blocks, left, self._left_out, self.quiet))
        there = self.other.products(rng)
        return min(own, _parts(self.other, there, steps, without, self.other_quiet))

    @cached_property
    def _without(self) -> Array:
        """Step of the base alone."""
        return _steps(self.training.own)

    @cached_property
    def _left_out(self) -> Array:
        """The same by blocks, each by the others."""
        return _steps(self.training.own, leave_out=True)


def _steps(products: Array, leave_out: bool = False) -> Array:
    """Step (1, p - 1) that minimises the squared force; (b, p - 1), by the others, if left out."""
    whole = products.sum(axis=0)
    penalty = np.eye(len(whole) - 1)
    if leave_out:
        others = whole - products
        return np.linalg.solve(others[:, 1:, 1:] + penalty, others[:, 1:, :1])[..., 0]
    return np.linalg.solve(whole[1:, 1:] + penalty, whole[1:, 0])[None]


def _parts(part: _Part, products: Array, steps: Array, without: Array, quiet: float) -> float:
    count = np.array([span.stop - span.start for span in part.spans])
    before, after = (
        np.maximum(_squares(p, s), ROUNDING * p[:, 0, 0] + TINY) / count
        for p, s in ((part.own, without), (products, steps))
    )
    return larger(*parts(before, after, count, quiet))


def _squares(products: Array, steps: Array) -> Array:
    """What steps (b or 1, p - 1) leave of the squared force, (b,) N^2, by products (b, p, p).

    Force is F, a column X, a step s, and what is left |F - X s|^2.
    """
    change = np.column_stack([np.ones(len(steps)), -steps])
    return np.asarray(np.einsum("bi,bij,bj->b", change, products, change))
