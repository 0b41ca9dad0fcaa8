"""Whether a friction that is early or late by itself explains what a late motor or reading does.

A friction with a memory, or one that a simulator makes soft, is not in step with the speed; where
most of the force is friction, that looks like a lag of all of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identify.dataset.prepared_log import PreparedLog, sticks
from identify.estimation.force_balance import averaged_force
from identify.selection.acceptance import Judged, score
from identify.selection.candidates import NotItself
from identify.selection.controls import ControlTest, with_unit_penalty
from twin.effect import RUBBING, Effect
from twin.model.machine import AxisModel
from twin.signals import Array, rate

IS_FRICTION = NotItself("the friction alone, a moment earlier or later, explains as much")
AS_MUCH = 0.95  # of the part of that law, as two rates are nearly the friction out of step


def is_of_friction(less: Judged, final: Judged, effect: Effect) -> bool:
    """Whether a friction out of step takes as much as a law does; of one that delays every force.

    less, final: the fits without that law and with it. What is out of step by little is by its rate
    and by the rate of that (Taylor); of the friction that the fit with the law has, as the other is
    not to be mistaken for its shape. Where all of the force is late, that of friction takes less.
    """
    rubbing, axis = _rubbing(final.fit.axis), less.fit.axis
    if not effect.delays or not rubbing.effects:
        return False

    def columns(logs: Sequence[PreparedLog]) -> list[Array]:
        return [_rates(averaged_force(rubbing, [log]), log.time[1] - log.time[0]) for log in logs]

    own = with_unit_penalty(columns, less.fit)
    alone = ControlTest.beside(less).part(own, sticking=sticks(axis))
    return alone >= AS_MUCH * score(less, final).part


def _rates(force: Array, period: float) -> Array:
    """The first and the second rate (n, 2) of a force (n,) N, per s and per s^2."""
    first = rate(force, period)
    return np.column_stack([first, rate(first, period)])


def _rubbing(axis: AxisModel) -> AxisModel:
    """The axis with its friction alone, and the free curves that may stand for it."""
    own = (
        f
        for f in axis.effects
        if f.effect.kind in RUBBING or (f.effect.is_nonparametric and f.effect.reads("V"))
    )
    return replace(axis, effects=tuple(own))
