"""A first look in words."""

from __future__ import annotations

from collections.abc import Sequence

from identify.output.numbers import percent
from identify.selection.first_look import BEGINNING, Likely


def first_look_in_words(log: str, found: Sequence[Likely]) -> str:
    """What the beginning of a log makes most likely on each of its axes, in one line."""
    each = "; ".join(f"axis {one.axis} {_of_axis(one)}" for one in found)
    return f"the first {BEGINNING:.0f} s of {log}: {each}"


def _of_axis(found: Likely) -> str:
    if not found.effects:
        far = f"is at {found.ratio:.2g} times its noise floor"
        return far if found.ratio < 2.0 else f"{far}, which no effect alone explains"
    names = " or ".join(found.effects)
    return f"most likely lacks {names}, {percent(found.part)} of what is left in one linear step"
