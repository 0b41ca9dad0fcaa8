"""Numbers as they are printed: scaled units, significant digits, intervals."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from identify.output.words.numbers import RAISED, Numbers, distinct

PREFIXED = frozenset({"m", "m/s", "m/s^2", "N", "N m", "s", "A", "rad", "rad/s", "rad/s^2"})
PREFIXES = ((1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))
LEAST = 0.5  # in its unit, of the largest value printed in it
DIGITS = 3  # significant digits of a printed number
NOTHING = "–"  # printed where there is no value


def pretty(unit: str) -> str:
    """A unit with raised exponents and a product dot; a ratio has none."""
    raised = unit.replace("^2", "²").replace("^3", "³").replace(" ", "·")
    return "" if unit == "1" else raised


def inverse(printed: str) -> str:
    """One over a printed unit: "1/mN", "1/(mN·m)"."""
    return f"1/({printed})" if "·" in printed else f"1/{printed}"


@dataclass(frozen=True)
class Scale:
    """A unit to print in: SI values divided by ``size`` are in ``unit``."""

    size: float
    unit: str

    @classmethod
    def of(cls, unit: str, values: ArrayLike) -> Scale:
        """The unit in which the largest of these SI values is 0.5 or more, e.g. mN for 0.02 N."""
        finite = np.abs(np.asarray(values, dtype=float))
        largest = np.max(finite[np.isfinite(finite)], initial=0.0)
        fitting = (p for p in PREFIXES if unit in PREFIXED and largest >= LEAST * p[0])
        size, prefix = next(fitting, (1.0, ""))
        return cls(size, prefix + pretty(unit))

    def __call__(self, values: ArrayLike) -> NDArray[np.float64]:
        """SI values in this unit."""
        return np.asarray(values, dtype=float) / self.size

    def label(self, quantity: str) -> str:
        """An axis label, e.g. "Position (mm)"."""
        return f"{quantity} ({self.unit or '1'})"

    def text(self, value: float | None) -> str:
        """One value with its unit; a dash where there is none."""
        if value is None or math.isnan(value):
            return NOTHING
        return f"{number(value / self.size)} {self.unit}".rstrip()

    def within(self, low: float, high: float, *values: float) -> list[str]:
        """SI values without unit, to two digits of the half width of that interval."""
        half = (high - low) / self.size / 2.0
        if not (math.isfinite(half) and half > 0.0):
            return [number(v / self.size) for v in values]
        decimals = max(1 - math.floor(math.log10(half)), 0)
        # Adding zero turns a rounded minus zero into zero.
        rounded = (round(v / self.size, decimals) + 0.0 for v in values)
        return [with_minus(f"{v:.{decimals}f}") for v in rounded]


def quantity(value: float | None, unit: str) -> str:
    """One SI value in the unit that suits it, e.g. "27.0 mm"."""
    return Scale.of(unit, [0.0 if value is None else value]).text(value)


def span(low: float, high: float, unit: str) -> str:
    """Two SI values in the unit that suits them, e.g. "12.0 and 26.0 mm"."""
    scale = Scale.of(unit, [low, high])
    first, second = scale.within(low, high, low, high)
    return f"{first} and {second} {scale.unit}"


def number(value: float) -> str:
    """Three significant digits, all digits of larger integers, a true minus sign."""
    if not math.isfinite(value):
        return NOTHING if math.isnan(value) else "∞" if value > 0 else "−∞"
    if value == 0.0:
        return "0"
    magnitude = math.floor(math.log10(abs(value)))
    if -4 <= magnitude < 7:
        text = f"{value:.{max(DIGITS - 1 - magnitude, 0)}f}"
    else:
        digits, power = f"{value:.{DIGITS - 1}e}".split("e")
        text = f"{digits}×10{str(int(power)).translate(RAISED)}"
    return with_minus(text)


def with_minus(text: str) -> str:
    """A printed number with a true minus sign."""
    return text.replace("-", "−")


def percent(share: float, decimals: int) -> str:
    """A share in per cent with its sign, e.g. "+0.25 %"."""
    rounded = round(100.0 * share, decimals) + 0.0  # adding zero turns minus zero into zero
    return with_minus(f"{rounded:+.{decimals}f} %")


def title_case(name: str) -> str:
    """A name of the code as words: "distance_since_reversal" -> "Distance since reversal"."""
    words = spaced(name)
    return words[:1].upper() + words[1:]


def spaced(name: str) -> str:
    """A name of the code with spaces: "constant_force" -> "constant force"."""
    return name.replace("_", " ")


def change(before: float, after: float, unit: str) -> tuple[str, str]:
    """Two SI values in the unit that suits them, with digits that tell them apart."""
    scale = Scale.of(unit, [before, after])
    first, second = map(with_minus, distinct(before / scale.size, after / scale.size))
    return first, f"{second} {scale.unit}".rstrip()


SCALED = Numbers(quantity, span, number, change)  # how the sentences of the report write numbers
