"""How a process starts: nothing is compiled a second time, and imports take most of it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from functools import partial
from pathlib import Path
from time import perf_counter

import numpy as np

from benchmarks.figures import Figure, Target
from benchmarks.timing import Array, interleaved, ratio

TITLE = "Start of a process"
ROOT = Path(__file__).parent.parent
ROUNDS = 7
BARE = "import numba, mujoco, scipy"
LINKED = BARE + ".linalg"  # which numba loads with its first function
WHOLE = "from twin.effects import load_catalogue\ncatalogue = load_catalogue()\n"
READY = (
    WHOLE
    + "from twin.core.native import law_address\n"
    + "for effect in catalogue.values():\n    law_address(effect)\n"
)
# Simulates two seconds in MuJoCo, fits them, and counts the passes of numba's compiler.
SHORT_JOB = """
import json
from time import perf_counter
from numba.core import event
from identify import workflow
from twin.effects import load_catalogue
from twin import simulate
from twin.model.file import load_model
begun = perf_counter()
with event.install_recorder("numba:run_pass") as recorder:
    model = load_model("proton_xy", load_catalogue())
    workflow.fit(model, {"log": simulate(model, "tracking", duration=2.0)})
passes = sum(e.is_start for _, e in recorder.buffer)
print(json.dumps({"compiler_passes": passes, "seconds": perf_counter() - begun}))
"""


def measure() -> list[Figure]:
    """A short job on an empty cache and again; then imports and the catalogue, in turn."""
    return [*_second_start(), *_imports()]


def _second_start() -> list[Figure]:
    """Compiler passes and wall time of two processes on one numba cache, empty at first."""
    with tempfile.TemporaryDirectory() as cache:
        (first, first_wall), (second, second_wall) = (_job_with(cache) for _ in range(2))
    return [
        Figure(
            "simulate 2 s in MuJoCo, fit both axes: passes of numba's compiler at the second start",
            second["compiler_passes"], "passes", Target(high=0.0),
            f"first start: {first['compiler_passes']:.0f}",
        ),
        Figure(
            "the same: wall time of the second start over the first", second_wall / first_wall, "1",
            note=f"{first_wall:.1f} s, then {second_wall:.1f} s with the interpreter's start; "
            f"the job itself {second['seconds']:.1f} s",
        ),
    ]  # fmt: skip


def _job_with(cache: str) -> tuple[dict[str, float], float]:
    begun = perf_counter()
    printed = _start(SHORT_JOB, {**os.environ, "NUMBA_CACHE_DIR": cache})
    return json.loads(printed), perf_counter() - begun


def _imports() -> list[Figure]:
    """Wall time with warm caches, over that of importing numba, mujoco and scipy."""
    starts = [BARE, LINKED, WHOLE, READY]
    bare, linked, whole, ready = interleaved([partial(_start, s) for s in starts], ROUNDS).T
    return [
        _figure("the whole catalogue over numba, mujoco and scipy", whole, bare, Target(high=2.0)),
        _figure("the whole catalogue and every law loaded", ready, bare),
        _figure("the same, over scipy.linalg too", ready, linked, Target(high=2.0)),
    ]


def _figure(name: str, of: Array, over: Array, target: Target | None = None) -> Figure:
    note = f"{np.median(of):.2f} s and {np.median(over):.2f} s"
    return Figure(name, ratio(of, over), "1", target, note)


def _start(code: str, environment: dict[str, str] | None = None) -> str:
    """What a process prints."""
    command = [sys.executable, "-c", code]
    done = subprocess.run(
        command, cwd=ROOT, env=environment, stdout=subprocess.PIPE, text=True, check=True
    )
    return done.stdout
