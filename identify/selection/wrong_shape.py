"""Wrong shape: a law that is there, in whose place a free curve does better.

A curve of hats over the coordinate that the law assumes is put beside the law: what it takes of the
squared test error in one linear step is what the law's own shape cannot. It is proved as an absent
effect is, against the same curve shifted in time. The number of hats is chosen on the fit logs, and
whether the curve lets go at standstill. Of a friction, test functions with standstill are left out:
there it may be anything.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identify.dataset.dataset import Dataset
from identify.dataset.prepared_log import PreparedLog, at_rest, last_direction, sticks
from identify.estimation.fit import Fit
from identify.selection.decoys import Proof, Trial
from twin.effect import Coordinate, Curve, Kind
from twin.model.machine import Fitted
from twin.signals import Array

HATS = (12, 40)  # along a curve
DECOYS = 20
RIDGE = 0.03  # of a hat's length, which keeps those that are seldom visited small


@dataclass(frozen=True)
class WrongShape:
    """An effect whose law has another shape than the machine's force, with the proof."""

    effect: str
    curve: Curve
    proof: Proof


def wrong_shape(fit: Fit, dataset: Dataset) -> WrongShape | None:
    """The effect whose free curve takes most of a fit's squared test error, if it is proved."""
    curved = [f for f in fit.axis.effects if f.effect.curve]
    trial = Trial.of(fit, dataset)
    tried = [_tried(trial, f, dataset.fit, sticks(fit.axis)) for f in curved]
    best = max(tried, key=lambda w: w.proof.gain, default=None)
    return best if best and best.proof.holds else None


def _tried(trial: Trial, fitted: Fitted, logs: Sequence[PreparedLog], sticking: bool) -> WrongShape:
    """The curve with as many hats, and at standstill, as blocks left out of the fit logs say."""
    curve = fitted.effect.curve
    assert curve is not None
    is_force = fitted.effect.kind is Kind.FORCE
    sticking = sticking or not is_force
    rests = (False, True) if is_force and curve.by_direction else (False,)
    among = replace(trial, held=None)

    def gain(hats: _Hats) -> float:
        return among.proof(hats.columns, sticking=sticking, ridge=RIDGE, decoys=0).gain

    best = max((_Hats.of(fitted, logs, n, at_rest=r) for n in HATS for r in rests), key=gain)
    found = trial.proof(best.columns, sticking=sticking, ridge=RIDGE, decoys=DECOYS)
    return WrongShape(fitted.effect.name, curve, found)


@dataclass(frozen=True, eq=False)
class _Hats:
    """Hats over a curve's coordinate. knots (k,): in its unit, or parts of its period.

    at_rest: whether a curve of each direction stays at standstill as it was before.
    """

    curve: Curve
    period: float | None
    knots: Array
    at_rest: bool

    @classmethod
    def of(
        cls, fitted: Fitted, logs: Sequence[PreparedLog], count: int, *, at_rest: bool = False
    ) -> _Hats:
        curve = fitted.effect.curve
        assert curve is not None
        if curve.period is not None:
            knots = np.linspace(0.0, 1.0, count + 1)
            return cls(curve, fitted.values[curve.period], knots, at_rest)
        where = np.concatenate([_coordinate(curve, log) for log in logs])
        # As many samples to a hat as to any other: a friction curve bends where speeds are low.
        knots = np.unique(np.quantile(where, np.linspace(0.0, 1.0, count)))
        return cls(curve, None, knots, at_rest)

    def columns(self, logs: Sequence[PreparedLog]) -> list[Array]:
        """Means of the hats by test functions, (m, k) for each log; k doubles by direction."""
        return [self._of(log) for log in logs]

    def _of(self, log: PreparedLog) -> Array:
        where = _coordinate(self.curve, log)
        if self.period is not None:
            where = np.mod(where / self.period, 1.0)
        hats = np.stack([np.interp(where, self.knots, unit) for unit in np.eye(len(self.knots))])
        if self.period is not None:  # the last is the first
            hats[0] += hats[-1]
            hats = hats[:-1]
        if self.curve.by_direction:
            direction = self._direction(log.motion.velocity)
            hats = np.concatenate([hats * (direction > 0.0), hats * (direction < 0.0)])
        return log.test_function.mean(hats).T

    def _direction(self, velocity: Array) -> Array:
        """Sign (n,) of the velocity; at standstill 0, or as it was before."""
        direction = last_direction(velocity)
        return direction if self.at_rest else np.where(at_rest(velocity), 0.0, direction)


def _coordinate(curve: Curve, log: PreparedLog) -> Array:
    if curve.over is Coordinate.SPEED:
        return np.abs(log.motion.velocity)
    return log.motion.position
