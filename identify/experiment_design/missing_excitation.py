"""Which motion the logs lack: the motion where explanations differ and few data are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from identify.dataset.coordinates import since_reversal
from identify.dataset.motion import Motion
from identify.dataset.prepared_log import PreparedLog, stands
from twin.model.units import LINEAR
from twin.signals import Array

OTHER = " of the other axis"


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
        rare = 0.05  # share of the data below which a motion counts as missing
        return self.share is not None and self.share < rare


UNITS = {  # of a linear axis, of the properties of a motion that tell explanations apart
    "speed": LINEAR.velocity,
    "acceleration": LINEAR.acceleration,
    "motor force": LINEAR.force,
    "rate of change of the motor force": "N/s",
    "distance since the last reversal": LINEAR.position,
    "rest before the motion": "s",
    "speed of the other axis": LINEAR.velocity,
    "acceleration of the other axis": LINEAR.acceleration,
}


def properties(log: PreparedLog) -> dict[str, Array]:
    """Properties (n,) of the motion of a log, by test functions, by name."""
    motion, mean = log.motion, log.test_function.mean
    found = (
        np.abs(mean(motion.velocity)),
        np.abs(log.acceleration),
        np.abs(log.fine.mean(motion.raw[1])),
        np.abs(log.test_function.acceleration(motion.command)),
        mean(since_reversal(motion.velocity, motion.period)),
        np.round(mean(_rest(motion)), 1),  # as settling is gradual
        np.abs(mean(motion.others[1])),
        np.abs(mean(motion.others[2])),
    )
    return dict(zip(UNITS, found, strict=True))


def _rest(motion: Motion) -> Array:
    """Rest (n,) s before the last start of motion; while it lasts, how long so far."""
    still = stands(motion)
    index = np.arange(len(still))
    begun = np.maximum.accumulate(np.where(still, 0, index + 1))
    stood = np.where(still, index + 1 - begun, 0.0)
    ended = np.maximum.accumulate(np.where(still, index, 0))
    return np.asarray(stood[ended] * motion.period)


def gap(planned: PreparedLog, where: Array, logs: Sequence[PreparedLog]) -> Gap:
    """The property of motion for which the logs have least data where the explanations differ.

    where: squared difference (n_test_functions,) on the planned motion.
    """
    found, known = properties(planned), [properties(log) for log in logs]
    data = {name: np.concatenate([one[name] for one in known]) for name in found} if logs else {}
    name, low, high, share = most_missed(found, where, data)
    motion = planned.motion
    units = motion.other_units if name.endswith(OTHER) else motion.units
    return Gap(units.words(name), units(UNITS[name]), low, high, share)


def most_missed(
    planned: Mapping[str, Array], where: Array, data: Mapping[str, Array]
) -> tuple[str, float, float, float | None]:
    """The property by name that data lack most where a difference is, its range, and their share.

    planned, data: by name (n,) and (m,); no data where there are none. where (n,): the squared
    difference. Among properties with equally few data, the one whose range singles it out best.
    """
    found = []
    for name, values in planned.items():
        low, high = _weighted_quantiles(values, where)
        # Of another axis, values up to what a closed loop makes of one at rest are none.
        own = planned[name.removesuffix(OTHER)].max() if name.endswith(OTHER) else 0.0
        dust = 1e-5  # of the axis' own motion, below which the other axis is at rest
        if not high > 0.0 or high < dust * own:
            continue
        share = _inside(data[name], low, high) if data else None
        seldom = 0.01  # share of the data below which all motions count as equally rare
        missed = 1.0 if share is None else share + seldom
        found.append((missed * _inside(values, low, high), (name, low, high, share)))
    return min(found, key=lambda pair: pair[0])[1]


def _weighted_quantiles(values: Array, weights: Array) -> tuple[float, float]:
    order = np.argsort(values)
    total = np.cumsum(weights[order])
    if not total[-1] > 0.0:
        return float(values.min()), float(values.max())
    heart = (0.25, 0.75)  # quantiles of the squared difference that bound the range of a feature
    low, high = np.searchsorted(total, np.array(heart) * total[-1])
    return float(values[order[low]]), float(values[order[min(high, len(order) - 1)]])


def _inside(values: Array, low: float, high: float) -> float:
    return float(np.mean((values >= low) & (values <= high)))
