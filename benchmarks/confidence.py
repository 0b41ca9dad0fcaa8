"""The table of confidence: python -m benchmarks.confidence --seed 1.

Prints the levels for identify/selection/confidence.py, fitted to machines of a development seed.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from identify.output.words.selftest import trial_in_words
from identify.selftest import TrialResult, levels, run_all
from identify.selftest.calibration import answers_of
from identify.selftest.design import DEVELOPMENT, FULL


def table(results: Sequence[TrialResult]) -> str:
    """The table, as Python text."""
    answers = answers_of(results)
    steps = "".join(f"Level({v.left:.2f}, {v.right:.2f}), " for v in levels(answers))
    return f"LEVELS = ({steps.rstrip()})  # {len(answers)} answers"


def main() -> None:
    """Run the development machines and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=DEVELOPMENT)
    seed = parser.parse_args().seed

    def tell(result: TrialResult, done: int, total: int) -> None:
        print(f"{done} of {total}: {trial_in_words(result)}", file=sys.stderr, flush=True)

    print(table(run_all(FULL.cases(seed), progress=tell)))


if __name__ == "__main__":
    main()
