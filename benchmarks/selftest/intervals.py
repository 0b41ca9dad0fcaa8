"""Coverage of the 90 % intervals: python -m benchmarks intervals --seed 6303.

Machines of the self-test are made and their models fitted, with nothing missing, beside a missing
effect of 2 floors and beside one of 5; none is diagnosed, so that each takes some seconds. Of the
intervals that are given, and of those that would be were none refused, it counts those that hold
the truth.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import replace

from benchmarks.selftest.design import Design
from benchmarks.selftest.tally import coverage
from benchmarks.selftest.trial import TrialResult, fitted
from benchmarks.selftest.words import rate_in_words

SEED = 6303  # judges; the intervals were made with others


def table(results: Sequence[TrialResult]) -> str:
    """One line for each strength of what is missing."""
    lines = []
    for strength in sorted({r.case.strength for r in results}):
        own = [r for r in results if r.case.strength == strength and r.shown]
        every = [replace(r, held=tuple(replace(h, given=True) for h in r.held)) for r in own]
        missing = f"beside an effect of {strength:g} floors" if strength else "nothing missing"
        lines += [
            rate_in_words(coverage(own, f"{missing}, {len(own)} machines, given")),
            rate_in_words(coverage(every, f"{missing}, all")),
        ]
    return "\n".join(lines)


def main(arguments: Sequence[str]) -> int:
    """Make the machines, fit their models and print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks intervals", description=__doc__)
    parser.add_argument("--seed", type=int, default=SEED)
    for name, count in (("empty", 36), ("weak", 56), ("strong", 90)):
        parser.add_argument(f"--{name}", type=int, default=count, help="machines")
    asked = parser.parse_args(arguments)
    design = Design(empty=asked.empty, weak=asked.weak, strong=asked.strong, outside=0)
    results = []
    for case in design.cases(asked.seed):
        results.append(fitted(case))
        print(f"{len(results)}: {case}", file=sys.stderr, flush=True)
    print(table(results))
    return 0
