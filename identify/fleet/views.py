"""The views fits and findings of a store, in DuckDB."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from identify.fleet.columns import RECORD, VIEWS
from identify.fleet.store import Contents, table
from twin.engine import needed

KINDS = {"fits": "fit", "findings": "finding"}


def connected(contents: Contents) -> Any:
    """A connection with the views fits and findings of files that were found good."""
    base = needed("duckdb").connect()
    base.execute("SET enable_progress_bar = false")
    source = _rows_of(base, contents)
    for view, kind in KINDS.items():
        names = ", ".join(c.name for c in VIEWS[view])
        base.execute(f"CREATE VIEW {view} AS SELECT {names} FROM {source} WHERE kind = '{kind}'")
    return base


def _rows_of(base: Any, contents: Contents) -> str:
    """The rows of all files, each once: a killed run leaves a record packed and unpacked."""
    if not contents.paths:
        base.register("nothing", table((), RECORD))
        return "nothing"
    doubled = _doubled(base, contents)
    singles = [path for path in contents.singles if path.stem not in doubled]
    return f"read_parquet({listed([*contents.packed, *singles])})"


def _doubled(base: Any, contents: Contents) -> set[str]:
    """The keys of single records that are packed as well."""
    if not contents.packed or not contents.singles:
        return set()
    keys = [path.stem for path in contents.singles]
    packed = f"SELECT DISTINCT key FROM read_parquet({listed(contents.packed)})"
    rows = base.execute(f"{packed} WHERE list_contains($1, key)", [keys]).fetchall()
    return {key for (key,) in rows}


def listed(paths: Sequence[Path]) -> str:
    """Paths as a list in SQL."""
    texts = (str(p).replace("'", "''") for p in paths)
    return "[" + ", ".join(f"'{text}'" for text in texts) + "]"
