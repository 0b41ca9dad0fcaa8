"""The tables of confidence: python -m benchmarks confidence --seed N [--rows FILE...].

Answers of the self-test, and rows that `benchmarks foreign` and `benchmarks withheld` wrote with
-o, are halved machine by machine. The tables are fitted on one half and judged on the other, and
the other way round; then those of all of them are printed for identify/selection/findings.py.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.judgement import WRONG
from benchmarks.selftest.design import DEVELOPMENT, FULL, run_all
from benchmarks.selftest.tally import answers_of
from benchmarks.selftest.trial import Answer, TrialResult
from benchmarks.selftest.words import tell
from identify.selection.findings import ConfidenceBin, FindingKind, read

LEAST_ANSWERS = 100  # to a level: a rate of them is known to some 5 points
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
            Answer(
                (f["effect"], *f["tied"]),
                FindingKind(f["kind"]),
                f["mark"] != WRONG,
                f["part"],
                t=f["t"],
            )
            for f in row["findings"]
        )
        out.append(Machine(source, answers))
    return out


Figure = Callable[[Answer], float]
FIGURES: dict[str, Figure] = {"BY_PART": lambda a: a.part, "BY_T": lambda a: a.t}


def levels(answers: Sequence[Answer], figure: Figure) -> tuple[ConfidenceBin, ...]:
    """How often answers were right by a figure of their score: a falling staircase of a few levels.

    Levels hold equally many answers, at least LEAST_ANSWERS; one that is not below the one before
    is joined with it (isotonic regression: pool adjacent violators, R. E. Barlow et al.,
    Statistical Inference under Order Restrictions, 1972). The rate of a level is (right + 1) /
    (answers + 2), Laplace's rule, so that none is certain. The last has no end.
    """
    ordered = sorted(answers, key=lambda a: -figure(a))
    count = max(len(ordered) // LEAST_ANSWERS, 1)
    pooled: list[list[Answer]] = []
    for part in np.array_split(np.arange(len(ordered)), count):
        pooled.append([ordered[i] for i in part])
        while len(pooled) > 1 and _rate(pooled[-1]) >= _rate(pooled[-2]):
            last = pooled.pop()
            pooled[-1] += last
    ends = [figure(group[-1]) for group in pooled[:-1]] + [0.0]
    return tuple(ConfidenceBin(end, _rate(part)) for end, part in zip(ends, pooled, strict=True))


def _rate(answers: Sequence[Answer]) -> float:
    return (sum(a.right for a in answers) + 1) / (len(answers) + 2)


def judged(fitted: Sequence[Machine], others: Sequence[Machine]) -> list[str]:
    """By source and stated confidence, how often others were right."""
    lines = []
    every = [a for m in fitted for a in m.answers]
    tables = [(figure, levels(every, figure)) for figure in FIGURES.values()]
    for source in dict.fromkeys(m.source for m in others):
        found: dict[float, list[bool]] = {}
        for a in (a for m in others if m.source == source for a in m.answers):
            stated = min(read(table, figure(a)) for figure, table in tables)
            found.setdefault(stated, []).append(a.right)
        lines += [
            f"{source}: stated {stated:.2f}, right {sum(right)} of {len(right)}"
            for stated, right in sorted(found.items(), reverse=True)
        ]
    return lines


def tables_of(machines: Sequence[Machine]) -> str:
    """The tables of all machines, as Python text."""
    answers = [a for m in machines for a in m.answers]
    lines = []
    for name, figure in FIGURES.items():
        bins = levels(answers, figure)
        steps = ", ".join(f"ConfidenceBin({v.least:.2f}, {v.right:.2f})" for v in bins)
        lines.append(f"{name} = ({steps})  # {len(answers)} answers")
    return "\n".join(lines)


def report(machines: Sequence[Machine]) -> str:
    """Both halves, each judged with the tables of the other, and the tables of all."""
    order = np.random.default_rng(SPLIT).permutation(len(machines))
    halves = [[machines[i] for i in part] for part in np.array_split(order, 2)]
    first, second = halves
    return "\n".join((*judged(first, second), *judged(second, first), tables_of(machines)))


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
