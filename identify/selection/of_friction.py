"""Whether a friction that is early or late by itself explains what a late motor or reading does.

A friction with a memory, or one that a simulator makes soft, is not in step with the speed; where
most of the force is friction, that looks like a lag of all of it. What is late is late with all of
its force: with what moves the mass and holds the weight, too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identify.dataset.prepared_log import PreparedLog, sticks
from identify.estimation.evidence import effective_samples, rms
from identify.estimation.force_balance import averaged_force
from identify.estimation.least_squares import solve, unabsorbed
from identify.selection.acceptance import Judged, least_t, score
from identify.selection.controls import ControlTest, with_unit_penalty
from twin.effect import RUBBING, Effect
from twin.model.machine import AxisModel
from twin.signals import Array, rate

AS_MUCH = 0.95  # of the part of that law, as two rates are nearly the friction out of step
SHARED = 0.5  # of how late all of the force seems, that the force without friction is at least


def is_of_friction(less: Judged, final: Judged, effect: Effect) -> bool:
    """Whether the friction alone is late where a law has every force delayed.

    less, final: the fits without that law and with it. Either the friction out of step takes as
    much as the law, or all else is not late. What is out of step by little is by its rate and by
    the rate of that (Taylor); of the friction that the fit with the law has, as the other is not to
    be mistaken for its shape.
    """
    rubbing = _rubbing(final.fit.axis)
    if not effect.delays or not rubbing.effects:
        return False

    own_rates = [_rates(rubbing, log) for log in less.fit.logs]

    def columns(logs: Sequence[PreparedLog]) -> list[Array]:
        each = own_rates if logs is less.fit.logs else [_rates(rubbing, log) for log in logs]
        first = [rates[:, 0] for rates in each]
        second = (rate(one, _period(log)) for one, log in zip(first, logs, strict=True))
        return [np.column_stack(both) for both in zip(first, second, strict=True)]

    own = with_unit_penalty(columns, less.fit)
    alone = ControlTest.beside(less).part(own, sticking=sticks(less.fit.axis))
    return alone >= AS_MUCH * score(less, final).part or not _is_shared(
        less, np.concatenate(own_rates)
    )


def _is_shared(less: Judged, rates: Array) -> bool:
    """Whether the command without what overcomes friction is late as well, where all of it is.

    rates (n, 2): N/s, of both, of the training logs. How late each is by its rate, beside the free
    parameters of the fit: both by themselves, and all of the command together.
    """
    fit = less.fit
    pairs = rates[fit.kept]
    late = unabsorbed(np.column_stack([pairs, pairs.sum(axis=1)]), fit.basis)
    (_, rest), error = _lateness(late[:, :2], fit.unabsorbed)
    (every,), _ = _lateness(late[:, 2:], fit.unabsorbed)
    return bool(np.sign(every) * rest >= max(least_t(1) * error[1], SHARED * abs(every)))


def _lateness(rates: Array, left: Array) -> tuple[Array, Array]:
    """How late (k,), s, forces of rates (n, k) N/s are by what is left (n,) N; and its errors."""
    gram = rates.T @ rates
    values = solve(gram, (rates.T @ left)[:, None])[:, 0]
    noise = rms(left - rates @ values) * np.sqrt(len(left) / effective_samples(left))
    return values, noise * np.sqrt(np.diag(np.linalg.pinv(gram, hermitian=True)))


def _rates(rubbing: AxisModel, log: PreparedLog) -> Array:
    """Rates (n, 2), N/s, of the force that overcomes friction and of the rest of the command."""
    own, period = -averaged_force(rubbing, [log]), _period(log)
    return np.column_stack([rate(own, period), rate(log.command - own, period)])


def _period(log: PreparedLog) -> float:
    """From one test function of a log to the next, s."""
    return float(log.time[1] - log.time[0])


def _rubbing(axis: AxisModel) -> AxisModel:
    """The axis with its friction alone, and the free curves that may stand for it."""
    own = (
        f
        for f in axis.effects
        if f.effect.kind in RUBBING or (f.effect.is_nonparametric and f.effect.reads("V"))
    )
    return replace(axis, effects=tuple(own))
