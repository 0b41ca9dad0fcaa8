"""Time to load the whole compiled catalogue, over the time of the imports that it needs."""

from __future__ import annotations

import subprocess
import sys
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.figures import Figure, Target
from benchmarks.timing import Array, interleaved, ratio

TITLE = "Start of a process, with warm caches, over importing numba, mujoco and scipy"
ROUNDS = 7
BARE = "import numba, mujoco, scipy"
LINKED = BARE + ".linalg"  # which numba loads with its first function
WHOLE = "from twin.effects import load_catalogue\ncatalogue = load_catalogue()\n"
READY = (
    WHOLE
    + "from twin.core.native import law_address\n"
    + "for effect in catalogue.values():\n    law_address(effect)\n"
)


def measure() -> list[Figure]:
    """Wall time of each in processes of their own, in turn."""
    starts = [BARE, LINKED, WHOLE, READY]
    bare, linked, whole, ready = interleaved([partial(_start, s) for s in starts], ROUNDS).T
    return [
        _figure("the whole catalogue", whole, bare, Target(high=2.0)),
        _figure("the whole catalogue and every law loaded", ready, bare),
        _figure("the same, over scipy.linalg too", ready, linked, Target(high=2.0)),
    ]


def _figure(name: str, of: Array, over: Array, target: Target | None = None) -> Figure:
    note = f"{np.median(of):.2f} s and {np.median(over):.2f} s"
    return Figure(name, ratio(of, over), "1", target, note)


def _start(code: str) -> None:
    root = Path(__file__).parent.parent
    subprocess.run([sys.executable, "-c", code], cwd=root, check=True)
