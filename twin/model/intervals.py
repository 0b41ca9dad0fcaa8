"""The intervals that a fit found, kept with the model so that two of them can be compared."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

Interval = tuple[float, float]


@dataclass(frozen=True)
class AxisIntervals:
    """Low and high ends (90 %) by parameter label, in the parameters' units.

    above_floor: force error of the fit over its noise floor. Where it is more than noise the model
    is wrong, and a fit's file has no ends.
    """

    ends: Mapping[str, Interval]
    above_floor: float
