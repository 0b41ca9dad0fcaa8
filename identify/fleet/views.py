"""The views fits and findings of a store, in DuckDB."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from identify.fleet.columns import RECORD, VIEWS
from identify.fleet.engine import needed
from identify.fleet.store import Contents, table

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
    files = listed(contents.paths)
    named = f"read_parquet({files}, filename = true)"
    places, keys = base.execute(
        f"SELECT sum(files), count(*) FROM (SELECT count(DISTINCT filename) AS files FROM {named} "
        "GROUP BY key)"
    ).fetchone()
    if places == keys:
        return f"read_parquet({files})"
    base.execute(
        f"CREATE TABLE places AS SELECT key, min(filename) AS filename FROM {named} GROUP BY key"
    )
    return f"(SELECT r.* FROM {named} r JOIN places USING (key, filename))"


def listed(paths: Sequence[Path]) -> str:
    """Paths as a list in SQL."""
    texts = (str(p).replace("'", "''") for p in paths)
    return "[" + ", ".join(f"'{text}'" for text in texts) + "]"
