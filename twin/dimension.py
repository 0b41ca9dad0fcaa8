"""How large a quantity is on a machine: its unit, and the force, length and time of the motion.

A machine of another size, or a log in other units of force and length, then needs no other numbers.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache

# Exponents of newton, metre and second.
_UNITS = {"N": (1, 0, 0), "m": (0, 1, 0), "s": (0, 0, 1), "Hz": (0, 0, -1), "kg": (1, -1, 2),
          "J": (1, 1, 0)}  # fmt: skip
_FACTOR = re.compile(r"(?P<symbol>[^\s^()]+)(\^(?P<power>\d+))?")


@cache
def dimension(unit: str) -> tuple[int, int, int]:
    """Exponents of newton, metre and second in a unit such as "N s/m"; unknown ones count as 1."""
    total = [0, 0, 0]
    over, *under = unit.split("/")
    for sign, product in ((1, over), *((-1, part) for part in under)):
        for factor in _FACTOR.finditer(product):
            own = _UNITS.get(factor["symbol"], (0, 0, 0))
            for i, exponent in enumerate(own):
                total[i] += sign * exponent * int(factor["power"] or 1)
    return total[0], total[1], total[2]


def has_size(unit: str) -> bool:
    """Whether a quantity depends on the size of a machine: on its forces or its lengths."""
    force, length, _ = dimension(unit)
    return bool(force or length)


@dataclass(frozen=True)
class Scale:
    """The size of a machine in motion: largest force (N), travel (m), travel over top speed (s)."""

    force: float
    length: float
    time: float

    def size(self, unit: str) -> float:
        """What such a quantity amounts to on this machine, in its unit, where ``has_size``.

        A force is the largest one, a speed the highest, a stiffness that force over the travel.
        """
        force, length, time = dimension(unit)
        return float(self.force**force * self.length**length * self.time**time)
