"""The self-test at full length: how often the diagnosis names planted effects."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from benchmarks.figures import Figure, Target
from identify.output.selftest import trial_in_words
from identify.selftest import (
    FULL,
    TrialResult,
    draw,
    draw_reliability,
    rates,
    release_seed,
    run_all,
)

TITLE = "Self-test: effects planted in machines drawn at random, logs of 12 s, one axis"
DOCS = Path(__file__).parent.parent / "docs"


def measure() -> list[Figure]:
    """Run the full design with the release's seed; draws the pictures that the README shows."""
    results = run_all(FULL.cases(release_seed()), progress=_tell)
    draw(results, DOCS / "selftest.png")
    draw_reliability(results, DOCS / "reliability.png")
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
