"""The confusion matrix of a self-test as a picture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from io import BytesIO
from pathlib import Path

import numpy as np

from identify.selftest.tally import AMBIGUOUS, NOTHING, UNEXPLAINED, confusion
from identify.selftest.trial import TrialResult
from twin.errors import InputError
from twin.files import write_atomically

FORMATS = (".png", ".svg", ".pdf")


def draw(results: Sequence[TrialResult], path: Path) -> None:
    """Write the picture. Raises InputError for another ending than .png, .svg or .pdf."""
    if path.suffix not in FORMATS:
        raise InputError(f"{path}: give a name that ends in {', '.join(FORMATS)}")
    from matplotlib.figure import Figure

    table = confusion(results)
    rows = [*sorted(r for r in table if r != NOTHING), *([NOTHING] if NOTHING in table else [])]
    named = {a for row in table.values() for a in row} - {AMBIGUOUS, NOTHING, UNEXPLAINED}
    columns = [*sorted(named | (set(rows) - {NOTHING})), AMBIGUOUS, UNEXPLAINED, NOTHING]
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
    figure.tight_layout()
    content = BytesIO()
    figure.savefig(content, format=path.suffix[1:])
    write_atomically(path, content.getvalue())


def _shares(
    table: Mapping[str, Mapping[str, float]], rows: Sequence[str], columns: Sequence[str]
) -> np.ndarray:
    return np.array([[table[r].get(c, 0.0) for c in columns] for r in rows])
