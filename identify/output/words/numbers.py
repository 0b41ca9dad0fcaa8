"""How the numbers inside a sentence are written."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Numbers:
    """amount: value, unit -> text; span: low, high, unit -> "low and high unit"; ratio: value."""

    amount: Callable[[float, str], str]
    span: Callable[[float, float, str], str]
    ratio: Callable[[float], str]


def _amount(value: float, unit: str) -> str:
    return f"{value:.3g} {unit}"


def _span(low: float, high: float, unit: str) -> str:
    return f"{low:.4g} and {high:.4g} {unit}"


def _ratio(value: float) -> str:
    return f"{value:.1f}"


PLAIN = Numbers(_amount, _span, _ratio)  # SI units, for a terminal and for JSON


def capitalised(sentence: str) -> str:
    """The sentence with a capital letter and a full stop, for a list or a paragraph."""
    return f"{sentence[:1].upper()}{sentence[1:]}{'' if sentence.endswith('.') else '.'}"
