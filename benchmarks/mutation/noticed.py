"""Small faults in lines drawn at random: the share that the tests notice, by folder.

One fault at a time is put into a copy of the project, whose tests then run.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.figures import Figure, Target, report
from benchmarks.mutation.faults import LEAST, PACKAGES, Fault, draw, is_at_import, is_native
from benchmarks.mutation.reach import Reach, environment, reach

TITLE = "Faults in lines drawn at random that the tests notice"
ROOT = Path(__file__).parent.parent.parent
COUNT = 150  # twenty-five minutes on two cores; LEAST in each of 26 folders are 130
ALL = Target(low=0.8)
FOLDER = Target(low=0.6)
BUDGET = 40.0  # s of tests that are run for a fault
HANGS = 6.0  # times the budget after which the tests count as hanging, and the fault as noticed
LEFT_OUT = shutil.ignore_patterns(".git", ".venv", ".ruff_cache", "*.mcap")


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
        kinds = is_native(source, fault.line), is_at_import(source, fault.line)
        tests = known.tests_for(fault, BUDGET, *kinds)
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


def measure(
    seed: int | None = None, count: int = COUNT, root: Path = ROOT, least: int = LEAST
) -> list[Figure]:
    """Draw faults with a seed, a new one where None, and try each; prints them as they end."""
    seed = int(np.random.default_rng().integers(1 << 31)) if seed is None else seed
    print(f"  seed {seed}", file=sys.stderr, flush=True)
    done = []
    for trial in trials(root, draw(root, count, seed, least)):
        done.append(trial)
        fault, by = trial.fault, f"noticed by {trial.by}"
        how = by if trial.noticed else f"NOT NOTICED by {trial.tests} tests"
        print(f"  {fault.path}:{fault.line}: {trial.shown}: {how}", file=sys.stderr, flush=True)
    return figures(done, seed)


def figures(done: Sequence[Trial], seed: int) -> list[Figure]:
    """The share of all, and of each folder."""
    whole = _share(f"all, seed {seed}", done, ALL)
    parts = sorted(
        {t.fault.folder for t in done}, key=lambda f: (PACKAGES.index(f.split("/")[0]), f)
    )
    return [whole, *(_share(f, [t for t in done if t.fault.folder == f], FOLDER) for f in parts)]


def _share(what: str, done: Sequence[Trial], target: Target) -> Figure:
    noticed = sum(t.noticed for t in done)
    return Figure(what, noticed / len(done), "1", target, f"{noticed} of {len(done)}")


def main(arguments: Sequence[str]) -> int:
    """Try the faults asked for; 0 where every target is met."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks mutation", description=__doc__)
    parser.add_argument("--seed", type=int, help="draws the lines; another each time if left out")
    parser.add_argument("--count", type=int, default=COUNT, help="faults")
    parser.add_argument("--least", type=int, default=LEAST, help="faults in each folder, at least")
    parser.add_argument("--root", type=Path, default=ROOT, help="another checkout of the project")
    given = parser.parse_args(arguments)
    return report(measure(given.seed, given.count, given.root, given.least))
