"""A small file that announces a large table costs neither time nor memory."""

from __future__ import annotations

import zlib
from pathlib import Path
from struct import pack

import numpy as np
import pytest
import scipy.io
from import_cases import mapping

from twin.errors import InputError
from twin.importers import import_log, mat, table

MAP = """
sample_rate = 1000.0
[axes.x]
position = {column = "q", unit = "m"}
force = {column = "q", unit = "N"}
"""
ZEROS = 10**11  # samples


def write_hdf5(path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        file.create_dataset("q", shape=(ZEROS,), dtype="f8", chunks=(1 << 20,), compression="gzip")


def write_parquet(path: Path) -> None:
    pyarrow, parquet = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    column = pyarrow.DictionaryArray.from_arrays(
        pyarrow.array(np.zeros(20_000_000, np.int8)), pyarrow.array([0.0])
    )
    parquet.write_table(pyarrow.table({"q": column}), path)


def write_mat(path: Path) -> None:
    size = 1 << 26
    head = pack("<IIIIIIiiIIQII", 6, 8, 6, 0, 5, 8, 1, size // 8, 1, 1, ord("q"), 9, size)
    deflate = zlib.compressobj(9)
    data = deflate.compress(pack("<II", 14, len(head) + size) + head)
    data += b"".join(deflate.compress(bytes(1 << 20)) for _ in range(64)) + deflate.flush()
    path.write_bytes(
        b"MATLAB 5.0 MAT-file".ljust(124) + pack("<HH", 0x0100, 0x4D49)
        + pack("<II", 15, len(data)) + data
    )  # fmt: skip


@pytest.mark.parametrize(
    ("ending", "write"), [("h5", write_hdf5), ("parquet", write_parquet), ("mat", write_mat)]
)
def test_a_bomb_is_one_line(tmp_path, monkeypatch, ending, write):
    monkeypatch.setattr("twin.importers.table.SMALLEST_TABLE", 1 << 20)
    path = tmp_path / f"a.{ending}"
    write(path)
    assert path.stat().st_size < 1 << 19
    with pytest.raises(InputError, match="export it again"):
        import_log(path, mapping(tmp_path, MAP))


def test_what_a_file_announces_counts_in_bytes(tmp_path, monkeypatch):
    """Zeros in one chunk, of 8 bytes each, against the most that such a file may hold."""
    h5py = pytest.importorskip("h5py")
    path, count = tmp_path / "a.h5", 100_000
    with h5py.File(path, "w") as file:
        file.create_dataset("q", data=np.zeros(count), compression="gzip")
    size = 8 * count
    for least, allowed in ((0.9 * size, False), (1.1 * size, True)):
        own = table.LARGEST_RATIO * path.stat().st_size
        monkeypatch.setattr(table, "SMALLEST_TABLE", least - own)
        if allowed:
            assert len(import_log(path, mapping(tmp_path, MAP))) == count
        else:
            with pytest.raises(InputError, match="export it again"):
                import_log(path, mapping(tmp_path, MAP))


@pytest.mark.parametrize("compressed", [False, True])
def test_memory_is_granted_for_what_a_mat_file_holds(tmp_path, compressed):
    """As many bytes as its arrays have, beside names and sizes, however they are packed."""
    path, arrays = tmp_path / "a.mat", {"q": np.zeros(300_000), "s": {"r": np.arange(70_000.0)}}
    scipy.io.savemat(path, arrays, do_compression=compressed)
    assert mat.content_bytes(path) == pytest.approx(370_000 * 8, abs=1000)
    scipy.io.savemat(path, {"q": np.zeros(1000)}, format="4")
    assert mat.content_bytes(path) == path.stat().st_size
    path.write_bytes(path.read_bytes()[:50])
    assert mat.content_bytes(path) == 50
