"""Least squares: Levenberg-Marquardt within bounds, and what the span of some columns holds.

K. Levenberg (1944), D. W. Marquardt (1963), with the damping schedule of L. Jia (2023): 0.01 to
start, a tenth on success, tenfold on failure; after a step that keeps less than most of what it
promised it stays as it is, or the next step would fail. A variable at a bound that the gradient
pushes outwards is held there for the step. It solves the normal equations of scaled columns, which
costs two matrix products an iteration; the QR decomposition of a general solver took most of a fit.

A Jacobian costs a walk over the motion for every variable, a residual one. Between two Jacobians
the columns therefore follow the residuals by secants (C. G. Broyden, "A class of methods for
solving nonlinear simultaneous equations", Math. Comput. 19, 1965) while each step keeps most of
what it promises; the search ends only on a true Jacobian.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from twin.signals import Array

MOST_EVALUATIONS = 100  # of a search that is only to end
RIDGE = 1e-4  # of a column's length, which keeps what is not excited, or explained twice, finite
ROUNDING = 1e-12  # of a sum of squares: what thousands of terms of rounding leave of nothing
EXACT = float(np.finfo(float).eps)  # relative fall of a sum of squares that is none


@dataclass(frozen=True, eq=False)
class Solution:
    """Variables (k,) at the end, and whether no step lowers the cost further."""

    x: Array
    converged: bool


def minimise(
    residual: Callable[[Array], Array],
    jacobian: Callable[[Array], Array],
    start: Array,
    bounds: tuple[Array, Array],
    *,
    tolerance: float = EXACT,
    most_evaluations: int = MOST_EVALUATIONS,
) -> Solution:
    """Variables that minimise the sum of squares of the residual (n,) within bounds (k,), (k,).

    tolerance: relative fall of the sum of squares below which the search ends. start: (k,). Where
    the residual at the start is not finite, the start is returned as not converged. jacobian: may
    overwrite what it gave before; nobody else does.
    """
    first_damping = 1e-2  # of the curvature: a first step that is nearly the undamped one
    low, high = bounds
    x = np.clip(start, low, high)
    force = residual(x)
    cost = _cost(force)
    damping, most_damping = first_damping, 1.0 / np.sqrt(EXACT)
    if not np.isfinite(cost):
        return Solution(x, False)
    columns, exact = jacobian(x), True
    for _ in range(most_evaluations):
        step = _step(columns, force, damping, x, bounds)
        if not np.isfinite(step).all():
            return Solution(x, False)
        moved = np.clip(x + step, low, high)
        trial = residual(moved)
        trial_cost = _cost(trial)
        if trial_cost <= cost:
            promised = cost - _cost(force + columns @ (moved - x))
            fall = 1.0 - trial_cost / cost if cost > 0.0 else 0.0
            # 0.75 of the fall that the columns promise: kept, the next step may trust them more
            good = cost - trial_cost > 0.75 * max(promised, EXACT * cost)
            if fall < tolerance and exact:
                return Solution(moved, True)
            if good and fall >= tolerance:
                columns, exact = columns.copy() if exact else columns, False
                _follow(columns, moved - x, trial - force)
            else:
                del columns  # not to be held beside the new ones
                columns, exact = jacobian(moved), True
            x, force, cost = moved, trial, trial_cost
            # a tenth, and ten times where a step failed: D. W. Marquardt's own factors, 1963
            damping = max(0.1 * damping, 1.0 / most_damping) if good else damping
        elif not exact:
            del columns
            columns, exact = jacobian(x), True
        elif damping <= first_damping and _cost(force + columns @ step) > (1.0 - tolerance) * cost:
            return Solution(x, True)  # nearly undamped and not cut at bounds, it promises no more
        else:
            damping *= 10.0
            if damping > most_damping or not np.any(moved != x):
                return Solution(x, True)
    return Solution(x, False)


def _cost(force: Array) -> float:
    """Sum of squares; infinite, or no number, where that of a motion without end is."""
    with np.errstate(over="ignore", invalid="ignore"):
        return float(force @ force)


def _follow(columns: Array, step: Array, change: Array) -> None:
    """Change columns (n, k) least such that they give this change (n,) along this step (k,).

    Least in columns of unit length, so that the units of the variables do not matter.
    """
    weighed = np.einsum("ij,ij->j", columns, columns) * step
    size = float(weighed @ step)
    if size == 0.0:
        return
    gains = (change - columns @ step) / size
    rows = 1 << 10  # that a secant changes at once
    for first in range(0, len(gains), rows):  # the columns of a fit are most of its memory
        at = slice(first, first + rows)
        columns[at] += np.outer(gains[at], weighed)


def _step(
    columns: Array, force: Array, damping: float, x: Array, bounds: tuple[Array, Array]
) -> Array:
    with np.errstate(over="ignore", invalid="ignore"):
        gradient, normal = columns.T @ force, columns.T @ columns
    if not (np.isfinite(gradient).all() and np.isfinite(normal).all()):
        return np.full(len(gradient), np.nan)
    size = np.sqrt(np.diag(normal))
    held = ((x <= bounds[0]) & (gradient > 0)) | ((x >= bounds[1]) & (gradient < 0))
    free = ~held & (size > 0)
    step = np.zeros(len(gradient))
    if free.any():
        scale = size[free]
        unit = normal[np.ix_(free, free)] / np.outer(scale, scale) + damping * np.eye(len(scale))
        step[free] = -np.linalg.solve(unit, gradient[free] / scale) / scale
    return step


def orthonormal(columns: Array) -> Array:
    """Orthonormal basis (n, r) of the columns' span."""
    norms = np.linalg.norm(columns, axis=0)
    scaled = columns[:, norms > 0] / norms[norms > 0]
    power, directions = np.linalg.eigh(scaled.T @ scaled)
    kept = power > ROUNDING * power.max(initial=1.0)
    return scaled @ (directions[:, kept] / np.sqrt(power[kept]))


def unabsorbed(force: Array, basis: Array) -> Array:
    """The part of forces (n,) or (n, k), N, outside the span of an orthonormal basis (n, r)."""
    return np.asarray(force - basis @ (basis.T @ force))


def solve(matrix: Array, right: Array) -> Array:
    """Solution (..., k, m) of symmetric positive systems, scaled as their unknowns differ in unit.

    matrix (..., k, k), right (..., k, m). An unknown that nothing depends on is 0.
    """
    own = np.diagonal(matrix, axis1=-2, axis2=-1)[..., None]
    size = np.sqrt(np.where(own > 0.0, own, 1.0))
    scaled = matrix / size / np.swapaxes(size, -1, -2) + ROUNDING * np.eye(matrix.shape[-1])
    return np.asarray(np.linalg.solve(scaled, right / size) / size)
