"""The table of confidence: python -m benchmarks confidence --seed N [--rows FILE...].

Answers of the self-test, and rows that `benchmarks foreign` and `benchmarks withheld` wrote with
-o, are halved machine by machine. The table is fitted on one half and judged on the other, and the
other way round; then the table of all of them is printed for identify/selection/confidence.py.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.judgement import WRONG
from benchmarks.selftest.design import DEVELOPMENT, FULL, run_all
from benchmarks.selftest.tally import answers_of
from benchmarks.selftest.trial import Answer, TrialResult
from benchmarks.selftest.words import tell
from identify.selection.confidence import Level
from identify.selection.findings import FindingKind

LEAST_ANSWERS = 30  # to a level: a rate of them is known to some 10 points
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


def levels(answers: Sequence[Answer]) -> tuple[Level, ...]:
    """How often answers were right by the part they took: a falling staircase of a few levels.

    Levels hold equally many answers, at least LEAST_ANSWERS; one that is not below the one before
    is joined with it (isotonic regression: pool adjacent violators, R. E. Barlow et al.,
    Statistical Inference under Order Restrictions, 1972). The rate of a level is (right + 1) /
    (answers + 2), Laplace's rule, so that none is certain. The last has no end.
    """
    ordered = sorted(answers, key=lambda a: -a.part)
    count = max(len(ordered) // LEAST_ANSWERS, 1)
    pooled: list[list[Answer]] = []
    for part in np.array_split(np.arange(len(ordered)), count):
        pooled.append([ordered[i] for i in part])
        while len(pooled) > 1 and _rate(pooled[-1]) >= _rate(pooled[-2]):
            last = pooled.pop()
            pooled[-1] += last
    ends = [group[-1].part for group in pooled[:-1]] + [0.0]
    return tuple(Level(end, _rate(part)) for end, part in zip(ends, pooled, strict=True))


def _rate(answers: Sequence[Answer]) -> float:
    return (sum(a.right for a in answers) + 1) / (len(answers) + 2)


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


def main(arguments: Sequence[str]) -> int:
    """Run the machines of a seed, read the rows, and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks confidence", description=__doc__)
    parser.add_argument("--seed", type=int, default=DEVELOPMENT)
    parser.add_argument("--rows", type=Path, nargs="*", default=[])
    given = parser.parse_args(arguments)
    machines = of_selftest(run_all(FULL.cases(given.seed), progress=tell))
    for path in given.rows:
        machines += of_rows(path.read_text().splitlines(), path.stem)
    print(report(machines))
    return 0
