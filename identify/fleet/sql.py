"""Questions about a store in SQL, by DuckDB: the views fits, findings and alarms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any

from identify.fleet.columns import VIEWS, StoreColumn
from identify.fleet.kept_alarms import alarms, as_table
from identify.fleet.store import Store
from identify.fleet.views import connected, listed
from twin.engine import needed
from twin.errors import InputError
from twin.files import write_atomically

WRITERS = (".csv", ".parquet")


@dataclass(frozen=True)
class QueryRows:
    """The rows that answer a question. faults: of files of the store, a line each."""

    columns: tuple[str, ...]
    rows: list[tuple[Any, ...]]
    table: Any
    faults: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.rows)

    def write(self, path: Path) -> None:
        """Write the rows as a table. Raises InputError for an ending not in ``WRITERS``."""
        if path.suffix not in WRITERS:
            raise InputError(f"--out {path}: end the name in {' or '.join(WRITERS)}")
        stream = BytesIO()
        if path.suffix == ".csv":
            needed("pyarrow.csv").write_csv(self.table, stream)
        else:
            needed("pyarrow.parquet").write_table(self.table, stream)
        write_atomically(path, stream.getvalue())


def ask(query: str, store: Store) -> QueryRows:
    """The answer to one SELECT. Raises InputError, in one line, where it is none or is wrong."""
    duckdb = needed("duckdb")
    contents = store.contents()
    with connected(contents) as base:
        try:
            statements = base.extract_statements(query)
            if len(statements) != 1 or statements[0].type != duckdb.StatementType.SELECT:
                raise InputError(f"{query:.60}: is not one SELECT; a store is only read")
            if "alarms" in query.lower():
                base.register("alarms", as_table(alarms(store, contents)))
            base.execute(f"SET allowed_paths = {listed(contents.paths)}")
            base.execute("SET enable_external_access = false")
            table = base.sql(query).to_arrow_table()
        except duckdb.Error as error:
            raise InputError(f"{' '.join(str(error).split())}; {_known()}") from error
    columns = tuple(table.column_names)
    rows = list(zip(*(c.to_pylist() for c in table.columns), strict=True)) if columns else []
    return QueryRows(columns, rows, table, contents.faults)


def _known() -> str:
    return "; ".join(f"{view} has {_names(columns)}" for view, columns in VIEWS.items())


def _names(columns: Sequence[StoreColumn]) -> str:
    return ", ".join(c.name for c in columns)
