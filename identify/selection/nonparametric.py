"""Nonparametric effects: smooth curves fitted to a force that no physical effect explains.

A nonparametric effect (an Effect with ``parts``) is linear in its strengths. Beside the linearised
physics of a fitted base, each part gets the smoothing with the least cross-validated error, or is
left out. Then the whole model is refitted. The physical effects have a prior at their values in the
base, so that a force that both could explain stays with them. The nonparametric effect is kept if
evidence and held-out logs support it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from identify.dataset.dataset import Dataset
from identify.dataset.excitation import excitation
from identify.dataset.prepared_log import moving, sticks
from identify.estimation.evidence import BLOCKS, Evidence, effective_samples, held_out_gain
from identify.estimation.fit import Fit, fit_axis
from identify.estimation.force_balance import jacobian, residual
from identify.estimation.smoothing import part_rows, smoothing
from identify.estimation.variable_projection import fit_without
from identify.selection.candidates import Candidate
from twin.effect import Effect, Part
from twin.model.machine import AxisModel, Fitted, MachineModel
from twin.model.parameters import ParameterReference

Array = NDArray[np.float64]

STIFFNESS = 10.0 ** np.arange(1.0, -5.1, -0.5)  # tried for each part
WORTH = 0.99  # a further part must lower the squared cross-validated error below this part
ROUNDS = 3  # of choosing the smoothing again, at most
BETTER = 0.95  # another round must lower the error below this part
ROUNDING = 1e-12  # of a unit diagonal, keeps a system solvable
RIDGE = 1e-4  # on the physics, in units of their columns


@dataclass(frozen=True, eq=False)
class _Linear:
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
    def about(cls, base: Fit, dataset: Dataset, fitted: Fitted) -> _Linear:
        effect = fitted.effect
        own = [ParameterReference(effect.name, p) for p in effect.strengths]
        where = [*base.scaling.where, *own]
        alone = replace(base.axis, effects=(fitted,))
        new = jacobian(alone, dataset.fit, own)[base.kept]
        norms = np.linalg.norm(base.jacobian, axis=0)
        rows = smoothing(base.axis, where, len(base.residual))
        physics = rows.T @ rows + np.diag([*(RIDGE * norms) ** 2, *np.zeros(len(own))])
        return cls(
            where, base.residual, np.hstack([base.jacobian, new]), physics,
            {part.name: _penalty(part, effect.name, where) for part in effect.parts},
        )  # fmt: skip

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
        edges = np.linspace(0, len(self.force), BLOCKS + 1).astype(int)
        spans = [slice(a, b) for a, b in pairwise(edges)]
        columns = [self.columns[span] for span in spans]
        grams = np.stack([c.T @ c for c in columns])
        pulls = np.stack([c.T @ self.force[s] for s, c in zip(spans, columns, strict=True)])
        return spans, grams, pulls

    def _without(self, stiffness: Mapping[str, float]) -> tuple[NDArray[np.bool_], Array]:
        """Which columns take part, and the changes (b, k_used) when each block is left out."""
        used, penalty = self._chosen(stiffness)
        _, grams, pulls = self.blocks
        rest = (grams.sum(axis=0) + penalty - grams)[:, used][:, :, used]
        return used, _solve(rest, (pulls.sum(axis=0) - pulls)[:, used, None])[..., 0]

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
        out[used] = -_solve(full, (columns.T @ self.force)[:, None])[:, 0]
        return out, float(np.trace(_solve(full, gram)))


def _penalty(
    part: Part, effect: str, where: Sequence[ParameterReference]
) -> tuple[Array, NDArray[np.bool_]]:
    rows = part_rows(part, effect, where)
    mask = np.array([c.effect == effect and c.parameter.name in part.strengths for c in where])
    return rows.T @ rows, mask


def _solve(matrix: Array, right: Array) -> Array:
    """Solution (..., k, m) of symmetric positive systems, scaled as their unknowns differ in unit.

    matrix (..., k, k), right (..., k, m).
    """
    size = np.sqrt(np.maximum(np.diagonal(matrix, axis1=-2, axis2=-1), 1e-300))[..., None]
    scaled = matrix / size / np.swapaxes(size, -1, -2) + ROUNDING * np.eye(matrix.shape[-1])
    return np.asarray(np.linalg.solve(scaled, right / size) / size)


def choose_stiffness(linear: _Linear) -> dict[str, float]:
    """Stiffness of each part that lowers the cross-validated error; other parts are left out.

    Parts are added one by one, the most helpful first; then the earlier ones are tuned again.
    """
    chosen: dict[str, float] = {}
    error = linear.left_out_error(chosen)
    while len(chosen) < len(linear.parts):
        found = [_best(linear, chosen, name) for name in linear.parts if name not in chosen]
        further, name, value = min(found)
        if not further < WORTH * error:
            break
        earlier, chosen[name] = tuple(chosen), value
        for other in earlier:
            further, _, chosen[other] = _best(linear, chosen, other)
        error = further
    return chosen


def _best(linear: _Linear, chosen: Mapping[str, float], name: str) -> tuple[float, str, float]:
    """Squared cross-validated error, name and best stiffness of a part beside the others."""
    errors = [linear.left_out_error({**chosen, name: v}) for v in STIFFNESS]
    least = int(np.argmin(errors))
    return errors[least], name, float(STIFFNESS[least])


def fit_nonparametric(base: Fit, dataset: Dataset, effect: Effect) -> Candidate:
    """Fit a nonparametric effect beside the physics of a base, and judge it on the held-out logs.

    Without held-out logs it is judged by cross-validation. The curves cover the motion of the fit
    logs only. The evidence counts the effective degrees of freedom.
    """
    covered = effect.starts(excitation([log.motion for log in dataset.fit], None))
    empty = Fitted.at_start(effect, covered)
    best = _attempt(base, base, dataset, empty)
    for _ in range(ROUNDS):
        # The missing force had distorted the physics of the base, so choose again beside the refit.
        again = _attempt(base, fit_without(best.fit, dataset, effect.name), dataset, empty)
        if not again.fit.error < BETTER * best.fit.error:
            break
        best = again
    return best


def _attempt(base: Fit, ground: Fit, dataset: Dataset, empty: Fitted) -> Candidate:
    """Choose the smoothing beside the physics of ``ground``, refit, and judge against the base."""
    linear = _Linear.about(ground, dataset, empty)
    stiffness = choose_stiffness(linear)
    change, freedom = linear.solution(stiffness)
    first = _filled(empty, linear, stiffness, change)
    fit = fit_axis(ground.axis.with_effect(first), dataset.fit)
    if dataset.holdout:
        held = moving(dataset.holdout, sticks(base.axis) or sticks(fit.axis))
        pair = [residual(f.axis, dataset.holdout)[held] for f in (base, fit)]
    else:
        pair = [linear.left_out(s) for s in ({}, stiffness)]
    gain = np.log(np.sum(base.residual**2) / np.sum(fit.residual**2))
    added = max(round(freedom - linear.solution({})[1]), 1)
    return Candidate(
        effect=empty.effect,
        axis=dataset.axis,
        fit=fit,
        evidence=Evidence(float(gain), added, effective_samples(fit.residual)),
        gain=held_out_gain(pair[0], pair[1], fit.floor),
    )


def followed(fitted: Fitted) -> tuple[str, ...]:
    """The parts of a nonparametric effect that are not zero: what its force depends on."""
    parts = fitted.effect.parts
    return tuple(p.name for p in parts if any(fitted.values[n] for n in p.strengths))


def nonparametric_labels(axis: AxisModel) -> frozenset[str]:
    """Labels of the strengths of nonparametric effects, which have no meaning one by one."""
    return frozenset(
        f"{f.effect.name}.{p.name}"
        for f in axis.effects
        if f.effect.is_nonparametric
        for p in f.effect.strengths
    )


def physics_alone(model: MachineModel) -> MachineModel:
    """The model without its nonparametric effects, so that physics can explain their force."""
    for name, axis in model.axes.items():
        kept = tuple(f for f in axis.effects if not f.effect.is_nonparametric)
        model = model.with_axis(name, replace(axis, effects=kept))
    return model


def _filled(
    empty: Fitted, linear: _Linear, stiffness: Mapping[str, float], change: Array
) -> Fitted:
    """The effect with its strengths and stiffness; parts left out are zero and fixed."""
    step = {(c.effect, c.parameter.name): x for c, x in zip(linear.where, change, strict=True)}
    values, fixed = dict(empty.values), set(empty.fixed)
    for part in empty.effect.parts:
        if part.name not in stiffness:
            fixed.update(part.strengths)
            continue
        values.update({n: float(step[empty.effect.name, n]) for n in part.strengths})
        values[part.stiffness] = stiffness[part.name]
    return replace(empty, values=values, fixed=frozenset(fixed))
