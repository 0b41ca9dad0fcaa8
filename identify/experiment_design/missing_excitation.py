"""Which motion the logs lack: the motion where explanations differ and few data are."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from identify.dataset.coordinates import since_reversal
from identify.dataset.motion import Motion
from identify.dataset.prepared_log import PreparedLog, at_rest
from twin.model.units import LINEAR
from twin.signals import Array

HEART = (0.25, 0.75)  # quantiles of the squared difference that bound the range of a feature
SELDOM = 0.01  # share of the data below which all motions count as equally rare
DUST = 1e-5  # of the axis' own motion, below which the other axis is at rest
RARE = 0.05  # share of the data below which a motion counts as missing


@dataclass(frozen=True)
class Feature:
    """A property of motion: its name, its unit, and its values (n_test_functions,) on a log.

    unit: on a linear axis. own: of the other axis: the same property of this axis, beside which
    little of it is rest.
    """

    name: str
    unit: str
    of: Callable[[PreparedLog], Array]
    own: Callable[[PreparedLog], Array] | None = None

    @property
    def other(self) -> bool:
        """Whether it is a property of the other axis."""
        return self.own is not None

    def at_rest(self, log: PreparedLog, high: float) -> bool:
        """Whether values up to ``high`` are what a closed loop makes of an axis at rest."""
        return self.own is not None and high < DUST * float(np.max(self.own(log), initial=0.0))

    def on(self, motion: Motion) -> tuple[str, str]:
        """Its name and its unit on that motion."""
        units = motion.other_units if self.other else motion.units
        return units.words(self.name), units(self.unit)


@dataclass(frozen=True)
class Gap:
    """A range of motion where the explanations differ, and how much of the data is in it.

    low, high: range of the feature in its unit. share: part of the data inside it, 0..1; None where
    there are no data.
    """

    feature: str
    unit: str
    low: float
    high: float
    share: float | None

    @property
    def missing(self) -> bool:
        """Whether the data have hardly any of this motion."""
        return self.share is not None and self.share < RARE


def _speed(log: PreparedLog) -> Array:
    return np.abs(log.test_function.mean(log.motion.velocity))


def _acceleration(log: PreparedLog) -> Array:
    return np.abs(log.acceleration)


def _rest(log: PreparedLog) -> Array:
    """Rest (s) before the last start of motion, rounded to 0.1 s because settling is gradual."""
    m = log.motion
    still = at_rest(m.velocity)
    index = np.arange(len(still))
    begun = np.maximum.accumulate(np.where(still, 0, index + 1))
    stood = np.where(still, index + 1 - begun, 0.0)
    ended = np.maximum.accumulate(np.where(still, index, 0))
    return np.round(log.test_function.mean(stood[ended] * m.period), 1)


FEATURES = (
    Feature("speed", LINEAR.velocity, _speed),
    Feature("acceleration", LINEAR.acceleration, _acceleration),
    Feature("motor force", LINEAR.force, lambda w: np.abs(w.command)),
    Feature(
        "rate of change of the motor force", "N/s",
        lambda w: np.abs(w.test_function.acceleration(w.motion.command)),
    ),
    Feature(
        "distance since the last reversal", LINEAR.position,
        lambda w: w.test_function.mean(since_reversal(w.motion.velocity, w.motion.period)),
    ),
    Feature("rest before the motion", "s", _rest),
    Feature(
        "speed of the other axis", LINEAR.velocity,
        lambda w: np.abs(w.test_function.mean(w.motion.others[1])), own=_speed,
    ),
    Feature(
        "acceleration of the other axis", LINEAR.acceleration,
        lambda w: np.abs(w.test_function.mean(w.motion.others[2])), own=_acceleration,
    ),
)  # fmt: skip


def gap(
    motion: PreparedLog,
    where: Array,
    logs: Sequence[PreparedLog],
    features: Sequence[Feature] = FEATURES,
) -> Gap:
    """The property of motion for which the logs have least data where the explanations differ.

    where: squared difference (n_test_functions,) on the planned motion. Among properties with
    equally few data, the one whose range singles out the difference best.
    """
    found = []
    for feature in features:
        values = feature.of(motion)
        low, high = _weighted_quantiles(values, where)
        if not high > 0.0 or feature.at_rest(motion, high):
            continue
        share = None
        if logs:
            share = _inside(np.concatenate([feature.of(log) for log in logs]), low, high)
        missed = 1.0 if share is None else share + SELDOM
        merit = missed * _inside(values, low, high)
        found.append((merit, Gap(*feature.on(motion.motion), low, high, share)))
    return min(found, key=lambda pair: pair[0])[1]


def _weighted_quantiles(values: Array, weights: Array) -> tuple[float, float]:
    order = np.argsort(values)
    total = np.cumsum(weights[order])
    if not total[-1] > 0.0:
        return float(values.min()), float(values.max())
    low, high = np.searchsorted(total, np.array(HEART) * total[-1])
    return float(values[order[low]]), float(values[order[min(high, len(order) - 1)]])


def _inside(values: Array, low: float, high: float) -> float:
    return float(np.mean((values >= low) & (values <= high)))
