"""How far a piece of work is, told by whoever does it to whoever shows it."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[str, int, int], None]  # what is being done, how much of it, of how much


def silent(what: str, done: int, total: int) -> None:
    """Progress that is not shown."""


def within(progress: Progress, where: str) -> Progress:
    """The progress of a part of some work; where: which part."""
    return lambda what, done, total: progress(f"{where}, {what}", done, total)
