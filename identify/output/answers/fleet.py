"""The JSON of `twin fleet`."""

from __future__ import annotations

from typing import Any

from identify.output.answers import Answer, File


class IngestAnswer(Answer):
    """What `twin fleet ingest` prints: what became of the logs below the folder."""

    folder: File
    store: File
    logs: int
    fitted: int
    known: int
    """Logs whose record was there before."""
    faulty: int
    unfinished: int
    """Logs that are being written, or cannot be read now; they are tried again the next time."""
    told: list[str]
    """The first of the bad ones, a line each; all are in the view findings."""


class SqlAnswer(Answer):
    """What `twin fleet sql` prints."""

    columns: list[str]
    rows: list[list[Any]]
