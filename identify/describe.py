"""A description of what no physical effect explains: smoothed, judged, and fitted with the rest.

A description (an Effect with ``parts``) is linear in its strengths. Beside the physics of a fitted
base, linearised, every part is given the smoothing whose error on left-out blocks is least, or left
out. Then the whole model is refitted: physics unsmoothed and pulled to where it was, so that what
both could explain stays with the physics. It is kept where evidence and held-out logs ask for it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from identify.candidates import Candidate
from identify.evidence import BLOCKS, Evidence, effective_samples, held_out_gain
from identify.fit import Fit, coloured_noise, fit_axis, sticks
from identify.motion import excitation
from identify.residual import jacobian, moving, residual
from identify.smoothing import part_rows, smoothing
from identify.study import Study
from twin.effect import Effect, Part
from twin.model import Coordinate, Fitted

Array = NDArray[np.float64]

STIFFNESS = 10.0 ** np.arange(1.0, -5.1, -0.5)  # noise over spread, per root of samples; tried
WORTH = 0.99  # part of the squared left-out error that a further part must leave at most
SWEEPS = 3  # over the parts
ROUNDING = 1e-12  # of a unit diagonal, keeps a system solvable
RIDGE = 1e-4  # on the physics, in units of their columns


@dataclass(frozen=True, eq=False)
class _Linear:
    """The residual about a base: force (n,) N, columns (n, k) of physics, then of the description.

    physics (k, k): the penalty that the base has already. parts: penalty (k, k) of each part at
    unit stiffness, and its columns.
    """

    where: Sequence[Coordinate]
    force: Array
    columns: Array
    physics: Array
    parts: Mapping[str, tuple[Array, NDArray[np.bool_]]]

    @classmethod
    def about(cls, base: Fit, study: Study, fitted: Fitted) -> _Linear:
        effect = fitted.effect
        own = [Coordinate(effect.name, p) for p in effect.strengths]
        where = [*base.scaling.where, *own]
        alone = replace(base.axis, effects=(fitted,))
        new = jacobian(alone, study.fit, own)[base.kept]
        norms = np.linalg.norm(base.jacobian, axis=0)
        rows = coloured_noise(base.residual) * smoothing(base.axis, where)
        physics = rows.T @ rows + np.diag([*(RIDGE * norms) ** 2, *np.zeros(len(own))])
        return cls(
            where, base.residual, np.hstack([base.jacobian, new]), physics,
            {part.name: _penalty(part, effect.name, where) for part in effect.parts},
        )  # fmt: skip

    def chosen(self, stiffness: Mapping[str, float]) -> tuple[NDArray[np.bool_], Array]:
        """Which columns take part, and the penalty (k, k), at the stiffness of some parts."""
        used = ~np.any([mask for _, mask in self.parts.values()], axis=0)
        penalty = self.physics.copy()
        for name, value in stiffness.items():
            rows, mask = self.parts[name]
            used = used | mask
            penalty += value**2 * rows
        return used, penalty

    @cached_property
    def blocks(self) -> list[tuple[slice, Array, Array]]:
        """Of each block its samples, columns' products (k, k) and products with the force (k,)."""
        edges = np.linspace(0, len(self.force), BLOCKS + 1).astype(int)
        spans = [slice(a, b) for a, b in pairwise(edges)]
        rows = [(self.columns[span], self.force[span]) for span in spans]
        return [(s, c.T @ c, c.T @ f) for s, (c, f) in zip(spans, rows, strict=True)]

    def left_out(self, stiffness: Mapping[str, float]) -> Array:
        """Residual (n,) N of every block when the others alone were fitted."""
        used, penalty = self.chosen(stiffness)
        gram = sum(g for _, g, _ in self.blocks) + penalty
        gradient = sum(g for _, _, g in self.blocks)
        out = self.force.copy()
        for span, own, pull in self.blocks:
            rest = (gram - own)[np.ix_(used, used)]
            out[span] -= self.columns[span][:, used] @ _solve(rest, (gradient - pull)[used])
        return out

    def solution(self, stiffness: Mapping[str, float]) -> tuple[Array, float]:
        """Change (k,) of all coordinates that fits best, and the degrees of freedom it takes."""
        used, penalty = self.chosen(stiffness)
        columns = self.columns[:, used]
        gram = columns.T @ columns
        full = gram + penalty[np.ix_(used, used)]
        out = np.zeros(len(self.where))
        out[used] = -_solve(full, columns.T @ self.force)
        return out, float(np.trace(_solve(full, gram)))


def _penalty(
    part: Part, effect: str, where: Sequence[Coordinate]
) -> tuple[Array, NDArray[np.bool_]]:
    rows = part_rows(part, effect, where)
    mask = np.array([c.effect == effect and c.parameter.name in part.strengths for c in where])
    return rows.T @ rows, mask


def _solve(matrix: Array, right: Array) -> Array:
    """Solution of a symmetric, positive system whose unknowns have units of their own."""
    size = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    scaled = matrix / np.outer(size, size) + ROUNDING * np.eye(len(size))
    return np.asarray((np.linalg.solve(scaled, (right.T / size).T).T / size).T)


def choose_stiffness(linear: _Linear) -> dict[str, float]:
    """Stiffness of each part that lowers the error on left-out blocks; a part may be missing."""
    tried = STIFFNESS * np.sqrt(len(linear.force))
    chosen: dict[str, float] = {}
    error = float(np.sum(linear.left_out(chosen) ** 2))
    for _ in range(SWEEPS):
        start = dict(chosen)
        for name in linear.parts:
            rest = {k: v for k, v in chosen.items() if k != name}
            found = {v: float(np.sum(linear.left_out({**rest, name: v}) ** 2)) for v in tried}
            best = min(found, key=lambda v: found[v])
            if name in chosen or found[best] < WORTH * error:
                chosen, error = {**rest, name: best}, found[best]
        if chosen == start:
            break
    return chosen


def describe(base: Fit, study: Study, effect: Effect) -> Candidate:
    """Fit a description beside the physics of a base, and judge it on the held-out logs.

    Without held-out logs it is judged on blocks left out of the fit. The curves reach as far as the
    fit logs went. Evidence counts the degrees of freedom that the smoothing leaves.
    """
    covered = effect.starts(excitation([log.motion for log in study.fit], None))
    empty = Fitted.at_start(effect, covered)
    linear = _Linear.about(base, study, empty)
    stiffness = choose_stiffness(linear)
    change, freedom = linear.solution(stiffness)
    first = _filled(empty, linear, stiffness, change)
    fit = fit_axis(base.axis.with_effect(first), study.fit)
    either = sticks(base.axis) or sticks(fit.axis)
    logs = study.holdout
    if logs:
        held = moving(logs, either)
        pair = [residual(f.axis, logs)[held] for f in (base, fit)]
    else:
        pair = [linear.left_out(s) for s in ({}, stiffness)]
    _, least = linear.solution({})
    gain = np.log(np.sum(base.residual**2) / np.sum(fit.residual**2))
    return Candidate(
        effect=effect,
        axis=study.axis,
        fit=fit,
        evidence=Evidence(
            float(gain), max(round(freedom - least), 1), effective_samples(fit.residual)
        ),
        gain=held_out_gain(pair[0], pair[1], fit.floor),
    )


def _filled(
    empty: Fitted, linear: _Linear, stiffness: Mapping[str, float], change: Array
) -> Fitted:
    """The description with its strengths and spreads; parts left out are zero and held."""
    effect = empty.effect
    step = dict(zip(((c.effect, c.parameter.name) for c in linear.where), change, strict=True))
    noise = coloured_noise(linear.force + linear.columns @ change)
    values, fixed = dict(empty.values), set(empty.fixed)
    for part in effect.parts:
        if part.name not in stiffness:
            fixed.update(part.strengths)
            continue
        values.update({n: float(step[effect.name, n]) for n in part.strengths})
        spread = effect.parameter(part.spread)
        wanted = noise / stiffness[part.name]
        values[part.spread] = float(min(max(wanted, spread.lower), spread.upper))
    return replace(empty, values=values, fixed=frozenset(fixed))
