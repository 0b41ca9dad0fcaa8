"""Laws of the importers: every column of every format becomes its own signal, in SI.

SI value = sign x (scale x raw + offset) x unit, moved back by its delay, written out here once for
seven columns of one axis and three of another whose every number differs.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from import_cases import (
    mapping,
    write_csv,
    write_hdf5,
    write_hdf5_records,
    write_mat,
    write_mat_matrix,
    write_parquet,
)

from twin.errors import InputError
from twin.importers import import_log
from twin.importers.importer import FORMATS
from twin.importers.table import numbers, require_columns, split_columns
from twin.logs.log import FIELDS

RATE, COUNT = 250.0, 24


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
    Signal("y", "position", "h", "deg", DEGREE, 4.5, 19.0, -1, 1),
    Signal("y", "velocity", "i", "rpm", math.pi / 30.0, 5.5, -23.0, 1, 0),
    Signal("y", "force", "j", "V", 1.0, 6.5, 29.0, -1, -1),
)
assert tuple(s.field for s in SIGNALS if s.axis == "x") == FIELDS
FIRST, LAST = 2, COUNT - 3  # the delays of -2 and 3 leave these rows


def raw(signal: Signal) -> np.ndarray:
    """Whole numbers that stand in no other column, so that every format keeps them."""
    k = np.arange(COUNT)
    return 1000.0 * (1 + ord(signal.column) - ord("a")) + k**2 % 17 + 20.0 * k


def expected(signal: Signal) -> np.ndarray:
    moved = raw(signal)[FIRST + signal.delay : LAST + signal.delay]
    return signal.sign * (signal.scale * moved + signal.offset) * signal.size


Columns = dict[str, np.ndarray]


Case = tuple[Callable[[Path, Columns], None], str, Callable[[str, int], str]]
CASES: dict[str, Case] = {
    "csv": (write_csv, "log.csv", lambda name, number: name),
    "mat": (write_mat, "log.mat", lambda name, number: name),
    "mat matrix": (write_mat_matrix, "log.mat", lambda name, number: f"log[{number}]"),
    "hdf5": (write_hdf5, "log.h5", lambda name, number: f"run/{name}"),
    "hdf5 records": (write_hdf5_records, "log.he5", lambda name, number: f"log/{name}"),
    "parquet": (write_parquet, "log.pq", lambda name, number: name),
}


def file_columns() -> Columns:
    """The columns in another order than the map's, the times among them."""
    order = np.random.default_rng(4).permutation(len(SIGNALS))
    columns = {SIGNALS[k].column: raw(SIGNALS[k]) for k in order[:5]}
    columns["t"] = 3.0 + np.arange(COUNT) / RATE
    return columns | {SIGNALS[k].column: raw(SIGNALS[k]) for k in order[5:]}


def map_text(name: Callable[[str, int], str], clock: str) -> str:
    there = list(file_columns())
    lines = [clock]
    for axis, constant in (("x", 7.25), ("y", 0.5)):
        lines += [f"[axes.{axis}]", f"force_constant = {constant}"]
        for signal in SIGNALS:
            if signal.axis == axis:
                lines.append(signal.entry(name(signal.column, there.index(signal.column) + 1)))
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize("clock", ["rate", "time"])
@pytest.mark.parametrize("case", CASES)
def test_every_column_of_every_format_is_its_own_signal_in_si(tmp_path, case, clock):
    write, file, name = CASES[case]
    write(tmp_path / file, file_columns())
    time = f'time = {{column = "{name("t", list(file_columns()).index("t") + 1)}", unit = "s"}}'
    text = map_text(name, time if clock == "time" else f"sample_rate = {RATE}")
    log = import_log(tmp_path / file, mapping(tmp_path, text))
    assert log.sample_rate == RATE
    assert len(log) == LAST - FIRST
    assert (log.axes["x"].force_constant, log.axes["y"].force_constant) == (7.25, 0.5)
    assert log.axes["x"].units["position"] == "m"
    assert (log.axes["y"].units["position"], log.axes["y"].units["force"]) == ("rad", "N m")
    for signal in SIGNALS:
        got = log.axes[signal.axis].columns[signal.field]
        np.testing.assert_allclose(got, expected(signal), rtol=1e-13, err_msg=signal.column)


@pytest.mark.parametrize("delay", [-23, -1, 1, 22, 23])
def test_a_delay_may_leave_two_samples_and_no_fewer(tmp_path, delay):
    write_csv(tmp_path / "log.csv", {"q": np.arange(COUNT) + 1.0, "u": np.arange(COUNT) + 50.0})
    text = f"""
sample_rate = 100.0
[axes.x]
position = {{column = "q", unit = "m", delay_samples = {delay}}}
force = {{column = "u", unit = "N"}}
"""
    left = COUNT - abs(delay)
    if left < 2:
        with pytest.raises(InputError, match=f"delay_samples of {min(0, delay)} to"):
            import_log(tmp_path / "log.csv", mapping(tmp_path, text))
        return
    axis = import_log(tmp_path / "log.csv", mapping(tmp_path, text)).axes["x"]
    rows = np.arange(max(0, -delay), COUNT - max(0, delay))
    assert axis.position.tolist() == (rows + delay + 1.0).tolist()
    assert axis.force.tolist() == (rows + 50.0).tolist()


# Tables


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


def test_dates_are_seconds_since_the_first_and_text_names_its_row():
    dates = np.array(["2024-01-01T00:00:59.5", "2024-01-01T00:01:01.75"], "datetime64[ms]")
    assert numbers("t", dates).tolist() == [0.0, 2.25]
    for kind in (np.int16, np.uint8, np.bool_, np.float32):
        assert numbers("n", np.array([1, 0], kind)).tolist() == [1.0, 0.0]
    with pytest.raises(InputError, match=r"column 'q' does not hold one real .* 'c' in row 3"):
        numbers("q", np.array([1.0, 2, "c"], object))
    for wrong in (np.zeros((2, 2)), np.array([1j, 2.0])):
        with pytest.raises(InputError, match="does not hold one real number a row"):
            numbers("q", wrong)


def test_every_ending_belongs_to_one_format():
    endings = [e for endings, _ in FORMATS.values() for e in endings]
    assert len(set(endings)) == len(endings)


@pytest.mark.parametrize(("part", "right"), [(0.9e-6, True), (1.1e-6, False), (-1.1e-6, False)])
def test_the_rate_of_a_waveform_may_differ_from_the_maps_by_a_millionth(tmp_path, part, right):
    nptdms = pytest.importorskip("nptdms")
    rate, period = 50.0, {"wf_increment": 1.0 / (50.0 * (1.0 + part))}
    columns = {"a": np.arange(4.0), "b": 7.0 + np.arange(4.0)}
    with nptdms.TdmsWriter(str(tmp_path / "log.tdms")) as writer:
        writer.write_segment([nptdms.ChannelObject("r", n, c, period) for n, c in columns.items()])
    text = f"""
sample_rate = {rate}
[axes.x]
position = {{column = "r/a", unit = "m"}}
force = {{column = "r/b", unit = "N"}}
"""
    if right:
        assert import_log(tmp_path / "log.tdms", mapping(tmp_path, text)).sample_rate == rate
    else:
        with pytest.raises(InputError, match="the map says 50 Hz"):
            import_log(tmp_path / "log.tdms", mapping(tmp_path, text))


def test_channels_of_different_rates_are_refused(tmp_path):
    nptdms = pytest.importorskip("nptdms")
    with nptdms.TdmsWriter(str(tmp_path / "log.tdms")) as writer:
        for name, period in (("a", 0.01), ("b", 0.02)):
            properties = {"wf_increment": period}
            writer.write_segment([nptdms.ChannelObject("r", name, np.arange(4.0), properties)])
    text = """
[axes.x]
position = {column = "r/a", unit = "m"}
force = {column = "r/b", unit = "N"}
"""
    with pytest.raises(InputError, match=r"'r/a' has a sample every 0.01 s, 'r/b' every 0.02 s"):
        import_log(tmp_path / "log.tdms", mapping(tmp_path, text))


@pytest.mark.parametrize("count", [40, 41, 43])
def test_a_message_lists_forty_columns_and_counts_the_others(count):
    there = [f"column{k}" for k in range(count)]
    with pytest.raises(InputError) as caught:
        require_columns(["zzz"], there)
    assert str(caught.value).count("column") == 2 + min(count, 40)
    tail = str(caught.value).rpartition("column39")[2]
    assert tail == ("" if count == 40 else f" and {count - 40} more")
