"""A store: a folder with one Parquet file a log, named by what it was made of, and packed ones.

``records/KEY.parquet`` appears whole, by a rename, so that whoever writes it twice leaves one file.
``packed/DIGEST.parquet`` holds the rows of many, whose own files are removed behind it: a run that
is killed between leaves rows twice, which every reader counts once, by their key.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache, cached_property
from io import BytesIO
from pathlib import Path
from typing import Any

from identify.fleet.columns import RECORD, TYPES, StoreColumn
from twin.engine import needed
from twin.errors import InputError
from twin.files import lock, make_folder, write_atomically
from twin.parallel import cores

NAME = re.compile(r"[0-9a-f]{64}\.parquet")  # of a record: its key
PACK_FROM = 1000  # records from which they are packed while more are made: each is a file to open
FEW = 50  # that are left as they are in the end
Row = Mapping[str, Any]


@dataclass(frozen=True)
class Store:
    """The records below a folder."""

    root: Path

    @classmethod
    def made(cls, root: Path) -> Store:
        """A store that is there afterwards. Raises InputError where that is not possible."""
        store = cls(root)
        for folder in (store.records, store.packed):
            make_folder(folder)
        return store

    @classmethod
    def opened(cls, root: Path) -> Store:
        """A store that is there. Raises InputError."""
        store = cls(root)
        if not store.records.is_dir():
            raise InputError(
                f"--store {root}: is no store; make it with `twin fleet ingest FOLDER --store "
                f"{root}`"
            )
        return store

    @property
    def records(self) -> Path:
        return self.root / "records"

    @property
    def packed(self) -> Path:
        return self.root / "packed"

    @property
    def alarms(self) -> Path:
        """The file of what was told of these records."""
        return self.root / "alarms.parquet"

    def file(self, key: str) -> Path:
        """The file of a record."""
        return self.records / f"{key}.parquet"

    def has(self, key: str) -> bool:
        """Whether a record is there, packed or not."""
        return self.file(key).exists() or any(key in keys_of(p) for p in _packed(self.packed))

    def write(self, key: str, rows: Sequence[Row]) -> None:
        """Write a record, whole or not at all; the same rows give the same bytes."""
        write_atomically(self.file(key), parquet(table(rows, RECORD)))

    def contents(self) -> Contents:
        """What is in it now, and which files cannot be used."""
        return Contents.of(self)

    def pack(self, least: int = PACK_FROM) -> int:
        """Put records into one file where there are that many; how many that were.

        Where another run packs just now, it is left to that.
        """
        with _alone(self.root / "pack.lock") as mine:
            return self._pack(least) if mine else 0

    def _pack(self, least: int) -> int:
        pa, pq = needed("pyarrow"), needed("pyarrow.parquet")
        known = frozenset[str]().union(*(keys_of(path) for path in _packed(self.packed)))
        files = [p for p in sorted(self.records.glob("*.parquet")) if NAME.fullmatch(p.name)]
        for path in files:
            if path.stem in known:  # a run was killed before it removed them
                path.unlink(missing_ok=True)
        fresh = [path for path in files if path.stem not in known and fault(path) is None]
        if len(fresh) < max(least, 1):
            return 0
        content = pa.concat_tables([pq.read_table(path) for path in fresh])
        digest = hashlib.sha256("\n".join(path.stem for path in fresh).encode()).hexdigest()
        write_atomically(self.packed / f"{digest}.parquet", parquet(content))
        for path in fresh:
            path.unlink(missing_ok=True)
        return len(fresh)


@dataclass(frozen=True)
class Contents:
    """The files of a store that can be read. faults: of the others, a line each."""

    singles: tuple[Path, ...]
    packed: tuple[Path, ...]
    faults: tuple[str, ...]

    @classmethod
    def of(cls, store: Store) -> Contents:
        """Look at every file; what is cut short or of another schema is told, and left out."""
        found: dict[Path, list[Path]] = {store.records: [], store.packed: []}
        paths = [path for folder in found for path in sorted(folder.glob("*.parquet"))]
        faults = []
        with ThreadPoolExecutor(cores()) as pool:  # to read the end of a file waits for the disk
            for path, why in zip(paths, pool.map(fault, paths), strict=True):
                if why is None:
                    found[path.parent].append(path)
                else:
                    faults.append(f"{path}: {why}; its logs are computed again once it is removed")
        return cls(tuple(found[store.records]), tuple(found[store.packed]), tuple(faults))

    @property
    def paths(self) -> tuple[Path, ...]:
        """All of them, packed ones first."""
        return (*self.packed, *self.singles)

    @cached_property
    def digest(self) -> str:
        """Of which files there are; what was made of these need not be made again."""
        return hashlib.sha256("\n".join(p.name for p in self.paths).encode()).hexdigest()


def fault(path: Path) -> str | None:
    """Why a file is no record, or None where it is one."""
    pq, pa = needed("pyarrow.parquet"), needed("pyarrow")
    if not NAME.fullmatch(path.name):
        return "is not named as a record is"
    try:
        found = pq.read_schema(path)
    except (OSError, pa.ArrowException) as error:
        return f"cannot be read ({_first(error)})"
    return None if found.equals(schema(RECORD)) else "has other columns than a record has"


@cache
def schema(columns: tuple[StoreColumn, ...]) -> Any:
    """The Arrow schema of columns, without metadata."""
    pa = needed("pyarrow")
    kinds = {c.name: TYPES.get(c.kind) for c in columns}
    return pa.schema(
        [(n, getattr(pa, kind)() if kind else pa.timestamp("us")) for n, kind in kinds.items()]
    )


def table(rows: Sequence[Row], columns: tuple[StoreColumn, ...]) -> Any:
    """Rows as an Arrow table; an entry that a row lacks is null."""
    pa, known = needed("pyarrow"), schema(columns)
    arrays = [pa.array([row.get(f.name) for row in rows], f.type) for f in known]
    return pa.table(arrays, schema=known)


def parquet(content: Any) -> bytes:
    """An Arrow table as a Parquet file."""
    stream = BytesIO()
    needed("pyarrow.parquet").write_table(content, stream, compression="zstd")
    return stream.getvalue()


@cache  # a packed file has the name of what is in it, and never changes
def keys_of(path: Path) -> frozenset[str]:
    """The keys of a packed file; none of one that cannot be read."""
    pq = needed("pyarrow.parquet")
    if fault(path) is not None:
        return frozenset()
    return frozenset(pq.read_table(path, columns=["key"]).column(0).unique().to_pylist())


def _packed(folder: Path) -> Iterator[Path]:
    yield from sorted(folder.glob("*.parquet"))


def _first(error: BaseException) -> str:
    """The first words of what a library says, in one line."""
    most = 80  # characters
    return " ".join(str(error).split())[:most]


@contextmanager
def _alone(path: Path) -> Iterator[bool]:
    """Whether nobody else is in there; nobody comes in meanwhile."""
    with path.open("ab") as stream:
        try:
            lock(stream)
        except BlockingIOError:
            yield False
        else:
            yield True
