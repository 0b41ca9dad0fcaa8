"""Wrong shape: a law that is there, in whose place a free curve does better.

A curve of hats over the coordinate that the law assumes is put beside the law: what it takes of the
squared test error in one linear step is what the law's own shape cannot. It is proved as an absent
effect is, against the same curve shifted in time. The number of hats is chosen on the fit logs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identify.dataset.dataset import Dataset
from identify.dataset.prepared_log import PreparedLog, sticks
from identify.estimation.fit import Fit
from identify.selection.decoys import Proof, beside_decoys
from twin.effect import Coordinate, Curve
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
    tried = [_tried(fit, f, dataset) for f in fit.axis.effects if f.effect.curve]
    best = max(tried, key=lambda w: w.proof.gain, default=None)
    return best if best and best.proof.holds else None


def _tried(fit: Fit, fitted: Fitted, dataset: Dataset) -> WrongShape:
    """The curve with as many hats as the fit logs, by blocks left out, say are best."""
    assert fitted.effect.curve is not None
    among = replace(dataset, holdout=())
    sticking = sticks(fit.axis)

    def gain(hats: int) -> float:
        columns = _Hats.of(fitted, dataset.fit, hats).columns
        return beside_decoys(fit, columns, among, sticking=sticking, ridge=RIDGE, decoys=0).gain

    best = _Hats.of(fitted, dataset.fit, max(HATS, key=gain)).columns
    found = beside_decoys(fit, best, dataset, sticking=sticking, ridge=RIDGE, decoys=DECOYS)
    return WrongShape(fitted.effect.name, fitted.effect.curve, found)


@dataclass(frozen=True, eq=False)
class _Hats:
    """Hats over a curve's coordinate. knots (k,): in its unit, or parts of its period."""

    curve: Curve
    period: float | None
    knots: Array

    @classmethod
    def of(cls, fitted: Fitted, logs: Sequence[PreparedLog], count: int) -> _Hats:
        curve = fitted.effect.curve
        assert curve is not None
        if curve.period is not None:
            return cls(curve, fitted.values[curve.period], np.linspace(0.0, 1.0, count + 1))
        where = np.concatenate([_coordinate(curve, log) for log in logs])
        # As many samples to a hat as to any other: a friction curve bends where speeds are low.
        return cls(curve, None, np.unique(np.quantile(where, np.linspace(0.0, 1.0, count))))

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
            velocity = log.motion.velocity
            hats = np.concatenate([hats * (velocity > 0.0), hats * (velocity < 0.0)])
        return log.test_function.mean(hats).T


def _coordinate(curve: Curve, log: PreparedLog) -> Array:
    if curve.over is Coordinate.SPEED:
        return np.abs(log.motion.velocity)
    return log.motion.position
