"""Nonparametric effects: smooth curves fitted to a force that no physical effect explains.

A nonparametric effect (an Effect with ``parts``) is linear in its strengths. Beside the linearised
physics of a fitted base, each part gets the smoothing with the least cross-validated error, or is
left out. Then the whole model is refitted. The physical effects have a prior at their values in the
base, so that a force that both could explain stays with them. The nonparametric effect is kept if
evidence and selection logs support it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identify.dataset.coordinates import excitation
from identify.dataset.dataset import Dataset
from identify.estimation.fit import Fit, finished, fit_axis
from identify.estimation.free_curves import Shape
from identify.estimation.splines import Linearised, choose_stiffness
from identify.estimation.variable_projection import fit_without
from identify.rules import RULE
from identify.selection.acceptance import Judged, score
from identify.selection.candidates import Candidate, candidate_of
from identify.selection.controls import change_control
from twin.effect import Effect
from twin.model.machine import AxisModel, Fitted, MachineModel

Array = NDArray[np.float64]


def fit_nonparametric(base: Fit, dataset: Dataset, effect: Effect) -> Candidate:
    """Fit a nonparametric effect beside the physics of a base, and judge it on the selection logs.

    Without selection logs it is judged by cross-validation. The curves cover the motion of the fit
    logs only. The evidence counts the effective degrees of freedom.
    """
    covered = effect.starts(excitation([log.motion for log in dataset.training], None))
    empty = Fitted.at_start(effect, covered)
    best = _attempt(base, dataset, empty)
    for _ in range(3):  # of choosing the smoothing again, at most
        # The missing force had distorted the physics of the base, so choose again beside the refit.
        again = _attempt(fit_without(best.fit, dataset, effect.name), dataset, empty)
        if not again.fit.error < RULE.fallen * best.fit.error:
            break
        best = again
    before, after = Judged(base, dataset), Judged(best.fit, dataset)
    found = candidate_of(before, after, effect, ())
    beside = replace(score(before, after), control=change_control(before, after))
    evidence = replace(found.evidence, parameters=best.parameters)
    return replace(found, evidence=evidence, score=beside)


def fit_in_place(base: Fit, dataset: Dataset, shape: Shape) -> Fit:
    """Fit a free curve in the place of a law, or beside it, see ``Shape.beside``."""
    axis = base.axis if shape.beside else base.axis.without(shape.effect)
    best = _attempt(_as_it_is(base, axis, dataset), dataset, shape.empty).fit
    if not best.at_floor:
        # The law's own shape had distorted the other values, so choose again beside the refit.
        again = best.axis.without(shape.empty.effect.name)
        second = _attempt(_as_it_is(base, again, dataset), dataset, shape.empty).fit
        best = min(best, second, key=lambda fit: fit.error)
    # Of the base, as its law is not absent, though a curve is in its place.
    return replace(best, begun=base.begun)


def _as_it_is(base: Fit, axis: AxisModel, dataset: Dataset) -> Fit:
    return finished(axis, base.begun, dataset.training, base.outcome)


@dataclass(frozen=True, eq=False)
class _Curve:
    """A fit with curves, and how many parameters these are worth."""

    fit: Fit
    parameters: int


def _attempt(ground: Fit, dataset: Dataset, empty: Fitted) -> _Curve:
    """Choose the smoothing beside the physics of ``ground``, and refit."""
    linear = Linearised.about(ground, dataset, empty)
    stiffness = choose_stiffness(linear)
    change, freedom = linear.solution(stiffness)
    first = _filled(empty, linear, stiffness, change)
    fit = fit_axis(ground.axis.with_effect(first), dataset.training)
    return _Curve(fit, max(round(freedom - linear.solution({})[1]), 1))


def followed(fitted: Fitted) -> tuple[str, ...]:
    """The parts of a nonparametric effect that are not zero: what its force depends on."""
    parts = fitted.effect.parts
    return tuple(p.name for p in parts if any(fitted.values[n] for n in p.strengths))


def nonparametric_labels(axis: AxisModel) -> frozenset[str]:
    """Labels of the parameters of nonparametric effects, which have no meaning one by one."""
    return frozenset(
        f"{f.effect.name}.{p.name}"
        for f in axis.effects
        if f.effect.is_nonparametric
        for p in f.effect.parameters
    )


def physics_alone(model: MachineModel) -> MachineModel:
    """The model without its nonparametric effects, so that physics can explain their force.

    A free curve in the place of a law is that law's shape, and stays.
    """
    for name, axis in model.axes.items():
        kept = tuple(
            f for f in axis.effects if f.effect.free_shape or not f.effect.is_nonparametric
        )
        model = model.with_axis(name, replace(axis, effects=kept))
    return model


def _filled(
    empty: Fitted, linear: Linearised, stiffness: Mapping[str, float], change: Array
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
