"""Put one fault at a time into a copy of the project, and see whether its tests notice."""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from benchmarks.mutation.faults import PACKAGES, Fault, is_native
from benchmarks.mutation.reach import Reach, environment, reach

BUDGET = 40.0  # s of tests that are run for a fault
HANGS = 6.0  # times the budget after which the tests count as hanging, and the fault as noticed
LEFT_OUT = shutil.ignore_patterns(".git", ".venv", ".mypy_cache", ".ruff_cache", "*.mcap")


@dataclass(frozen=True)
class Trial:
    """The result for a fault. shown: the line before and after. by: the test that noticed it."""

    fault: Fault
    shown: str
    tests: int
    noticed: bool
    by: str


def trials(root: Path, faults: Sequence[Fault], workers: int = 2) -> Iterator[Trial]:
    """Every fault's trial, as it ends; the project itself is left as it is."""
    with tempfile.TemporaryDirectory(prefix="faults-") as folder:
        clean = Path(folder) / "clean"
        shutil.copytree(root, clean, ignore=LEFT_OUT)
        if (shared := root.parent / "shared").is_dir():
            (Path(folder) / "shared").symlink_to(shared)
        known = reach(clean, Path(folder))
        with ThreadPoolExecutor(workers) as pool:
            yield from pool.map(lambda i: _trial(clean, faults[i], known, i), range(len(faults)))


def _trial(clean: Path, fault: Fault, known: Reach, number: int) -> Trial:
    """Copy, alter, test. The copy takes the compiled code along, so only what changed compiles."""
    source = (clean / fault.path).read_text()
    copy = clean.parent / f"fault-{number}"
    shutil.copytree(clean, copy)
    try:
        (copy / fault.path).write_text(fault.applied(source))
        tests = known.tests_for(fault, BUDGET, is_native(source, fault.line))
        noticed, by = _tested(copy, tests)
    finally:
        shutil.rmtree(copy, ignore_errors=True)
    return Trial(fault, fault.shown(source), len(tests), noticed, by)


def _tested(copy: Path, tests: Sequence[str]) -> tuple[bool, str]:
    chosen = copy / "chosen.txt"
    chosen.write_text("\n".join(tests))
    command = [sys.executable, "-m", "pytest", "-x", "-q", "--tb=no", "-p", "no:cacheprovider"]
    try:
        done = subprocess.run(
            [*command, f"@{chosen}"], cwd=copy, env=environment(copy), capture_output=True,
            text=True, timeout=HANGS * BUDGET,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return True, "it hangs"
    told = [line for line in done.stdout.splitlines() if line.startswith(("FAILED", "ERROR"))]
    return done.returncode != 0, told[0].split(" ")[1] if told else ""


def folders(faults: Sequence[Fault]) -> list[str]:
    """The folders that faults were drawn in, the packages first."""
    return sorted({f.folder for f in faults}, key=lambda f: (PACKAGES.index(f.split("/")[0]), f))
