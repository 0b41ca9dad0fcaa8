"""How the numbers inside a sentence are written."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

RAISED = str.maketrans("+-0123456789", "⁺⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_POWER = re.compile(r"(?<=\d)e([+-])0*(\d+)")
_MINUS = re.compile(r"(?<![\w.)])-(?=\d)")


@dataclass(frozen=True)
class Numbers:
    """How to write value and unit; low, high and unit; a ratio; values before and after, and unit.

    The last are two texts, of which the second has the unit.
    """

    amount: Callable[[float, str], str]
    span: Callable[[float, float, str], str]
    ratio: Callable[[float], str]
    change: Callable[[float, float, str], tuple[str, str]]


def listed(names: Sequence[str]) -> str:
    """E.g. "a, b and c"."""
    *first, last = names
    return f"{', '.join(first)} and {last}" if first else last


def with_unit(number: str, unit: str) -> str:
    """A number with its unit; one of no dimension has none to be read as another number."""
    return number if unit == "1" else f"{number} {unit}"


def _amount(value: float, unit: str) -> str:
    return with_unit(f"{value:.3g}", unit)


def _span(low: float, high: float, unit: str) -> str:
    return with_unit(f"{low:.4g} and {high:.4g}", unit)


def _ratio(value: float) -> str:
    return f"{value:.1f}"


def distinct(before: float, after: float) -> tuple[str, str]:
    """Two numbers with four digits, or with as many more as it takes to see that they differ."""
    pair = f"{before:.4g}", f"{after:.4g}"
    digits = 4
    while pair[0] == pair[1] and before != after and digits < 15:
        digits += 1
        pair = f"{before:#.{digits}g}", f"{after:#.{digits}g}"
    return pair


def _change(before: float, after: float, unit: str) -> tuple[str, str]:
    first, second = distinct(before, after)
    return first, with_unit(second, unit)


PLAIN = Numbers(_amount, _span, _ratio, _change)  # SI units, for a terminal and for JSON


def typeset(sentence: str) -> str:
    """A sentence of the terminal as it is printed on a page: ±, µ, powers of ten, minus signs."""

    def power(found: re.Match[str]) -> str:
        return "×10" + f"{found[1].strip('+')}{found[2]}".translate(RAISED)

    return _MINUS.sub("−", _POWER.sub(power, sentence.replace("+-", "±").replace(" um", " µm")))


def capitalised(sentence: str) -> str:
    """The sentence with a capital letter and a full stop, for a list or a paragraph.

    A name of the code that begins it keeps its letters.
    """
    named = any(c.isdigit() or c == "_" for c in sentence.partition(" ")[0])
    begin = sentence[:1] if named else sentence[:1].upper()
    return typeset(f"{begin}{sentence[1:]}{'' if sentence.endswith('.') else '.'}")
