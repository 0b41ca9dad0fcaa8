"""The self-test at full length: how often the diagnosis names what is planted."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from benchmarks.figures import Figure, Target
from identify.selftest import FULL, Outcome, draw, rates, run_all

SEED = 1
TITLE = "Self-test: effects planted in machines drawn at random, logs of 12 s, one axis"
PICTURE = Path(__file__).parent.parent / "docs" / "selftest.png"


def measure() -> list[Figure]:
    """Run the full design; draws the confusion matrix that the README shows."""
    outcomes = run_all(FULL.cases(SEED), progress=_tell)
    draw(outcomes, PICTURE)
    return figures(outcomes)


def figures(outcomes: Sequence[Outcome]) -> list[Figure]:
    """The rates with their targets."""
    return [
        Figure(r.what, r.value, "1", Target(*r.asked) if r.asked else None,
               f"{r.count} of {r.trials}")
        for r in rates(outcomes)
    ]  # fmt: skip


def _tell(outcome: Outcome, done: int, total: int) -> None:
    print(f"  {done} of {total}: {outcome.in_words()}", file=sys.stderr, flush=True)
