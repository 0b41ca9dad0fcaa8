"""Laws of the importers: every column of every format becomes its own signal, in SI.

SI value = sign x (scale x raw + offset) x unit, moved back by its delay, written out here once for
seven columns of one axis and three of another whose every number differs.
"""

import hashlib
import math
import sys
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from struct import pack

import numpy as np
import pytest
from import_cases import (
    COUNT,
    MAP,
    RATE,
    map_of,
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
from scipy.io import loadmat, savemat

from twin.errors import InputError
from twin.importers import import_log, load_mapping
from twin.importers.dialects.mat import content_bytes
from twin.importers.importer import table_of
from twin.importers.mapping import EVERY_COLUMN
from twin.importers.table import numbers, require_columns, split_columns
from twin.logs.log import FIELDS

EMPS_MAP = Path(__file__).parents[3] / "examples" / "import_emps.toml"
ROWS = 24


@dataclass(frozen=True)
class Signal:
    """One entry of the map: the column's name in the file, unit and its size in SI, the rest."""

    axis: str
    field: str
    column: str
    unit: str
    size: float
    scale: float
    offset: float
    sign: int
    delay: int

    def entry(self, name: str) -> str:
        return (
            f'{self.field} = {{column = "{name}", unit = "{self.unit}", scale = {self.scale}, '
            f"offset = {self.offset}, sign = {self.sign}, delay_samples = {self.delay}}}"
        )


DEGREE = math.pi / 180.0
SIGNALS = (
    Signal("x", "setpoint_position", "a", "mm", 1e-3, 1.5, 3.0, 1, 0),
    Signal("x", "setpoint_velocity", "b", "mm/s", 1e-3, 1.25, -2.0, -1, 1),
    Signal("x", "setpoint_acceleration", "c", "g", 9.80665, 0.75, 5.0, 1, -1),
    Signal("x", "position", "d", "um", 1e-6, -0.5, 7.0, -1, 2),
    Signal("x", "velocity", "e", "cm/ms", 10.0, 2.5, -11.0, 1, 0),
    Signal("x", "current", "f", "mA", 1e-3, 3.5, 13.0, -1, -2),
    Signal("x", "force", "g", "kN", 1e3, 0.25, -17.0, 1, 3),
    Signal("x", "pressure", "k", "bar", 1e5, 1.75, 31.0, -1, 2),
    Signal("x", "pressure_2", "l", "hPa", 1e2, 2.25, -37.0, 1, 0),
    Signal("x", "temperature", "m", "K", 1.0, 0.5, 41.0, 1, -1),
    Signal("y", "position", "h", "deg", DEGREE, 4.5, 19.0, -1, 1),
    Signal("y", "velocity", "i", "rpm", math.pi / 30.0, 5.5, -23.0, 1, 0),
    Signal("y", "force", "j", "V", 1.0, 6.5, 29.0, -1, -1),
)
assert tuple(s.field for s in SIGNALS if s.axis == "x") == FIELDS
FIRST, LAST = 2, ROWS - 3  # the delays of -2 and 3 leave these rows


def raw(signal: Signal) -> np.ndarray:
    """Whole numbers that stand in no other column, so that every format keeps them."""
    k = np.arange(ROWS)
    return 1000.0 * (1 + ord(signal.column) - ord("a")) + k**2 % 17 + 20.0 * k


def expected(signal: Signal) -> np.ndarray:
    moved = raw(signal)[FIRST + signal.delay : LAST + signal.delay]
    return signal.sign * (signal.scale * moved + signal.offset) * signal.size


Columns = dict[str, np.ndarray]
CASES: dict[str, tuple[Callable[[Path, Columns], None], str, str, str]] = {
    # writer, file, name of a column by its name and number, format found
    "csv": (write_csv, "log.csv", "{0}", "csv"),
    "mat": (write_mat, "log.mat", "{0}", "mat"),
    "mat struct": (write_mat_struct, "log.mat", "run.data.{0}", "mat"),
    "mat matrix": (write_mat_matrix, "log.mat", "log[{1}]", "mat"),
    "mat 7.3": (write_mat73, "log.mat", "run.{0}", "mat"),
    "hdf5": (write_hdf5, "log.h5", "run/{0}", "hdf5"),
    "hdf5 records": (write_hdf5_records, "log.he5", "log/{0}", "hdf5"),
    "parquet": (write_parquet, "log.pq", "{0}", "parquet"),
    "tdms": (write_tdms, "log.tdms", "run/{0}", "tdms"),
}


def file_columns() -> Columns:
    """The columns in another order than the map's, the times among them."""
    order = np.random.default_rng(4).permutation(len(SIGNALS))
    columns = {SIGNALS[k].column: raw(SIGNALS[k]) for k in order[:5]}
    columns["t"] = 3.0 + np.arange(ROWS) / RATE
    return columns | {SIGNALS[k].column: raw(SIGNALS[k]) for k in order[5:]}


def map_text(pattern: str, clock: str) -> str:
    names = {name: pattern.format(name, k) for k, name in enumerate(file_columns(), 1)}
    time = f'time = {{column = "{names["t"]}", unit = "s"}}'
    lines = [time if clock == "time" else f"sample_rate = {RATE}"]
    for axis, constant in (("x", 7.25), ("y", 0.5)):
        lines += [f"[axes.{axis}]", f"force_constant = {constant}"]
        lines += [s.entry(names[s.column]) for s in SIGNALS if s.axis == axis]
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize(("case", "clock"), [*((c, "time") for c in CASES), ("csv", "rate")])
def test_every_column_of_every_format_is_its_own_signal_in_si(tmp_path, case, clock):
    write, file, pattern, found = CASES[case]
    path, text = tmp_path / file, map_text(pattern, clock)
    write(path, file_columns())
    log = import_log(path, mapping(tmp_path, text))
    assert (log.sample_rate, len(log)) == (RATE, LAST - FIRST)
    assert (log.axes["x"].force_constant, log.axes["y"].force_constant) == (7.25, 0.5)
    assert log.axes["x"].units["position"] == "m"
    assert (log.axes["y"].units["position"], log.axes["y"].units["force"]) == ("rad", "N m")
    for signal in SIGNALS:
        got = log.axes[signal.axis].columns[signal.field]
        np.testing.assert_allclose(got, expected(signal), rtol=1e-13, err_msg=signal.column)
    assert log.metadata == {
        "source": "import",
        "original_format": found,
        "original_sha256": hashlib.sha256(path.read_bytes()).hexdigest(),
        "import_map": text,
    }


def named(pattern: str, map_text: str = MAP) -> str:
    """The map of the table with the names of a format."""
    for number, name in ((2, "q"), (3, "i")):
        map_text = map_text.replace(f'"{name}"', f'"{pattern.format(name, number)}"')
    return map_text


@pytest.mark.parametrize("case", CASES)
def test_a_missing_column_is_answered_with_those_there_are(tmp_path, case):
    write, name, pattern, _ = CASES[case]
    write(tmp_path / name, table())
    text = named(pattern).replace(f'"{pattern.format("i", 3)}"', '"amps"')
    with pytest.raises(InputError, match=r"no column 'amps'; .*columns: ") as raised:
        import_log(tmp_path / name, mapping(tmp_path, text))
    there = "log" if "records" in case else pattern.format("q", 2)
    assert there in str(raised.value)


@pytest.mark.parametrize("case", [c for c in CASES if c != "csv"])
def test_a_damaged_file_is_one_line(tmp_path: Path, case: str) -> None:
    write, name, pattern, _ = CASES[case]
    path = tmp_path / name
    write(path, table())
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 3])
    with pytest.raises(InputError, match=name) as raised:
        import_log(path, mapping(tmp_path, named(pattern)))
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize(
    ("case", "module"), [("hdf5", "h5py"), ("parquet", "pyarrow.parquet"), ("tdms", "nptdms")]
)
def test_a_missing_package_is_named(tmp_path, monkeypatch, case, module):
    write, name, pattern, _ = CASES[case]
    write(tmp_path / name, table())
    monkeypatch.setitem(sys.modules, module, None)
    package = module.partition(".")[0]
    with pytest.raises(InputError, match=rf"needs the package {package}.*pip install .*\[import\]"):
        import_log(tmp_path / name, mapping(tmp_path, named(pattern)))


def write_waveforms(*periods: float) -> Callable[[Path], None]:
    """Channels r/0, r/1 with a sample every so many s."""

    def write(path: Path) -> None:
        nptdms = pytest.importorskip("nptdms")
        with nptdms.TdmsWriter(str(path)) as writer:
            for name, period in enumerate(periods):
                given = {"wf_increment": period}
                channel = nptdms.ChannelObject("r", str(name), np.arange(4.0), given)
                writer.write_segment([channel])

    return write


def changed(write: Callable[[Path, Columns], None], **columns: object) -> Callable[[Path], None]:
    """The table with other columns."""
    return lambda path: write(path, {**table(), **columns})  # type: ignore[dict-item]


DATES = np.datetime64("2024-05-01T12:00:00", "us") + np.arange(COUNT) * np.timedelta64(500, "us")
RATED = "sample_rate = 2000.0"
DATED = MAP.replace(RATED, 'time = {column = "t", unit = "s"}')
WAVES = map_of("r/0", "r/1", clock="sample_rate = 50.0")
WITHOUT_RATE = map_of("r/0", "r/1", clock="")


@pytest.mark.parametrize(
    ("name", "write", "text", "rate"),
    [
        ("log.tdms", write_waveforms(0.02, 0.02), WITHOUT_RATE, 50.0),
        ("log.tdms", write_waveforms(*[0.02 / (1.0 + 0.9e-6)] * 2), WAVES, 50.0),
        ("log.parquet", changed(write_parquet, t=DATES), DATED, RATE),
        ("log.xyz", changed(write_csv), 'format = "csv"\n' + MAP, RATE),
    ],
)
def test_what_a_file_states_itself_is_believed(tmp_path, name, write, text, rate):
    write(tmp_path / name)
    assert import_log(tmp_path / name, mapping(tmp_path, text)).sample_rate == rate


@pytest.mark.parametrize(
    ("name", "write", "text", "message"),
    [
        ("log.tdms", write_waveforms(*[0.02 / (1.0 + 1.1e-6)] * 2), WAVES,
         "sampled at 50.000055 Hz, the map says 50 Hz"),
        ("log.tdms", write_waveforms(*[0.02 / (1.0 - 1.1e-6)] * 2), WAVES, "the map says 50 Hz"),
        ("log.tdms", write_waveforms(0.01, 0.02), WITHOUT_RATE,
         "'r/0' has a sample every 0.01 s, 'r/1' every 0.02 s"),
        ("log.parquet", changed(write_parquet, t=DATES), DATED.replace('"s"', '"ms"'),
         "holds dates"),
        ("log.parquet", changed(write_parquet, q=[f"no {k}" for k in range(COUNT)]), MAP,
         "column 'q' does not hold one real number .* row 1"),
        ("log.parquet", changed(write_parquet, q=[*range(7), None, *range(COUNT - 8)]), MAP,
         "column 'q' is nan in row 8 of 300"),
        ("log.mat", changed(write_mat, i=np.arange(COUNT - 1)), MAP,
         "column 'q' has 300 rows, 'i' has 299"),
        ("log.mat", changed(write_mat), MAP.replace(RATED, ""),
         r"log\.mat: does not state its sample rate"),
        ("log.xyz", changed(write_csv), MAP, r"ends in '\.xyz', known are \.csv"),
        ("log.xlsx", changed(write_csv), MAP, r"is a workbook; save the sheet"),
        ("log.xyz", changed(write_csv), 'format = "xlsx"\n' + MAP,
         "format = 'xlsx'; allowed: csv, feather, halsampler"),
        ("none.csv", lambda path: None, MAP, r"none\.csv: cannot be read"),
    ],
)  # fmt: skip
def test_what_cannot_be_a_log_is_refused(tmp_path, name, write, text, message):
    write(tmp_path / name)
    with pytest.raises(InputError, match=message):
        import_log(tmp_path / name, mapping(tmp_path, text))


def test_the_emps_drive_is_imported(shared_data: Path) -> None:
    log = import_log(shared_data / "emps" / "DATA_EMPS.mat", load_mapping(EMPS_MAP))
    axis = log.axes["x"]
    assert (len(log), log.sample_rate) == (24_841, 1000.0)
    assert set(axis.columns) == {"position", "setpoint_position", "force"}
    record = loadmat(shared_data / "emps" / "DATA_EMPS.mat")  # by SciPy, in m and V
    np.testing.assert_array_equal(axis.position, record["qm"].ravel())
    np.testing.assert_allclose(axis.force, record["gtau"].item() * record["vir"].ravel())


@pytest.mark.parametrize("delay", [-23, -22, 22])
def test_a_delay_may_leave_two_samples_and_no_fewer(tmp_path, delay):
    write_csv(tmp_path / "log.csv", {"q": np.arange(ROWS) + 1.0, "u": np.arange(ROWS) + 50.0})
    text = map_of("q", "u", units=("m", "N"))
    text = text.replace('"q"', f'"q", delay_samples = {delay}')
    left = ROWS - abs(delay)
    if left < 2:
        with pytest.raises(InputError, match=f"delay_samples of {min(0, delay)} to"):
            import_log(tmp_path / "log.csv", mapping(tmp_path, text))
        return
    axis = import_log(tmp_path / "log.csv", mapping(tmp_path, text)).axes["x"]
    rows = np.arange(max(0, -delay), ROWS - max(0, delay))
    assert axis.position.tolist() == (rows + delay + 1.0).tolist()
    assert axis.force.tolist() == (rows + 50.0).tolist()


@pytest.mark.parametrize("shape", [(2, 5), (5, 2), (1, 5), (5, 1), (2, 2)])
def test_a_matrix_is_split_along_its_shorter_side(shape):
    """A square one into its columns."""
    matrix = 10.0 * np.arange(shape[0])[:, None] + np.arange(shape[1])
    found = split_columns("m", matrix)
    long = matrix if shape[0] < shape[1] else matrix.T
    names = ["m"] if 1 in shape else ["m[1]", "m[2]"]
    assert {n: c.tolist() for n, c in found.items()} == dict(zip(names, long.tolist(), strict=True))
    assert split_columns("m", np.zeros((2, 3, 4))) == {}
    assert split_columns("m", np.array(3.0)) == {"m": np.array([3.0])}  # one row


def test_dates_are_seconds_since_the_first_and_numbers_are_real_and_one_a_row():
    dates = np.array(["2024-01-01T00:00:59.5", "2024-01-01T00:01:01.75"], "datetime64[ms]")
    assert numbers("t", dates).tolist() == [0.0, 2.25]
    for kind in (np.int16, np.uint8, np.bool_, np.float32):
        assert numbers("n", np.array([1, 0], kind)).tolist() == [1.0, 0.0]
    for wrong in (np.zeros((2, 2)), np.array([1j, 2.0])):
        with pytest.raises(InputError, match="does not hold one real number a row"):
            numbers("q", wrong)


@pytest.mark.parametrize("count", [40, 43])
def test_a_message_lists_forty_columns_and_counts_the_others(count):
    there = [f"column{k}" for k in range(count)]
    with pytest.raises(InputError) as caught:
        require_columns(["zzz"], there)
    assert str(caught.value).count("column") == 2 + min(count, 40)
    tail = str(caught.value).rpartition("column39")[2]
    assert tail == ("" if count == 40 else f" and {count - 40} more")


def test_a_scale_may_be_a_scalar_of_the_file(tmp_path: Path) -> None:
    raw = np.sin(np.arange(50.0))
    file = tmp_path / "run.mat"
    write_mat(file, {"q": raw, "u": 2.0 * raw})  # and gain = 3
    text = map_of("q", "u", units=("m", "V")).replace('"u"', '"u", scale = "gain"')
    assert import_log(file, mapping(tmp_path, text)).axes["x"].force == pytest.approx(6.0 * raw)
    for name, said in (("q", "name a scalar"), ("gian", "no column 'gian'; did you mean 'gain'")):
        with pytest.raises(InputError, match=said):
            import_log(file, mapping(tmp_path, text.replace("gain", name)))


def stated_hdf5(path: Path, values: np.ndarray) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        for name, unit in (("q", "mm"), ("f", np.bytes_("kN"))):
            file[f"run/{name}"] = values
            file[f"run/{name}"].attrs["units" if name == "q" else "unit"] = unit


def stated_tdms(path: Path, values: np.ndarray) -> None:
    nptdms = pytest.importorskip("nptdms")
    with nptdms.TdmsWriter(str(path)) as writer:
        given = (("q", "mm"), ("f", "kN"))
        writer.write_segment([
            nptdms.ChannelObject("run", name, values, {"unit_string": unit}) for name, unit in given
        ])  # fmt: skip


@pytest.mark.parametrize(("ending", "write"), [("h5", stated_hdf5), ("tdms", stated_tdms)])
def test_units_that_a_file_states_beside_its_columns_are_part_of_their_names(
    tmp_path, ending, write
):
    """A map may name a column without."""
    path, values = tmp_path / f"run.{ending}", np.sin(np.arange(50.0))
    write(path, values)
    columns = table_of(path, EVERY_COLUMN).columns
    assert {*columns} == {"run/q [mm]", "run/f [kN]"}
    for names in (("run/q", "run/f"), ("run/q [mm]", "run/f [kN]")):
        log = import_log(path, mapping(tmp_path, map_of(*names, units=("mm", "kN"))))
        assert log.axes["x"].force == pytest.approx(1e3 * values)


def hdf5_bomb(path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        file.create_dataset("q", (10**11,), "f8", chunks=(1 << 20,), compression="gzip")


def parquet_bomb(path: Path) -> None:
    pyarrow, parquet = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    column = pyarrow.nulls(20_000_000, pyarrow.float64())
    parquet.write_table(pyarrow.table({"q": column}), path)


def mat_bomb(path: Path) -> None:
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
    ("ending", "write"), [("h5", hdf5_bomb), ("parquet", parquet_bomb), ("mat", mat_bomb)]
)
def test_a_small_file_that_announces_a_large_table_is_one_line(tmp_path, ending, write):
    path = tmp_path / f"a.{ending}"
    write(path)
    assert path.stat().st_size < 1 << 19
    with pytest.raises(InputError, match="export it again"):
        import_log(path, mapping(tmp_path, map_of("q", "q")))


@pytest.mark.parametrize("compressed", [False, True])
def test_memory_is_granted_for_what_a_mat_file_holds(tmp_path, compressed):
    """As many bytes as its arrays have, beside names and sizes, however they are packed."""
    path, arrays = tmp_path / "a.mat", {"q": np.zeros(300_000), "s": {"r": np.arange(70_000.0)}}
    savemat(path, arrays, do_compression=compressed)
    assert content_bytes(path) == pytest.approx(370_000 * 8, abs=1000)
    savemat(path, {"q": np.zeros(1000)}, format="4")
    assert content_bytes(path) == path.stat().st_size
    path.write_bytes(path.read_bytes()[:50])
    assert content_bytes(path) == 50
