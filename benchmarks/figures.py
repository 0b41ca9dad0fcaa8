"""Figures of a benchmark, some with a target, and the two files that they are written to."""

from __future__ import annotations

import json
import os
import platform
import subprocess
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from datetime import date
from importlib.metadata import version
from math import inf, isfinite
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parent.parent
PACKAGES = ("mujoco", "numba", "numpy", "scipy", "mcap")
PREAMBLE = """\
# Benchmarks

Written by `python -m benchmarks` (`make bench`). Ratios are of runs in turn (A B A B) on one
machine, median of the rounds; figures in seconds or nanoseconds hold for that machine alone. Under
each title stands what was measured: version, commit, date and machine.
"""


@dataclass(frozen=True)
class Target:
    """The interval in which a figure must lie."""

    low: float = -inf
    high: float = inf

    def met(self, value: float) -> bool:
        """Whether the value lies in the interval."""
        return bool(self.low <= value <= self.high)

    def __str__(self) -> str:
        lower = f"at least {self.low:g}" if self.low > -inf else ""
        upper = f"at most {self.high:g}" if self.high < inf else ""
        return " and ".join(filter(None, (lower, upper)))


@dataclass(frozen=True)
class Figure:
    """One measured number. value: None where it could not be measured, and the note says why."""

    what: str
    value: float | None
    unit: str = "1"
    target: Target | None = None
    note: str = ""

    @property
    def passed(self) -> bool | None:
        """Whether the target is met; None without a target or a value."""
        if self.target is None or self.value is None:
            return None
        return self.target.met(self.value)

    @property
    def verdict(self) -> str:
        """One word for the table."""
        if self.value is None:
            return "skipped"
        return {None: "", True: "pass", False: "FAIL"}[self.passed]


@dataclass(frozen=True)
class Origin:
    """Of what a table was measured, and on what machine; date: of the day, ISO 8601."""

    version: str
    commit: str
    date: str
    machine: str

    @classmethod
    def now(cls) -> Origin:
        """That of a table which is measured here."""
        asked = ["git", "describe", "--always", "--exclude=*", "--dirty=, changed"]
        done = subprocess.run(asked, cwd=ROOT, capture_output=True, text=True)
        commit = done.stdout.strip() or "not known"
        return cls(this_version(), commit, date.today().isoformat(), machine())

    @property
    def minor(self) -> tuple[int, int]:
        """Major and minor version."""
        major, minor = map(int, self.version.split(".")[:2])
        return major, minor

    def __str__(self) -> str:
        return f"Version {self.version}, commit {self.commit}, {self.date}; {self.machine}"


def this_version() -> str:
    """The version in pyproject.toml."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    return str(project["version"])


def machine() -> str:
    """The machine that the figures are measured on."""
    versions = ", ".join(f"{name} {version(name)}" for name in PACKAGES)
    return f"{os.cpu_count()} CPUs, Python {platform.python_version()}, {versions}"


def write_results(results: Mapping[str, Sequence[Figure]], folder: Path) -> None:
    """Bring RESULTS.md and RESULTS.json in the folder up to date, whole or not at all.

    Benchmarks that were not run keep the figures they had, and of what these were measured.
    """
    origin = asdict(Origin.now())
    tables = kept_tables(folder)
    for title, figures in results.items():
        tables[title] = {"origin": origin, "figures": [_as_json(f) for f in figures]}
    sections = "\n".join(
        f"## {title}\n\n{Origin(**table['origin'])}\n\n{_table(table['figures'])}"
        for title, table in tables.items()
    )
    _replace(folder / "RESULTS.md", f"{PREAMBLE}\n{sections}")
    _replace(folder / "RESULTS.json", json.dumps(tables, indent=1) + "\n")


def shown(value: float | None) -> str:
    """A number of three digits; one that counts in full."""
    if value is None:
        return ""
    return f"{value:.0f}" if float(value).is_integer() else f"{value:.3g}"


def report(figures: Sequence[Figure]) -> int:
    """Print figures; 0 where every target is met."""
    for f in figures:
        value = shown(f.value)
        print(f"{f.verdict:7} {value:>6}  {f.what}{'; ' if f.note else ''}{f.note}")
    return int(any(f.passed is False for f in figures))


def kept_tables(folder: Path) -> dict[str, dict[str, Any]]:
    """The tables of RESULTS.json by title: ``origin`` and ``figures``."""
    path = folder / "RESULTS.json"
    return json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}


def _table(figures: Sequence[Mapping[str, Any]]) -> str:
    lines = ["| figure | value | unit | target | | note |", "|---|---|---|---|---|---|"]
    for f in figures:
        value = shown(f["value"])
        verdict = {None: "", True: "pass", False: "FAIL"}[f["passed"]]
        lines.append(
            f"| {f['figure']} | {value} | {f['unit']} | {f['target'] or ''} | {verdict} "
            f"| {f['note']} |"
        )
    return "\n".join(lines) + "\n"


def _as_json(figure: Figure) -> dict[str, Any]:
    value = None if figure.value is None else float(figure.value)
    return {
        "figure": figure.what,
        "value": None if value is None or not isfinite(value) else value,  # JSON knows no NaN
        "unit": figure.unit,
        "target": str(figure.target) if figure.target else None,
        "passed": figure.passed,
        "note": figure.note,
    }


def _replace(path: Path, text: str) -> None:
    part = path.with_name(f".{path.name}.part")
    part.write_text(text, encoding="utf-8")
    os.replace(part, path)
