"""Time to the whole catalogue, compiled, over that of the imports it cannot do without."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from benchmarks.figures import Figure, Target
from benchmarks.timing import interleaved, ratio

TITLE = "Start of a process: catalogue loaded and every law ready, with warm caches"
ROUNDS = 7
BARE = "import numba, mujoco, scipy.linalg"  # numba loads the last with its first function
WHOLE = (
    "from twin.effects import load_catalogue\n"
    "from twin.native import law_address\n"
    "for effect in load_catalogue().values():\n"
    "    law_address(effect)\n"
)


def measure() -> list[Figure]:
    """Wall time of both in processes of their own, in turn."""
    bare, whole = interleaved([lambda: _start(BARE), lambda: _start(WHOLE)], ROUNDS).T
    return [
        Figure(
            "catalogue with every law over importing numba, mujoco and scipy",
            ratio(whole, bare), "1", Target(high=2.0),
            f"{sorted(whole)[ROUNDS // 2]:.2f} s and {sorted(bare)[ROUNDS // 2]:.2f} s",
        )
    ]  # fmt: skip


def _start(code: str) -> None:
    root = Path(__file__).parent.parent
    subprocess.run([sys.executable, "-c", code], cwd=root, check=True)
