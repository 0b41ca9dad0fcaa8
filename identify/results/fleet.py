"""The results of a fleet: what was ingested, what changed, how each machine stands."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Ingested:
    """What became of the logs below a folder; told: of bad ones, a line each.

    fitted and faulty ones have a record now, known ones had one, unfinished ones are being written.
    """

    folder: Path
    store: Path
    logs: int
    fitted: int
    known: int
    faulty: int
    unfinished: int
    told: tuple[str, ...] = ()
