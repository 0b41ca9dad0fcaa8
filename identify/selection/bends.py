"""What bends the curve of a law: a parameter that a model holds by design, such as an exponent.

Set free, it is one number more where a free curve has ten, so that a far smaller difference shows.
"""

from __future__ import annotations

from dataclasses import dataclass

from twin.model.machine import Fitted

SAME = 0.1  # relative distance from its value by design at which a law is still itself


@dataclass(frozen=True)
class Bend:
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
        return abs(self.found - self.held) > SAME * abs(self.held)


def held_bends(law: Fitted) -> tuple[str, ...]:
    """Names of the parameters that would bend the curves of a fitted law, and are held."""
    names = dict.fromkeys(c.bent_by for c in law.effect.curves if c.bent_by)
    return tuple(name for name in names if name in law.fixed)
