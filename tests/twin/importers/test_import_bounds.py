"""A small file that announces a large table costs neither time nor memory."""

import zlib
from pathlib import Path
from struct import pack

import numpy as np
import pytest
import scipy.io
from import_cases import map_of, mapping

from twin.errors import InputError
from twin.importers import import_log
from twin.importers.formats import content_bytes

MAP = map_of("q", "q")
ZEROS = 10**11  # samples


def write_hdf5(path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        file.create_dataset("q", shape=(ZEROS,), dtype="f8", chunks=(1 << 20,), compression="gzip")


def write_parquet(path: Path) -> None:
    pyarrow, parquet = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    column = pyarrow.nulls(20_000_000, pyarrow.float64())
    parquet.write_table(pyarrow.table({"q": column}), path)


def write_mat(path: Path) -> None:
    size = 1 << 28
    head = pack("<IIIIIIiiIIQII", 6, 8, 6, 0, 5, 8, 1, size // 8, 1, 1, ord("q"), 9, size)
    deflate = zlib.compressobj(9)
    data = deflate.compress(pack("<II", 14, len(head) + size) + head)
    data += deflate.flush(zlib.Z_FULL_FLUSH)  # what follows does not refer to it: it may repeat
    data += 256 * (deflate.compress(bytes(size >> 8)) + deflate.flush(zlib.Z_FULL_FLUSH))
    path.write_bytes(
        b"MATLAB 5.0 MAT-file".ljust(124) + pack("<HH", 0x0100, 0x4D49)
        + pack("<II", 15, len(data)) + data
    )  # fmt: skip


@pytest.mark.parametrize(
    ("ending", "write"), [("h5", write_hdf5), ("parquet", write_parquet), ("mat", write_mat)]
)
def test_a_bomb_is_one_line(tmp_path, ending, write):
    path = tmp_path / f"a.{ending}"
    write(path)
    assert path.stat().st_size < 1 << 19
    with pytest.raises(InputError, match="export it again"):
        import_log(path, mapping(tmp_path, MAP))


@pytest.mark.parametrize("compressed", [False, True])
def test_memory_is_granted_for_what_a_mat_file_holds(tmp_path, compressed):
    """As many bytes as its arrays have, beside names and sizes, however they are packed."""
    path, arrays = tmp_path / "a.mat", {"q": np.zeros(300_000), "s": {"r": np.arange(70_000.0)}}
    scipy.io.savemat(path, arrays, do_compression=compressed)
    assert content_bytes(path) == pytest.approx(370_000 * 8, abs=1000)
    scipy.io.savemat(path, {"q": np.zeros(1000)}, format="4")
    assert content_bytes(path) == path.stat().st_size
    path.write_bytes(path.read_bytes()[:50])
    assert content_bytes(path) == 50
