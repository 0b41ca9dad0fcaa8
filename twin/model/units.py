"""Units: those of a linear axis and their rotary counterparts, and how large a quantity is.

Laws, parameters and hardware are declared for a linear axis. On a rotary axis a length is an angle,
a force a torque and a mass a moment of inertia: m -> rad, N -> N m, kg -> kg m^2. A machine of
another size, or a log in other units of force and length, needs no other numbers: sizes come from
the force, length and time of its motion (``Scale``).
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache

_COUNTERPARTS = {"m": "rad", "N": "N m", "kg": "kg m^2"}
_WORDS = {"force": "torque", "forces": "torques", "position": "angle", "positions": "angles"}
_QUANTITY = re.compile(rf"\b({'|'.join(_WORDS)})\b", re.IGNORECASE)
_FACTOR = re.compile(r"(?P<symbol>[^\s^()]+)(\^(?P<power>\d+))?")


@cache
def rotary_unit(linear: str) -> str:
    """The unit on a rotary axis of what has this SI unit on a linear one: "N s/m" -> "N m s/rad".

    What has no length, force or mass in it stays as it is.
    """
    over, *under = linear.split("/")
    parts = [_product(over), *(_product(part.strip("()")) for part in under)]
    return "/".join(
        f"({part})" if i and " " in part else part for i, part in enumerate(parts) if part
    )


@cache
def rotary_words(linear: str) -> str:
    """The same words on a rotary axis: "Force error" -> "Torque error", "position" -> "angle".

    For labels and sentences; a name of an effect or of a file is no words, and stays as it is.
    """
    return _QUANTITY.sub(lambda m: _WORDS.get(m[0]) or _WORDS[m[0].lower()].capitalize(), linear)


def _product(text: str) -> str:
    """A product of units, factor by factor."""
    return " ".join(_factor(m["symbol"], m["power"]) for m in _FACTOR.finditer(text))


def _factor(symbol: str, power: str | None) -> str:
    other = _COUNTERPARTS.get(symbol, symbol)
    if power is None:
        return other
    return f"{other}^{power}" if " " not in other else f"({other})^{power}"


@dataclass(frozen=True)
class AxisUnits:
    """What the quantities of one axis are given in; call it with any other linear unit.

    mass: unit of what a force moves; mass_name: its name in files and tables.
    """

    rotary: bool
    position: str
    velocity: str
    acceleration: str
    force: str
    mass: str
    mass_name: str

    def __call__(self, linear: str) -> str:
        """The unit on this axis of what has the SI unit ``linear`` on a linear axis."""
        return rotary_unit(linear) if self.rotary else linear

    def words(self, linear: str) -> str:
        """What words that are for a linear axis, such as "Force error", are on this one."""
        return rotary_words(linear) if self.rotary else linear

    @property
    def kind(self) -> str:
        """What such an axis is called."""
        return "rotary" if self.rotary else "linear"


LINEAR = AxisUnits(False, "m", "m/s", "m/s^2", "N", "kg", "mass")
ROTARY = AxisUnits(True, "rad", "rad/s", "rad/s^2", "N m", "kg m^2", "inertia")


def units_of(unit: str | None) -> AxisUnits:
    """The units of an axis whose position, velocity, acceleration or force is in this unit.

    Linear where it is not known.
    """
    turning = (ROTARY.position, ROTARY.velocity, ROTARY.acceleration, ROTARY.force)
    return ROTARY if unit in turning else LINEAR


# Exponents of newton, metre and second.
_EXPONENTS = {"N": (1, 0, 0), "m": (0, 1, 0), "s": (0, 0, 1), "Hz": (0, 0, -1), "kg": (1, -1, 2),
          "J": (1, 1, 0)}  # fmt: skip


@cache
def dimension(unit: str) -> tuple[int, int, int]:
    """Exponents of newton, metre and second in a unit such as "N s/m"; unknown ones count as 1."""
    total = [0, 0, 0]
    over, *under = unit.split("/")
    for sign, product in ((1, over), *((-1, part) for part in under)):
        for factor in _FACTOR.finditer(product):
            for i, exponent in enumerate(_EXPONENTS.get(factor["symbol"], ())):
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
