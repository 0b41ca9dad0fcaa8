"""What of a mechanism is asked of all joints at once, and which laws of one joint are that."""

from __future__ import annotations

from enum import Enum

from identify.dataset.body import LINK_MASS
from twin.effect import Effect, Kind
from twin.effects import Catalogue


class What(Enum):
    """What of a mechanism is asked of all joints at once, beside the bodies, in words."""

    BODY = LINK_MASS
    ROTOR = "rotor"
    GAIN = "motor constant"
    LOAD = "friction by load"
    CURVE = "torque by place"

    def covers(self, effect: Effect) -> bool:
        """Whether an effect of one joint is a law of that.

        A motor that saturates below most of its torque, or has a deadband, is nearly another
        constant.
        """
        if effect.is_nonparametric or effect.states:
            return False
        if self is What.ROTOR:
            return effect.added_mass is not None
        if self is What.GAIN:
            return effect.kind is Kind.ACTUATION and not any(map(effect.reads, ("X", "V", "TIME")))
        if self is What.LOAD:
            return effect.kind is Kind.MODIFIER and effect.reads("LOAD")
        return self is What.CURVE and effect.is_of_place and not effect.repeats

    def named(self, catalogue: Catalogue) -> str:
        """The law by which it is told first: that of joints, or that of the fewest parameters."""
        own = [e for e in catalogue.values() if self.covers(e)]
        first = sorted(own, key=lambda e: (not e.of_joints, len(e.parameters)))
        return first[0].name if first else self.value
