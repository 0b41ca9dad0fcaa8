"""The same measurements in every format give the same log."""

import hashlib
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from import_cases import (
    COUNT,
    MAP,
    RATE,
    mapping,
    table,
    write_csv,
    write_hdf5,
    write_hdf5_records,
    write_mat,
    write_mat73,
    write_mat_matrix,
    write_mat_struct,
    write_parquet,
    write_tdms,
)
from scipy.io import loadmat

from twin.errors import InputError
from twin.importers import import_log, load_mapping
from twin.logs import read_log, write_log

EMPS_MAP = Path(__file__).parents[3] / "examples" / "import_emps.toml"


Write = Callable[[Path, dict[str, np.ndarray]], None]
FORMATS: dict[str, tuple[Write, str, str, str]] = {
    # writer, file, names of the columns q and i in it, format found
    "csv": (write_csv, "log.csv", "{}", "csv"),
    "mat": (write_mat, "log.mat", "{}", "mat"),
    "mat struct": (write_mat_struct, "log.mat", "run.data.{}", "mat"),
    "mat matrix": (write_mat_matrix, "log.mat", "log[{}]", "mat"),
    "mat 7.3": (write_mat73, "log.mat", "run.{}", "mat"),
    "hdf5": (write_hdf5, "log.h5", "run/{}", "hdf5"),
    "hdf5 records": (write_hdf5_records, "log.hdf5", "log/{}", "hdf5"),
    "parquet": (write_parquet, "log.parquet", "{}", "parquet"),
    "tdms": (write_tdms, "log.tdms", "run/{}", "tdms"),
}


def named(pattern: str, map_text: str = MAP) -> str:
    q, i = ("2", "3") if "[" in pattern else ("q", "i")
    return map_text.replace('"q"', f'"{pattern.format(q)}"').replace(
        '"i"', f'"{pattern.format(i)}"'
    )


@pytest.mark.parametrize("case", FORMATS)
def test_every_format_gives_the_same_log(tmp_path: Path, case: str) -> None:
    write, name, pattern, found = FORMATS[case]
    path = tmp_path / name
    write(path, table())
    text = named(pattern)
    log = import_log(path, mapping(tmp_path, text))
    axis = log.axes["x"]
    assert log.sample_rate == RATE
    np.testing.assert_allclose(axis.position, -1e-3 * (table()["q"] + 2.0), rtol=1e-15, atol=1e-18)
    np.testing.assert_allclose(axis.force, 53.4e-3 * table()["i"], rtol=1e-15)
    assert log.metadata == {
        "source": "import",
        "original_format": found,
        "original_sha256": hashlib.sha256(path.read_bytes()).hexdigest(),
        "import_map": text,
    }


@pytest.mark.parametrize("case", FORMATS)
def test_a_missing_column_is_answered_with_those_there_are(tmp_path: Path, case: str) -> None:
    write, name, pattern, _ = FORMATS[case]
    write(tmp_path / name, table())
    text = named(pattern).replace('"mA"', '"A"').replace(f'"{pattern.format("i")}"', '"amps"')
    text = text.replace('"log[3]"', '"amps"')
    with pytest.raises(InputError, match=r"no column 'amps'; .*columns: ") as raised:
        import_log(tmp_path / name, mapping(tmp_path, text))
    there = "log[2]" if "[" in pattern else "log" if "records" in case else pattern.format("q")
    assert there in str(raised.value)


@pytest.mark.parametrize("case", [c for c in FORMATS if c != "csv"])
def test_a_damaged_file_is_one_line(tmp_path: Path, case: str) -> None:
    write, name, pattern, _ = FORMATS[case]
    path = tmp_path / name
    write(path, table())
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 3])
    with pytest.raises(InputError, match=name) as raised:
        import_log(path, mapping(tmp_path, named(pattern)))
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize(
    ("case", "module", "package"),
    [
        ("hdf5", "h5py", "h5py"),
        ("parquet", "pyarrow.parquet", "pyarrow"),
        ("tdms", "nptdms", "nptdms"),
    ],
)
def test_a_missing_package_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, case: str, module: str, package: str
) -> None:
    write, name, pattern, _ = FORMATS[case]
    write(tmp_path / name, table())
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(InputError, match=rf"needs the package {package}.*proton-twin\[import\]"):
        import_log(tmp_path / name, mapping(tmp_path, named(pattern)))


def test_tdms_states_its_own_rate(tmp_path: Path) -> None:
    write_tdms(tmp_path / "log.tdms", table())
    without = named("run/{}").replace("sample_rate = 2000.0", "")
    assert import_log(tmp_path / "log.tdms", mapping(tmp_path, without)).sample_rate == RATE
    wrong = named("run/{}").replace("2000.0", "1000.0")
    with pytest.raises(InputError, match="sampled at 2000 Hz, the map says 1000 Hz"):
        import_log(tmp_path / "log.tdms", mapping(tmp_path, wrong))


def test_dates_are_times(tmp_path: Path) -> None:
    columns = table()
    columns["t"] = np.datetime64("2024-05-01T12:00:00", "us") + np.arange(COUNT) * np.timedelta64(
        500, "us"
    )
    write_parquet(tmp_path / "log.parquet", columns)
    text = MAP.replace("sample_rate = 2000.0", 'time = {column = "t", unit = "s"}')
    assert import_log(tmp_path / "log.parquet", mapping(tmp_path, text)).sample_rate == RATE
    with pytest.raises(InputError, match="holds dates"):
        import_log(
            tmp_path / "log.parquet", mapping(tmp_path, text.replace('unit = "s"', 'unit = "ms"'))
        )


def test_text_and_empty_cells_are_refused(tmp_path: Path) -> None:
    columns = {**table(), "q": np.array([str(k) for k in range(COUNT)])}
    write_parquet(tmp_path / "log.parquet", columns)
    with pytest.raises(InputError, match=r"column 'q' does not hold one real number .* row 1"):
        import_log(tmp_path / "log.parquet", mapping(tmp_path))
    columns["q"] = [*range(7), None, *range(COUNT - 8)]  # type: ignore[assignment]
    write_parquet(tmp_path / "log.parquet", columns)
    with pytest.raises(InputError, match="column 'q' is nan in row 8 of 300"):
        import_log(tmp_path / "log.parquet", mapping(tmp_path))


def test_columns_of_different_length_are_refused(tmp_path: Path) -> None:
    write_mat(tmp_path / "log.mat", {**table(), "i": np.arange(COUNT - 1)})
    with pytest.raises(InputError, match="column 'q' has 300 rows, 'i' has 299"):
        import_log(tmp_path / "log.mat", mapping(tmp_path))


def test_an_unknown_ending_or_format_is_refused(tmp_path: Path) -> None:
    write_csv(tmp_path / "log.xyz", table())
    with pytest.raises(InputError, match=r"ends in '\.xyz', known are \.csv"):
        import_log(tmp_path / "log.xyz", mapping(tmp_path))
    stated = mapping(tmp_path, 'format = "csv"\n' + MAP)
    assert len(import_log(tmp_path / "log.xyz", stated)) == COUNT
    with pytest.raises(InputError, match="format = 'xlsx'; allowed: csv, mat"):
        import_log(tmp_path / "log.xyz", mapping(tmp_path, 'format = "xlsx"\n' + MAP))


def test_a_log_without_a_rate_is_refused(tmp_path: Path) -> None:
    write_mat(tmp_path / "log.mat", table())
    with pytest.raises(InputError, match=r"log\.mat: does not state its sample rate"):
        import_log(tmp_path / "log.mat", mapping(tmp_path, MAP.replace("sample_rate = 2000.0", "")))


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none\.csv: cannot be read"):
        import_log(tmp_path / "none.csv", mapping(tmp_path))


def test_an_import_survives_the_log_format(tmp_path: Path) -> None:
    write_mat(tmp_path / "log.mat", table())
    text = MAP.replace('"mm", offset = 2.0', '"deg"').replace('"mA"', '"A"')
    log = import_log(tmp_path / "log.mat", mapping(tmp_path, text))
    write_log(log, tmp_path / "log.mcap")
    back = read_log(tmp_path / "log.mcap")
    assert back.metadata.items() >= log.metadata.items()
    assert back.axes["x"].units["position"] == "rad"
    np.testing.assert_array_equal(back.axes["x"].position, log.axes["x"].position)


def test_the_emps_drive_is_imported(shared_data: Path) -> None:
    log = import_log(shared_data / "emps" / "DATA_EMPS.mat", load_mapping(EMPS_MAP))
    axis = log.axes["x"]
    assert (len(log), log.sample_rate) == (24_841, 1000.0)
    assert set(axis.columns) == {"position", "setpoint_position", "force"}
    record = loadmat(shared_data / "emps" / "DATA_EMPS.mat")  # by SciPy, in m and V
    np.testing.assert_array_equal(axis.position, record["qm"].ravel())
    np.testing.assert_allclose(axis.force, record["gtau"].item() * record["vir"].ravel())
