"""The table of confidence: python -m benchmarks.confidence --seed N [--rows FILE...].

Answers of the self-test, and rows that `benchmarks foreign` and `benchmarks withheld` wrote with
-o, are halved machine by machine. The table is fitted on one half and judged on the other, and the
other way round; then the table of all of them is printed for identify/selection/confidence.py.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.judgement import WRONG
from identify.output.selftest import trial_in_words
from identify.selection.confidence import Level
from identify.selection.findings import FindingKind
from identify.selftest import TrialResult, levels, run_all
from identify.selftest.calibration import answers_of
from identify.selftest.design import DEVELOPMENT, FULL
from identify.selftest.trial import Answer

SPLIT = 1  # seed of the halves


@dataclass(frozen=True)
class Machine:
    """The answers on one machine, and who made it."""

    source: str
    answers: tuple[Answer, ...]


def of_selftest(results: Sequence[TrialResult]) -> list[Machine]:
    """Machines of the self-test; less those whose effect was taken out of the catalogue."""
    return [Machine("self-test", tuple(answers_of([r]))) for r in results]


def of_rows(lines: Iterable[str], source: str) -> list[Machine]:
    """Machines of another judge; what they are known to have besides counts as right."""
    out = []
    for row in map(json.loads, lines):
        answers = tuple(
            Answer((f["effect"], *f["tied"]), FindingKind(f["kind"]), f["mark"] != WRONG, f["part"])
            for f in row["findings"]
        )
        out.append(Machine(source, answers))
    return out


def judged(fitted: Sequence[Machine], others: Sequence[Machine]) -> list[str]:
    """By source and level of a table, stated confidence and how often others were right."""
    table, lines = levels([a for m in fitted for a in m.answers]), []
    for source in dict.fromkeys(m.source for m in others):
        answers = [a for m in others if m.source == source for a in m.answers]
        top = np.inf
        for level in table:
            inside = [a.right for a in answers if level.part <= a.part < top]
            top = level.part
            if inside:
                lines.append(
                    f"{source}: part from {level.part:.2f}, stated {level.right:.2f}, right "
                    f"{sum(inside)} of {len(inside)}"
                )
    return lines


def table_of(machines: Sequence[Machine]) -> str:
    """The table of all machines, as Python text."""
    answers = [a for m in machines for a in m.answers]
    found: Sequence[Level] = levels(answers)
    steps = ", ".join(f"Level({v.part:.2f}, {v.right:.2f})" for v in found)
    return f"LEVELS = ({steps})  # {len(answers)} answers"


def report(machines: Sequence[Machine]) -> str:
    """Both halves, each judged with the table of the other, and the table of all."""
    order = np.random.default_rng(SPLIT).permutation(len(machines))
    halves = [[machines[i] for i in part] for part in np.array_split(order, 2)]
    first, second = halves
    return "\n".join((*judged(first, second), *judged(second, first), table_of(machines)))


def main() -> None:
    """Run the machines of a seed, read the rows, and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=DEVELOPMENT)
    parser.add_argument("--rows", type=Path, nargs="*", default=[])
    given = parser.parse_args()

    def tell(result: TrialResult, done: int, total: int) -> None:
        print(f"{done} of {total}: {trial_in_words(result)}", file=sys.stderr, flush=True)

    machines = of_selftest(run_all(FULL.cases(given.seed), progress=tell))
    for path in given.rows:
        machines += of_rows(path.read_text().splitlines(), path.stem)
    print(report(machines))


if __name__ == "__main__":
    main()
