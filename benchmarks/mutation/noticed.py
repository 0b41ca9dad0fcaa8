"""Small faults in lines drawn at random: the share that the tests notice, by folder."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.figures import Figure, Target, told
from benchmarks.mutation.faults import LEAST, draw
from benchmarks.mutation.trial import Trial, folders, trials

TITLE = "Faults in lines drawn at random that the tests notice"
ROOT = Path(__file__).parent.parent.parent
COUNT = 150  # twenty-five minutes on two cores; LEAST in each of 26 folders are 130
ALL = Target(low=0.8)
FOLDER = Target(low=0.6)


def measure(
    seed: int | None = None, count: int = COUNT, root: Path = ROOT, least: int = LEAST
) -> list[Figure]:
    """Draw faults with a seed, a new one where None, and try each; prints them as they end."""
    seed = int(np.random.default_rng().integers(1 << 31)) if seed is None else seed
    print(f"  seed {seed}", file=sys.stderr, flush=True)
    done = []
    for trial in trials(root, draw(root, count, seed, least)):
        done.append(trial)
        _tell(trial)
    return figures(done, seed)


def figures(done: Sequence[Trial], seed: int) -> list[Figure]:
    """The share of all, and of each folder."""
    whole = _share(f"all, seed {seed}", done, ALL)
    parts = folders([t.fault for t in done])
    return [whole, *(_share(f, [t for t in done if t.fault.folder == f], FOLDER) for f in parts)]


def _share(what: str, done: Sequence[Trial], target: Target) -> Figure:
    noticed = sum(t.noticed for t in done)
    return Figure(what, noticed / len(done), "1", target, f"{noticed} of {len(done)}")


def _tell(trial: Trial) -> None:
    f = trial.fault
    how = f"noticed by {trial.by}" if trial.noticed else f"NOT NOTICED by {trial.tests} tests"
    print(f"  {f.path}:{f.line}: {trial.shown}: {how}", file=sys.stderr, flush=True)


def main(arguments: Sequence[str]) -> int:
    """Try the faults asked for; 0 where every target is met."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks mutation", description=__doc__)
    parser.add_argument("--seed", type=int, help="draws the lines; another each time if left out")
    parser.add_argument("--count", type=int, default=COUNT, help="faults")
    parser.add_argument("--least", type=int, default=LEAST, help="faults in each folder, at least")
    parser.add_argument("--root", type=Path, default=ROOT, help="another checkout of the project")
    given = parser.parse_args(arguments)
    return told(measure(given.seed, given.count, given.root, given.least))
