"""What the rule's numbers decide: `python -m benchmarks rule [--machines N] [--seed N]`.

Each number of the rule is halved and doubled, and the same machines of the self-test are diagnosed
again. A rate that hardly moves tells that nothing hangs on the number; one that moves, what does.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import fields

import numpy as np

from benchmarks.figures import Figure, Target
from benchmarks.selftest.design import FULL
from benchmarks.selftest.laws import OUTSIDE
from benchmarks.selftest.machines import Case
from benchmarks.selftest.tally import rates
from benchmarks.selftest.trial import TrialResult, run
from identify.rules import RULE
from twin.engine import engine

TITLE = "The rule's numbers, each halved and doubled"
MACHINES, SEED = 24, 3111
FACTORS = (0.5, 2.0)
MOST = 0.05  # by which no rate is to move
SHOWN = ("named", "false", "both", "confident wrong")
Setting = tuple[str, float]
AS_IT_IS: Setting = ("", 1.0)


def measure() -> list[Figure]:
    """The largest change of a rate for each number."""
    return figures(results_of(cases_of(MACHINES, SEED)))


def cases_of(count: int, seed: int) -> list[Case]:
    """Machines of the full self-test, drawn at random."""
    every = FULL.cases(seed)
    picked = np.random.default_rng(seed).permutation(len(every))[:count]
    return [every[i] for i in sorted(picked)]


def settings() -> list[Setting]:
    """The rule as it is, and each of its numbers halved and doubled."""
    changed = [(field.name, factor) for field in fields(RULE) for factor in FACTORS]
    return [AS_IT_IS, *changed]


def run_with(setting: Setting, case: Case) -> TrialResult:
    """One machine, diagnosed with one number of the rule changed."""
    name, factor = setting
    if not name:
        return run(case)
    before = getattr(RULE, name)
    changed = max(round(factor * before), 1) if isinstance(before, int) else factor * before
    object.__setattr__(RULE, name, changed)  # the rule of this process alone, for this machine
    try:
        return run(case)
    finally:
        object.__setattr__(RULE, name, before)


def results_of(cases: Sequence[Case]) -> dict[Setting, list[TrialResult]]:
    """Results by setting, in as many processes as there are cores."""
    out = {}
    with engine() as (pool, _):
        for setting in settings():
            out[setting] = list(pool.map(run_with, [setting] * len(cases), cases))
            print(f"  {described(setting)}: {line(out[setting])}", file=sys.stderr, flush=True)
    return out


def described(setting: Setting) -> str:
    """A setting in words."""
    name, factor = setting
    return f"{name} {getattr(RULE, name):g} x {factor:g}" if name else "as it is"


def line(results: Sequence[TrialResult]) -> str:
    """The rates of some results, on one line."""
    shown = (r for r in rates(results) if any(word in r.what for word in SHOWN))
    return ", ".join(f"{r.what} {r.count}/{r.trials}" for r in shown)


def figures(results: dict[Setting, list[TrialResult]]) -> list[Figure]:
    """For each setting, by how much the share of machines that are answered rightly changes."""
    own, out = results[AS_IT_IS], []
    for setting, changed in results.items():
        pairs = [(str(a.case), _good(a), _good(b)) for a, b in zip(own, changed, strict=True)]
        moved = [
            f"{'+' if after else '-'}{case}" for case, before, after in pairs if before != after
        ]
        change = sum(after - before for _, before, after in pairs) / len(pairs)
        note = "; ".join(filter(None, (line(changed), ", ".join(moved))))
        out.append(Figure(described(setting), change, "1", Target(-MOST, MOST), note))
    return out


def _good(result: TrialResult) -> bool:
    """Whether what is planted in the catalogue is named, and nothing wrong is told."""
    inside = result.case.known and not set(result.case.effects) & OUTSIDE.keys()
    return not result.wrong and (result.named or not inside or not result.shown)


def main(given: Sequence[str]) -> int:
    """Measure as asked; prints a table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks rule", description=__doc__)
    parser.add_argument("--machines", type=int, default=MACHINES)
    parser.add_argument("--seed", type=int, default=SEED)
    asked = parser.parse_args(given)
    for figure in figures(results_of(cases_of(asked.machines, asked.seed))):
        print(f"| {figure.what} | {100.0 * (figure.value or 0.0):+.0f} % | {figure.note} |")
    return 0
