"""What is said of a fleet."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from identify.output.numbers import NOTHING, number
from identify.results.fleet import Ingested


def ingested_in_words(done: Ingested) -> str:
    """What became of the logs of a folder."""
    counts = {
        "fitted": done.fitted, "known before": done.known, "faulty": done.faulty,
        "still being written": done.unfinished,
    }  # fmt: skip
    parts = ", ".join(f"{count} {what}" for what, count in counts.items() if count)
    return f"{done.store}: {done.logs} logs, {parts or 'nothing to do'}"


def table_text(columns: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """A table for the terminal, its columns one below the other."""
    lines = [list(columns), *([_cell(value) for value in row] for row in rows)]
    widths = [max(len(line[i]) for line in lines) for i in range(len(columns))]
    return "\n".join("  ".join(c.ljust(w) for c, w in zip(line, widths, strict=True)).rstrip()
                     for line in lines)  # fmt: skip


def _cell(value: Any) -> str:
    if value is None:
        return NOTHING
    digits = 6  # significant, of a number that may be used elsewhere
    return number(value, digits) if isinstance(value, float) else str(value)
