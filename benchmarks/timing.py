"""What jobs and commands cost: in turn, so that other load of the machine affects all alike."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
ROOT = Path(__file__).parent.parent
TWIN = "from identify.cli import main; main()"
# Linux counts the memory of the process that starts a child as the child's own, so a bare
# interpreter of less memory than any command starts it.
LAUNCHER = """
import json, os, sys, time
begun = time.perf_counter()
child = os.posix_spawn(
    sys.argv[1], sys.argv[1:], os.environ,
    file_actions=[(os.POSIX_SPAWN_OPEN, 1, os.devnull, os.O_WRONLY, 0)],
)
_, status, used = os.wait4(child, 0)
wall = time.perf_counter() - begun
unit = 1 if sys.platform == "darwin" else 1024  # bytes
print(json.dumps([used.ru_utime + used.ru_stime, wall, used.ru_maxrss * unit,
                  os.waitstatus_to_exitcode(status)]))
"""


def interleaved(
    jobs: Sequence[Callable[[], object]], rounds: int, clock: Callable[[], float] = perf_counter
) -> Array:
    """Seconds of every job in every round, (rounds, n_jobs), after one round that is not counted.

    clock: perf_counter, or time.thread_time for compiled work that runs in this thread alone.
    """
    seconds = np.empty((rounds + 1, len(jobs)))
    for row in seconds:
        for i, job in enumerate(jobs):
            begun = clock()
            job()
            row[i] = clock() - begun
    return seconds[1:]


def ratio(numerator: Array, denominator: Array) -> float:
    """Median over the rounds of one job's time over another's, both (rounds,)."""
    return float(np.median(numerator / denominator))


@dataclass(frozen=True)
class Cost:
    """CPU time (user and system) and wall time in s, peak memory in bytes."""

    cpu: float
    wall: float
    memory: float


def _command(*arguments: str | Path) -> list[str]:
    return [sys.executable, "-c", TWIN, *map(str, arguments)]


def twin(*arguments: str | Path) -> Cost:
    """The cost of a process of `twin`, whose output is not shown.

    Raises RuntimeError where it ends in an error. Its Python keeps the modules that it has
    compiled, as that of a user does.
    """
    command = _command(*arguments)
    done = subprocess.run(
        [sys.executable, "-I", "-S", "-c", LAUNCHER, *command], cwd=ROOT,
        env={k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"},
        stdout=subprocess.PIPE, text=True, check=True,
    )  # fmt: skip
    cpu, wall, memory, code = json.loads(done.stdout)
    if code not in (0, 1):  # 1: the answer of the command is "no"
        raise RuntimeError(f"{' '.join(command)} ended with {code}")
    return Cost(cpu, wall, memory)


def first_line(*arguments: str | Path) -> float:
    """Wall time in s until a process of `twin` says its first line of progress."""
    begun = perf_counter()
    with subprocess.Popen(
        _command(*arguments), cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stderr is not None
        process.stderr.readline()
        seconds = perf_counter() - begun
        process.stderr.read()  # it ends by itself
    return seconds
