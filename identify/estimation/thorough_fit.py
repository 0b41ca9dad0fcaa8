"""A thorough fit: the shapes of the effects that a model has are scanned again where error is left.

A fit from given values ends in the nearest optimum, such as a pitch of one roller fewer.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identify.dataset.dataset import Dataset
from identify.estimation.fit import Fit, finished, fit_axis
from identify.estimation.subspace import orthonormal, unabsorbed
from identify.estimation.variable_projection import Start, starts, with_what_repeats
from twin.effect import Excitation, Parameter
from twin.model.machine import AxisModel, Fitted

BETTER = 0.99  # part of the error that a new start must reach to be taken


def fit_thoroughly(axis: AxisModel, dataset: Dataset, begun: AxisModel | None = None) -> Fit:
    """Fit an axis; scan its effects' shapes again where the error is above the noise floor.

    begun: what the fit counts as begun with; the axis itself where None.
    """
    best = fit_axis(axis, dataset.fit)
    if begun is not None:
        best = replace(best, begun=begun)
    for name in axis.names:
        effect = axis[name].effect
        if best.at_floor or not any(p.scan for p in effect.parameters):
            continue
        rest = fit_without(best, dataset, name)
        found = starts(rest, dataset, effect)[0]
        known = with_what_repeats(rest, dataset)
        if not _promises(found, best, dataset) and _is_nearest(found.shape, best.axis[name], known):
            continue
        first = found.fitted
        held = {n: best.axis[name].values[n] for n in best.axis[name].fixed}
        again = replace(first, values={**first.values, **held}, fixed=best.axis[name].fixed)
        other = fit_axis(best.axis.with_effect(again), dataset.fit)
        if other.error < BETTER * best.error:
            best = replace(other, begun=best.begun)
    return best


def _promises(start: Start, fit: Fit, dataset: Dataset) -> bool:
    """Whether a start, after its linear step, leaves less than a fit on the same logs.

    A fit that ended early is worth another, whatever leads to it. On the heads, where a start was
    found on them, after a linear step too: a fit to all of the logs does not fit them as well.
    """
    there = fit.residual
    if len(start.left) != len(there):
        rows = dataset.in_heads[fit.kept]
        there = unabsorbed(fit.residual[rows], orthonormal(fit.jacobian[rows]))
    return bool(np.mean(start.left**2) < BETTER**2 * np.mean(there**2))


def _is_nearest(shape: dict[str, float], present: Fitted, excitation: Excitation) -> bool:
    """Whether the present values are nearer to this shape than to any other that is scanned."""

    def nearest(p: Parameter) -> float:
        value = present.values[p.name]
        return min(p.scan(excitation) if p.scan else (), key=lambda v: abs(v - value))

    return all(nearest(present.effect.parameter(n)) == v for n, v in shape.items())


def fit_without(fit: Fit, dataset: Dataset, name: str) -> Fit:
    """The fit with one effect removed and the values of the others unchanged."""
    return finished(fit.axis.without(name), fit.begun, dataset.fit, fit.outcome)
