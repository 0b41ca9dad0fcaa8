"""``python -m benchmarks.mutation [--seed N] [--count N] [--root FOLDER]``: the faults alone."""

import argparse
from pathlib import Path

from benchmarks.mutation.noticed import COUNT, ROOT, measure

parser = argparse.ArgumentParser(description=measure.__doc__)
parser.add_argument("--seed", type=int)
parser.add_argument("--count", type=int, default=COUNT)
parser.add_argument("--root", type=Path, default=ROOT, help="another checkout of the project")
given = parser.parse_args()
for figure in measure(given.seed, given.count, given.root):
    print(f"{figure.verdict:7} {figure.note:>8}  {figure.what}")
