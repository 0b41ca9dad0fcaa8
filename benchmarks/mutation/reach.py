"""Which tests run a line, and how long each takes: from one run of the suite under coverage."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from xml.etree import ElementTree

from coverage import CoverageData

from benchmarks.mutation.faults import PACKAGES, Fault


def environment(root: Path) -> dict[str, str]:
    """Environment variables with which the tests import that copy of the project."""
    return {
        **os.environ,
        "PYTHONPATH": str(root),
        "PYTHONDONTWRITEBYTECODE": "1",
        "OMP_NUM_THREADS": "1",
    }


@dataclass(frozen=True)
class Reach:
    """seconds: of each test by its id. contexts: path -> line -> the tests that run it.

    A file in place of a test: a fixture of that file ran the line, so any of its tests may tell.
    """

    seconds: Mapping[str, float]
    contexts: Mapping[str, Mapping[int, frozenset[str]]]

    def tests_for(
        self, fault: Fault, budget: float, native: bool = False, at_import: bool = False
    ) -> list[str]:
        """Tests that can notice a fault, of ``budget`` seconds together.

        Tests that name the subject of its file, such as an effect, come first, then those of its
        folder, the quickest first.
        Coverage does not record native code, nor what runs in a process of its own, and what runs
        at import for one test alone; there any of the file or of the folder counts, or any at all.
        """
        by_line = self.contexts.get(fault.path, {})
        own = frozenset() if at_import else by_line.get(fault.line, frozenset())
        reached = own or frozenset().union(*by_line.values())
        chosen = {t for t in self.seconds if t in reached or t.partition("::")[0] in reached}
        room = self._room(fault)
        if native or not chosen:
            chosen = set(self.seconds)
        elif not own:
            chosen |= {t for t in self.seconds if _folder(t) == room}
        subject = Path(fault.path).stem
        out: list[str] = []
        spent = 0.0

        def order(test: str) -> tuple[bool, bool, bool, float, str]:
            near = _folder(test) == room, f"{_folder(test)}/".startswith(f"{room}/")
            return subject not in test, not near[0], not near[1], self.seconds[test], test

        for test in sorted(chosen, key=order):
            spent += self.seconds[test]
            if out and spent > budget:
                break
            out.append(test)
        return out

    def _room(self, fault: Fault) -> str:
        """The folder of tests that is nearest to a fault's own."""
        folders = {_folder(t) for t in self.seconds}
        own = Path("tests") / Path(fault.path).parent
        return next((f.as_posix() for f in (own, *own.parents) if f.as_posix() in folders), "tests")


def _folder(test: str) -> str:
    return Path(test.partition("::")[0]).parent.as_posix()


@cache
def reach(root: Path, scratch: Path) -> Reach:
    """Run the quick suite of a copy of the project under coverage.

    Raises RuntimeError where a test fails already without a fault.
    """
    report, data = scratch / "tests.xml", scratch / "coverage"
    command = [sys.executable, "-m", "pytest", "-n", "2", "-m", "not slow", "-q"]
    command += [f"--cov={p}" for p in PACKAGES]
    command += ["--cov-context=test", "--cov-report=", f"--junitxml={report}"]
    done = subprocess.run(
        command, cwd=root, env={**environment(root), "COVERAGE_FILE": str(data)},
        capture_output=True, text=True,
    )  # fmt: skip
    if done.returncode:
        raise RuntimeError(f"the suite fails without a fault:\n{done.stdout[-2000:]}")
    return Reach(_seconds(report), _contexts(data, root))


def _seconds(report: Path) -> dict[str, float]:
    out = {}
    for case in ElementTree.parse(report).iter("testcase"):
        module = case.get("classname", "").replace(".", "/") + ".py"
        out[f"{module}::{case.get('name')}"] = float(case.get("time", 0.0))
    return out


def _contexts(data: Path, root: Path) -> dict[str, dict[int, frozenset[str]]]:
    measured = CoverageData(str(data))
    measured.read()
    out: dict[str, dict[int, frozenset[str]]] = {}
    for file in measured.measured_files():
        lines = measured.contexts_by_lineno(file).items()
        tests = {line: frozenset(map(teller, filter(None, names))) for line, names in lines}
        out[os.path.relpath(file, root)] = {line: t for line, t in tests.items() if t}
    return out


def teller(context: str) -> str:
    """The test of a context such as "tests/test_a.py::test_b|run"; of a set-up its file."""
    test, _, phase = context.partition("|")
    return test.partition("::")[0] if phase == "setup" else test
