"""What bends the curve of a law: a parameter that a model holds by design, such as an exponent.

Set free, it is one number more where a free curve has ten, so that a far smaller difference shows.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from identify.dataset.dataset import Dataset
from identify.estimation.fit import Fit
from identify.estimation.force_balance import steady_force
from identify.estimation.intervals import with_band
from identify.selection.found_shape import AHEAD, BEHIND, UNITS, Drawn, FoundShape
from twin.curve import Coordinate
from twin.effect import RUBBING
from twin.model.machine import AxisModel, Fitted
from twin.signals import Array


@dataclass(frozen=True)
class FreeExponent:
    """A parameter of a law, held by design, with which its curve comes nearest to the one found.

    held, found: in ``unit``.
    """

    parameter: str
    held: float
    found: float
    unit: str

    @property
    def differs(self) -> bool:
        """Whether the law found is another than the one that is held."""
        same = 0.1  # relative distance from its value by design at which a law is still itself
        return abs(self.found - self.held) > same * abs(self.held)


def held_exponents(law: Fitted) -> tuple[str, ...]:
    """Names of the parameters that would bend the curves of a fitted law, and are held."""
    names = dict.fromkeys(c.bent_by for c in law.effect.curves if c.bent_by)
    return tuple(name for name in names if name in law.fixed)


def exponent_curve(held: Fitted, final: Fit, dataset: Dataset) -> FoundShape:
    """The steady force of a law of a final fit with its 90 % band, and that of it as it was held.

    Of a friction with what modifies it. In the middle of the travel, positive or negative as the
    force of the law is.
    """
    covered = dataset.excitation
    speed = covered.speed_max * np.geomspace(0.01, 1.0, 24)  # that are drawn
    place = 0.5 * (covered.position_low + covered.position_high)
    kinds = {f.effect.name: f.effect.kind for f in final.axis.effects}
    rubbing = [name for name, kind in kinds.items() if kind in RUBBING]
    names = rubbing if held.effect.name in rubbing else [held.effect.name]
    among = [c for c in final.scaling.where if c.effect in names]

    def force(axis: AxisModel, velocity: Array) -> Array:
        acting = replace(axis, effects=tuple(f for f in axis.effects if f.effect.name in names))
        return np.array([steady_force(acting, place, float(v)) for v in velocity])

    curves = {}
    for name, way in ((AHEAD, 1), (BEHIND, -1)):
        at = partial(force, velocity=way * speed)
        found, band = with_band(final, at, among)
        curves[name] = Drawn(at(final.axis.with_effect(held)), found, band)
    units = final.axis.units
    return FoundShape(
        Coordinate.SPEED, speed, units(UNITS[Coordinate.SPEED]), None, False, units.force, curves
    )
