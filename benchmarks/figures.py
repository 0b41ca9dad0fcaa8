"""Figures of a benchmark, some with a target, and the two files that they are written to."""

from __future__ import annotations

import json
import os
import platform
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from math import inf, isfinite
from pathlib import Path
from typing import Any

PACKAGES = ("mujoco", "numba", "numpy", "scipy", "mcap")
PREAMBLE = """\
# Benchmarks

Written by `python -m benchmarks` (`make bench`). Ratios are of runs in turn (A B A B) on one
machine, median of the rounds; figures in seconds or nanoseconds hold for that machine alone.
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


def machine() -> str:
    """The machine that the figures were measured on."""
    versions = ", ".join(f"{name} {version(name)}" for name in PACKAGES)
    return f"{os.cpu_count()} CPUs, Python {platform.python_version()}, {versions}"


def write_results(results: Mapping[str, Sequence[Figure]], folder: Path) -> None:
    """Bring RESULTS.md and RESULTS.json in the folder up to date, whole or not at all.

    Benchmarks that were not run keep the figures they had.
    """
    kept = _kept(folder / "RESULTS.json")
    fresh = {title: [_as_json(f) for f in figures] for title, figures in results.items()}
    benchmarks = {**kept, **fresh}
    sections = "\n".join(f"## {title}\n\n{_table(rows)}" for title, rows in benchmarks.items())
    _replace(folder / "RESULTS.md", f"{PREAMBLE}\n{machine()}\n\n{sections}")
    content = {"machine": machine(), "benchmarks": benchmarks}
    _replace(folder / "RESULTS.json", json.dumps(content, indent=1) + "\n")


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


def _kept(path: Path) -> dict[str, list[dict[str, Any]]]:
    return json.loads(path.read_text(encoding="utf-8"))["benchmarks"] if path.is_file() else {}


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
