"""How the numbers inside a sentence are written."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass

RAISED = str.maketrans("+-0123456789", "⁺⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_POWER = re.compile(r"(?<=\d)e([+-])0*(\d+)")
_MINUS = re.compile(r"(?<![\w.)])-(?=\d)")


@dataclass(frozen=True)
class Numbers:
    """amount: value, unit -> text; span: low, high, unit -> "low and high unit"; ratio: value."""

    amount: Callable[[float, str], str]
    span: Callable[[float, float, str], str]
    ratio: Callable[[float], str]


def with_unit(number: str, unit: str) -> str:
    """A number with its unit; one of no dimension has none to be read as another number."""
    return number if unit == "1" else f"{number} {unit}"


def _amount(value: float, unit: str) -> str:
    return with_unit(f"{value:.3g}", unit)


def _span(low: float, high: float, unit: str) -> str:
    return with_unit(f"{low:.4g} and {high:.4g}", unit)


def _ratio(value: float) -> str:
    return f"{value:.1f}"


PLAIN = Numbers(_amount, _span, _ratio)  # SI units, for a terminal and for JSON


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
