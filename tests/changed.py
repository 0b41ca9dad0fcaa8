"""``pytest --changed``: the tests of what changed, for ``make check``.

Changed is what differs from the last commit, or what that commit changed where nothing differs. A
test file belongs to it where it changed itself, or imports a module that did, by itself or through
its helpers in tests/. The run ends after ``--seconds``, which ``make test`` does not know.
"""

from __future__ import annotations

import ast
import subprocess
import time
from functools import cache
from pathlib import Path

import pytest

BEGUN = pytest.StashKey[float]()
TESTS = Path(__file__).parent
ROOT = TESTS.parent
PACKAGES = ("twin", "identify", "studies", "benchmarks")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--changed", action="store_true", help="only the tests of what changed")
    parser.addoption("--seconds", type=float, help="begin no test after so many seconds")


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    if not config.getoption("--changed") or collection_path.suffix != ".py":
        return None
    return not concerns(collection_path, changed_files()) or None


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if config.getoption("--changed"):
        # The fewer modules a test file imports, the more it is about the one that changed.
        items.sort(key=lambda i: len(imported(i.path)))


def pytest_sessionstart(session: pytest.Session) -> None:
    session.config.stash[BEGUN] = time.monotonic()


def pytest_runtest_teardown(item: pytest.Item) -> None:
    limit = item.config.getoption("--seconds")
    if limit and time.monotonic() - item.config.stash[BEGUN] > limit:
        item.session.shouldstop = f"{limit:g} s are over; `make test` runs the rest"


def pytest_sessionfinish(session: pytest.Session) -> None:
    """No test of what changed, or no time for the rest, is no failure."""
    ended = (pytest.ExitCode.NO_TESTS_COLLECTED, pytest.ExitCode.INTERRUPTED)
    if session.config.getoption("--changed") and session.exitstatus in ended:
        session.exitstatus = pytest.ExitCode.TESTS_FAILED if session.testsfailed else 0


@cache
def changed_files() -> frozenset[Path]:
    """Files that differ from the last commit, or that it changed where none does."""
    lines = _git("status", "--porcelain", "--untracked-files=all").splitlines()
    names = [line[3:].split(" -> ")[-1] for line in lines]
    if not names:
        names = _git("diff", "--name-only", "HEAD~1", "HEAD").splitlines()
    return frozenset(ROOT / name for name in names)


def _git(*words: str) -> str:
    done = subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True)
    return done.stdout if done.returncode == 0 else ""


def concerns(test: Path, touched: frozenset[Path]) -> bool:
    """Whether a test file changed, or imports something that did."""
    return test in touched or not touched.isdisjoint(imported(test))


@cache
def imported(file: Path) -> frozenset[Path]:
    """Files of the project that a test file imports, helpers in tests/ and theirs included."""
    found: set[Path] = set()
    for name in _names(file):
        for path in _candidates(name):
            if path.is_file() and path not in found:
                found.add(path)
                if TESTS in path.parents:
                    found |= imported(path)
    return frozenset(found)


def _candidates(name: str) -> tuple[Path, ...]:
    parts = name.split(".")
    if parts[0] in PACKAGES:
        base = ROOT.joinpath(*parts)
        return base.with_suffix(".py"), base / "__init__.py"
    return (TESTS.joinpath(*parts).with_suffix(".py"),) if len(parts) == 1 else ()


def _names(file: Path) -> set[str]:
    out: set[str] = set()
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Import):
            out |= {a.name for a in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            out.add(node.module)
            out |= {f"{node.module}.{a.name}" for a in node.names}
    return out
