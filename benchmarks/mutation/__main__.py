"""``python -m benchmarks.mutation [--seed N] [--count N] [--least N] [--root FOLDER]``."""

import argparse
from pathlib import Path

from benchmarks.mutation.noticed import COUNT, LEAST, ROOT, measure

parser = argparse.ArgumentParser(description=measure.__doc__)
parser.add_argument("--seed", type=int)
parser.add_argument("--count", type=int, default=COUNT)
parser.add_argument("--least", type=int, default=LEAST, help="faults in each folder, at least")
parser.add_argument("--root", type=Path, default=ROOT, help="another checkout of the project")
given = parser.parse_args()
for figure in measure(given.seed, given.count, given.root, given.least):
    print(f"{figure.verdict:7} {figure.note:>8}  {figure.what}")
