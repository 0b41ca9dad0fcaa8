"""How numbers, units and names are written: one way for the terminal, JSON sentences and pages.

A number is given in the unit in which it is readable (mN for 0.02 N) with three digits, and in
plain characters; ``typeset`` gives a page its minus signs, arrows and powers of ten.
"""

from __future__ import annotations

import base64
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

PREFIXED = frozenset({"m", "m/s", "m/s^2", "N", "N m", "s", "A", "rad", "rad/s", "rad/s^2", "N/s"})
PREFIXES = ((1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))
SHORTEST = 1e-3  # printed without a power of ten
DIGITS = 3  # significant digits of a printed number
NOTHING = "–"  # printed where there is no value
RAISED = str.maketrans("+-0123456789", "⁺⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_POWER = re.compile(r"(?<=\d)e([+-])0*(\d+)")
_MICROMETRES = re.compile(r" um\b")
_MINUS = re.compile(r"(?<![\w.)])-(?=\d|∞)")


@dataclass(frozen=True)
class DisplayUnit:
    """A unit to print in: SI values divided by ``size`` are in ``unit``."""

    size: float
    unit: str

    @classmethod
    def of(cls, unit: str, values: ArrayLike) -> DisplayUnit:
        """The unit in which the largest of these SI values is 0.5 or more, e.g. mN for 0.02 N."""
        finite = np.abs(np.asarray(values, dtype=float))
        largest = np.max(finite[np.isfinite(finite)], initial=0.0)
        least = 0.5  # in its unit, of the largest value printed in it
        fitting = (p for p in PREFIXES if unit in PREFIXED and largest >= least * p[0])
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
        largest = max(abs(v) / self.size for v in (low, high, *values))
        power = math.floor(math.log10(largest)) if largest < SHORTEST else 0
        decimals = max(1 - math.floor(math.log10(half)) + power, 0)
        shown = (v / self.size / 10.0**power for v in values)
        # Adding zero turns a rounded minus zero into zero.
        texts = (f"{round(v, decimals) + 0.0:.{decimals}f}" for v in shown)
        return [f"{text}e{power:03d}" if power else text for text in texts]


def by_how_much(gain: float, unit: str) -> str:
    """A difference, of which its sign is a word: "2 um larger"."""
    return f"{quantity(abs(gain), unit)} {'larger' if gain >= 0.0 else 'smaller'}"


def quantity(value: float | None, unit: str) -> str:
    """One SI value in the unit that suits it, e.g. "27.0 mm"."""
    return DisplayUnit.of(unit, [0.0 if value is None else value]).text(value)


def with_band(value: float, band: float, unit: str) -> str:
    """A SI value with half its 90 % band, in the unit that suits it, e.g. "15.00 ± 0.02 kg"."""
    scale = DisplayUnit.of(unit, [value, band])
    first, second = scale.within(value - band, value + band, value, band)
    return f"{first} ± {second} {scale.unit}".rstrip()


def span(low: float, high: float, unit: str) -> str:
    """Two SI values in the unit that suits them, e.g. "12.0 and 26.0 mm"."""
    scale = DisplayUnit.of(unit, [low, high])
    first, second = scale.within(low, high, low, high)
    return f"{first} and {second} {scale.unit}".rstrip()


def change(before: float, after: float, unit: str | DisplayUnit) -> tuple[str, str]:
    """Two SI values in one unit, with digits that tell them apart; the second has the unit."""
    scale = unit if isinstance(unit, DisplayUnit) else DisplayUnit.of(unit, [before, after])
    pair, digits = (before / scale.size, after / scale.size), DIGITS
    while number(pair[0], digits) == number(pair[1], digits) and before != after and digits < 15:
        digits += 1
    first, second = (number(value, digits) for value in pair)
    return first, f"{second} {scale.unit}".rstrip()


def each_with_unit(before: float, after: float, unit: str) -> tuple[str, str]:
    """The same where words come between them, so that each has the unit."""
    first, second = change(before, after, unit)
    return first + second[second.index(" ") :], second


def arrow(before: float, after: float, unit: str) -> str:
    """E.g. "73.6 -> 7.25 mN"."""
    return " -> ".join(change(before, after, unit))


def number(value: float, digits: int = DIGITS) -> str:
    """Significant digits, all digits of larger integers."""
    if not math.isfinite(value):
        return NOTHING if math.isnan(value) else "∞" if value > 0 else "-∞"
    if value == 0.0:
        return "0"
    magnitude = math.floor(math.log10(abs(value)))
    if abs(value) >= SHORTEST and magnitude < 7:
        return f"{value:.{max(digits - 1 - magnitude, 0)}f}"
    return f"{value:.{digits - 1}e}"


def percent(share: float) -> str:
    """A share in whole per cent."""
    return f"{100.0 * share:.0f} %"


def pretty(unit: str) -> str:
    """A unit with raised exponents and a product dot; a ratio has none."""
    raised = unit.replace("^2", "²").replace("^3", "³").replace(" ", "·")
    return "" if unit == "1" else raised


def inverse(printed: str) -> str:
    """One over a printed unit: "1/mN", "1/(mN·m)"."""
    return f"1/({printed})" if "·" in printed else f"1/{printed}"


def listed(names: Sequence[str]) -> str:
    """E.g. "a, b and c"."""
    *first, last = names
    return f"{', '.join(first)} and {last}" if first else last


def spaced(name: str) -> str:
    """A name of the code with spaces: "constant_force" -> "constant force"."""
    return name.replace("_", " ")


def title_case(name: str) -> str:
    """A name of the code as words: "distance_since_reversal" -> "Distance since reversal"."""
    words = spaced(name)
    return words[:1].upper() + words[1:]


def capitalised(sentence: str) -> str:
    """The sentence with a capital letter and a full stop, for a list or a paragraph.

    A name of the code, or a command, that begins it keeps its letters.
    """
    first = sentence.partition(" ")[0]
    named = first == "twin" or any(c.isdigit() or c == "_" for c in first)
    begin = sentence[:1] if named else sentence[:1].upper()
    return f"{begin}{sentence[1:]}{'' if sentence.endswith('.') else '.'}"


def packed(values: ArrayLike, kind: str = "<i2") -> str:
    """Numbers as a script of a page reads them: base64 of this type, integers of 16 bits."""
    return base64.b64encode(np.asarray(values).astype(kind).tobytes()).decode("ascii")


def typeset(text: str) -> str:
    """A text of the terminal as it is printed on a page: ±, µ, arrows, powers of ten, minus."""

    def power(found: re.Match[str]) -> str:
        return "×10" + f"{found[1].strip('+')}{found[2]}".translate(RAISED)

    plain = _POWER.sub(power, _MICROMETRES.sub(" µm", text.replace("+-", "±")))
    return _MINUS.sub("−", plain.replace(" -> ", " → "))
