"""Tables of measurements for the tests of the importers, and maps that fit them."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from scipy.io import savemat

from twin.errors import InputError
from twin.importers import ImportMap, load_mapping
from twin.importers.guess import propose

RATE = 2000.0
COUNT = 300

MAP = """
sample_rate = 2000.0
[axes.x]
force_constant = 53.4
position = {column = "q", unit = "mm", offset = 2.0, sign = -1}
current = {column = "i", unit = "mA"}
"""


def map_of(
    position: str, force: str, *, units: tuple[str, str] = ("mm", "N"), axis: str = "x",
    clock: str = "sample_rate = 1000.0",
) -> str:  # fmt: skip
    """A map of two columns. clock: its first line, or the column of times in a unit, "t in s"."""
    column, _, unit = clock.partition(" in ")
    first = f'time = {{column = "{column}", unit = "{unit}"}}' if unit else clock
    return (
        f'{first}\n[axes.{axis}]\nposition = {{column = "{position}", unit = "{units[0]}"}}\n'
        f'force = {{column = "{force}", unit = "{units[1]}"}}\n'
    )


def table() -> dict[str, np.ndarray]:
    """Columns t (s), q (mm), i (mA, whole numbers) and one that no map names."""
    t = np.arange(COUNT) / RATE
    return {
        "t": t,
        "q": 1e3 * np.sin(7.0 * t),
        "i": np.arange(COUNT) % 17 - 8,
        "unused": np.full(COUNT, np.nan),
    }


def mapping(folder: Path, text: str = MAP) -> ImportMap:
    """The map of that text."""
    path = folder / "map.toml"
    path.write_text(text, encoding="utf-8")
    return load_mapping(path)


class Guess(NamedTuple):
    """A proposed map to which the user has added nothing: its text, and what it lacks."""

    text: str
    missing: tuple[str, ...]


def guess_map(path: Path) -> Guess:
    """What is proposed for a file."""
    found = propose(path)
    return Guess(found.map_text({}), found.lacks({}))


def write_csv(path: Path, columns: dict[str, np.ndarray], delimiter: str = ",") -> None:
    """Names in the first line, every digit of the numbers."""
    rows = zip(*columns.values(), strict=True)
    lines = [delimiter.join(columns), *(delimiter.join(repr(float(v)) for v in r) for r in rows)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def csv_columns(text: str) -> dict[str, np.ndarray]:
    """The columns of a text table by name."""
    head, *rows = text.splitlines()
    columns = np.loadtxt(rows, delimiter=",", ndmin=2).T
    return dict(zip(head.split(","), columns, strict=True))


def write_mat(path: Path, columns: dict[str, np.ndarray]) -> None:
    savemat(path, {**columns, "gain": 3.0, "title": "run 7"})


def write_mat_struct(path: Path, columns: dict[str, np.ndarray]) -> None:
    savemat(path, {"run": {"data": columns}})


def write_mat_matrix(path: Path, columns: dict[str, np.ndarray]) -> None:
    savemat(path, {"log": np.column_stack(list(columns.values()))})


def write_mat73(path: Path, columns: dict[str, np.ndarray]) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, column in columns.items():
            file[f"run/{name}"] = column[None, :]  # MATLAB writes a column as one row
        file["#refs#/a"] = np.arange(3.0)
    with open(path, "r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file".ljust(512, b" "))


def write_hdf5(path: Path, columns: dict[str, np.ndarray]) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        for name, column in columns.items():
            file[f"run/{name}"] = column


def write_hdf5_records(path: Path, columns: dict[str, np.ndarray]) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        records = np.empty(
            len(next(iter(columns.values()))),
            [(name, column.dtype) for name, column in columns.items()],
        )
        for name, column in columns.items():
            records[name] = column
        file["log"] = records


def write_parquet(path: Path, columns: dict[str, np.ndarray]) -> None:
    pyarrow, parquet = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    parquet.write_table(pyarrow.table(columns), path, row_group_size=100)


def write_tdms(path: Path, columns: dict[str, np.ndarray], step: float = 1.0 / RATE) -> None:
    """Of a waveform with a sample every ``step`` (s)."""
    nptdms = pytest.importorskip("nptdms")
    period = {"wf_increment": step}
    channels = [nptdms.ChannelObject("run", n, c, period) for n, c in columns.items()]
    with nptdms.TdmsWriter(str(path)) as writer:
        writer.write_segment(channels)


def refusal_of(path: Path) -> str:
    """What is said of a file that is refused, or of which something is asked."""
    try:
        return "; ".join(propose(path).lacks({}))
    except InputError as refused:
        return str(refused)
