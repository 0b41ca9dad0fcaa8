"""A second process start compiles nothing: two processes on one empty numba cache."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from time import perf_counter

from benchmarks.figures import Figure, Target

TITLE = "Second process start: simulate 2 s in MuJoCo, fit both axes"


def measure() -> list[Figure]:
    """Compiler passes and wall time of the first and the second start."""
    with tempfile.TemporaryDirectory() as cache:
        (first, first_wall), (second, second_wall) = (_start(cache) for _ in range(2))
    return [
        Figure(
            "passes of numba's compiler at the second start", second["compiler_passes"],
            "passes", Target(high=0.0), f"first start: {first['compiler_passes']:.0f}",
        ),
        Figure(
            "wall time of the second start over the first", second_wall / first_wall, "1",
            note=f"{first_wall:.1f} s, then {second_wall:.1f} s with the interpreter's start; "
            f"the job itself {second['seconds']:.1f} s",
        ),
    ]  # fmt: skip


def _start(cache: str) -> tuple[dict[str, float], float]:
    begun = perf_counter()
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks.short_job"],
        cwd=Path(__file__).parent.parent,
        env={**os.environ, "NUMBA_CACHE_DIR": cache},
        capture_output=True,
        text=True,
        check=True,
    )
    return json.loads(done.stdout), perf_counter() - begun
