"""Pictures of a self-test: its confusion matrix, and stated confidence against how often right."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from identify.selftest.calibration import reliability
from identify.selftest.case import NOTHING
from identify.selftest.tally import AMBIGUOUS, SHAPE, UNEXPLAINED, confusion
from identify.selftest.trial import TrialResult
from twin.errors import InputError
from twin.files import write_atomically

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FORMATS = (".png", ".svg", ".pdf")


def draw(results: Sequence[TrialResult], path: Path) -> None:
    """Write the picture. Raises InputError for another ending than .png, .svg or .pdf."""
    require_format(path)
    from matplotlib.figure import Figure

    table = confusion(results)
    rows = [*sorted(r for r in table if r != NOTHING), *([NOTHING] if NOTHING in table else [])]
    named = {a for row in table.values() for a in row} - {AMBIGUOUS, NOTHING, UNEXPLAINED, SHAPE}
    columns = [*sorted(named | (set(rows) - {NOTHING})), AMBIGUOUS, SHAPE, UNEXPLAINED, NOTHING]
    figure = Figure(figsize=(2.6 + 0.27 * len(columns), 2.3 + 0.25 * len(rows)), dpi=110)
    axes = figure.subplots()
    axes.imshow(_shares(table, rows, columns), cmap="Blues", vmin=0.0, vmax=1.0, aspect="auto")
    for i, row in enumerate(rows):
        for j, column in enumerate(columns):
            share = table[row].get(column, 0.0)
            if share:
                axes.text(
                    j, i, f"{100 * share:.0f}", ha="center", va="center", fontsize=6.5,
                    color="white" if share > 0.6 else "black",
                )  # fmt: skip
    axes.set_xticks(range(len(columns)), [c.replace("_", " ") for c in columns], rotation=90)
    axes.set_yticks(range(len(rows)), [r.replace("_", " ") for r in rows])
    axes.tick_params(labelsize=7.5, length=0)
    axes.set_xlabel("answer of the diagnosis, % of the trials")
    axes.set_ylabel("planted effect")
    axes.set_xticks(np.arange(len(columns)) - 0.5, minor=True)
    axes.set_yticks(np.arange(len(rows)) - 0.5, minor=True)
    axes.grid(which="minor", color="0.9", linewidth=0.5)
    _write(figure, path)


def draw_reliability(results: Sequence[TrialResult], path: Path) -> None:
    """Stated confidence against how often right, with 95 % intervals. Raises InputError as draw."""
    require_format(path)
    from matplotlib.figure import Figure

    tenths = reliability(results)
    stated = np.array([100.0 * t.stated for t in tenths])
    right = np.array([100.0 * t.right.value for t in tenths])
    ends = 100.0 * np.array([t.right.interval for t in tenths]).reshape(-1, 2).T
    figure = Figure(figsize=(4.2, 4.0), dpi=110)
    axes = figure.subplots()
    axes.plot([0, 100], [0, 100], color="0.7", linewidth=1.0)
    axes.errorbar(stated, right, yerr=np.abs(ends - right), fmt="o", capsize=3)
    for x, y, tenth in zip(stated, right, tenths, strict=True):
        axes.annotate(f"{tenth.right.trials}", (x, y), (6, -10), textcoords="offset points")
    axes.set(xlim=(0, 100), ylim=(0, 100), xlabel="stated confidence, %", ylabel="right, %")
    axes.set_title("answers in each tenth beside the points", fontsize=9)
    _write(figure, path)


def require_format(path: Path) -> None:
    """Raise InputError for another ending than .png, .svg or .pdf."""
    if path.suffix not in FORMATS:
        raise InputError(f"{path}: give a name that ends in {', '.join(FORMATS)}")


def _write(figure: Figure, path: Path) -> None:
    figure.tight_layout()
    content = BytesIO()
    figure.savefig(content, format=path.suffix[1:])
    write_atomically(path, content.getvalue())


def _shares(
    table: Mapping[str, Mapping[str, float]], rows: Sequence[str], columns: Sequence[str]
) -> np.ndarray:
    return np.array([[table[r].get(c, 0.0) for c in columns] for r in rows])
