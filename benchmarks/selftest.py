"""The self-test at full length: how often the diagnosis names planted effects."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from benchmarks.figures import Figure, Target
from identify.output.words.selftest import trial_in_words
from identify.selftest import FULL, TrialResult, draw, rates, run_all

SEED = 1
TITLE = "Self-test: effects planted in machines drawn at random, logs of 12 s, one axis"
PICTURE = Path(__file__).parent.parent / "docs" / "selftest.png"


def measure() -> list[Figure]:
    """Run the full design; draws the confusion matrix that the README shows."""
    results = run_all(FULL.cases(SEED), progress=_tell)
    draw(results, PICTURE)
    return figures(results)


def figures(results: Sequence[TrialResult]) -> list[Figure]:
    """The rates with their targets."""
    return [
        Figure(r.what, r.value, "1", Target(*r.asked) if r.asked else None,
               f"{r.count} of {r.trials}")
        for r in rates(results)
    ]  # fmt: skip


def _tell(result: TrialResult, done: int, total: int) -> None:
    print(f"  {done} of {total}: {trial_in_words(result)}", file=sys.stderr, flush=True)
