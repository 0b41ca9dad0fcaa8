"""The curve of a friction law over speed, with what bends it as it was held and as it was found."""

from __future__ import annotations

import numpy as np

from identify.dataset.dataset import Dataset
from identify.estimation.curve_band import with_band
from identify.estimation.fit import Fit
from identify.estimation.prescribed_motion import steady_friction
from identify.selection.found_shape import AHEAD, BEHIND, UNITS, Drawn, FoundShape
from twin.curve import Coordinate
from twin.effect import Kind
from twin.model.machine import AxisModel, Fitted
from twin.signals import Array

SPEEDS = 24
SLOWEST = 0.01  # of the highest speed, the least that is drawn
RUBBING = (Kind.FRICTION, Kind.MODIFIER)


def bent_curve(held: Fitted, final: Fit, dataset: Dataset) -> FoundShape:
    """The steady friction of a final fit with its 90 % band, and that of the law as it was held.

    In the middle of the travel, positive or negative as the force of the law is.
    """
    covered = dataset.excitation
    speed = covered.speed_max * np.geomspace(SLOWEST, 1.0, SPEEDS)
    place = 0.5 * (covered.position_low + covered.position_high)
    before = final.axis.with_effect(held)
    curves = {
        name: _drawn(before, final, place, way * speed) for name, way in ((AHEAD, 1), (BEHIND, -1))
    }
    units = final.axis.units
    return FoundShape(
        Coordinate.SPEED, speed, units(UNITS[Coordinate.SPEED]), None, False, units.force, curves
    )


def _drawn(before: AxisModel, final: Fit, place: float, velocity: Array) -> Drawn:
    """Force (k,) N of two axes at velocities (k,) m/s, and half the band of the fitted one."""
    rubs = [f.effect.name for f in final.axis.effects if f.effect.kind in RUBBING]
    among = [c for c in final.scaling.where if c.effect in rubs]
    found, band = with_band(final, lambda axis: _force(axis, place, velocity), among)
    return Drawn(_force(before, place, velocity), found, band)


def _force(axis: AxisModel, place: float, velocity: Array) -> Array:
    """Force (k,) N that friction makes at velocities (k,) m/s after a long way."""
    level = [steady_friction(axis, place, float(v)) for v in velocity]
    return -np.sign(velocity) * np.array(level)
