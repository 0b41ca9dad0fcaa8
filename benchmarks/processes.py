"""What a command costs as a process of its own: CPU time, wall time and peak memory."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

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


@dataclass(frozen=True)
class Cost:
    """CPU time (user and system) and wall time in s, peak memory in bytes."""

    cpu: float
    wall: float
    memory: float


def twin(*arguments: str | Path) -> Cost:
    """The cost of `twin` with these arguments."""
    return python("-c", TWIN, *map(str, arguments))


def python(*arguments: str) -> Cost:
    """The cost of a Python process; RuntimeError where it ends in an error."""
    return run([sys.executable, *arguments])


def run(command: Sequence[str]) -> Cost:
    """The cost of a command, whose output is not shown; RuntimeError where it ends in an error."""
    done = subprocess.run(
        [sys.executable, "-I", "-S", "-c", LAUNCHER, *command],
        cwd=ROOT, env=_environment(), stdout=subprocess.PIPE, text=True, check=True,
    )  # fmt: skip
    cpu, wall, memory, code = json.loads(done.stdout)
    if code not in (0, 1):  # 1: the answer of the command is "no"
        raise RuntimeError(f"{' '.join(command)} ended with {code}")
    return Cost(cpu, wall, memory)


def _environment() -> dict[str, str]:
    """That of a user, whose Python keeps the modules that it has compiled."""
    return {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
