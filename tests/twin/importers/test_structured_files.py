"""Recordings in tables within tables, matrices, packed numbers and batches: read as written."""

from __future__ import annotations

import json
from collections.abc import Callable
from decimal import Decimal
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from import_cases import refusal_of
from scipy.io import savemat

from twin.importers import import_log
from twin.importers.guess import propose
from twin.importers.mapping import parse_mapping
from twin.logs import Log

RATE, COUNT = 2000.0, 4000
T = np.arange(COUNT) / RATE
Q = 0.05 * np.sin(9.0 * T) + 0.02 * np.sin(23.0 * T)  # m
V = 0.45 * np.cos(9.0 * T) + 0.46 * np.cos(23.0 * T)
F = 12.0 * np.gradient(V, T) + 6.0 * np.sign(V) + 25.0 * V  # N, of 12 kg


def imported(path: Path) -> Log:
    """A file by the map that is proposed for it."""
    proposal = propose(path)
    assert proposal.lacks({}) == ()
    return import_log(path, parse_mapping(proposal.map_text({})))


def assert_right(log: Log, count: int = COUNT) -> None:
    (axis,) = log.axes.values()
    assert (log.sample_rate, len(log)) == (RATE, count)
    np.testing.assert_allclose(axis.position, Q[:count], atol=2e-6)
    np.testing.assert_allclose(axis.force, F[:count], atol=2e-2)


def hdf5(path: Path, entries: dict[str, tuple[Any, dict[str, Any]]], **root: Any) -> Path:
    """An HDF5 file of datasets with their attributes, and those of the file."""
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        file.attrs.update(root)
        for name, (values, attributes) in entries.items():
            file[name] = values
            file[name].attrs.update(attributes)
    return path


def parquet(path: Path, columns: dict[str, Any]) -> Path:
    pyarrow, writer = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    writer.write_table(pyarrow.table(columns), path)
    return path


def lines(path: Path, rows: list[dict[str, Any]], end: str = "") -> Path:
    path.write_text("\n".join(map(json.dumps, rows)) + end)
    return path


def rows(**columns: Any) -> list[dict[str, Any]]:
    """One table a row."""
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


MM, N = {"units": "mm"}, {"units": "N"}
PLAIN: dict[str, tuple[Any, dict[str, Any]]] = {
    "time": (T, {"units": "s"}), "position": (1e3 * Q, MM), "force": (F, N),
}  # fmt: skip
SIGNALS = {"t": T.tolist(), "pos_mm": (1e3 * Q).tolist(), "force_N": F.tolist()}
TAIL = np.zeros(1000)  # of memory that was set aside for more


def packed(path: Path) -> Path:
    """As netCDF packs numbers."""
    raw = np.rint(Q / 1e-6).astype(np.int32)
    position = (raw, {"units": "m", "scale_factor": 1e-6, "_FillValue": np.int32(-9999999)})
    return hdf5(path, {**PLAIN, "position": position})


def matrix(path: Path) -> Path:
    return hdf5(path, {"log": (np.c_[T, 1e3 * Q, F], {"columns": "time [s],pos [mm],force [N]"})})


def cells(path: Path) -> Path:
    """A matrix, and the names of its columns in a cell array."""
    names = np.array(["Time (s)", "Position (mm)", "Force (N)"], dtype=object)
    savemat(path, {"data": np.c_[T, 1e3 * Q, F], "names": names})
    return path


def rate_with_its_unit_beside(path: Path) -> Path:
    entries = {n: PLAIN[n] for n in ("position", "force")}
    return hdf5(path, entries, sampling_interval=500.0, sampling_interval_unit="us")


def preallocated(path: Path) -> Path:
    return hdf5(path, {n: (np.r_[v, TAIL], a) for n, (v, a) in PLAIN.items()})


def beside_a_longer_one(path: Path) -> Path:
    return hdf5(path, {**PLAIN, "microphone": (np.arange(5.0 * COUNT), {})})


def batches(path: Path) -> Path:
    """As telemetry sends them, 100 samples a line."""
    every = range(0, COUNT, 100)
    return lines(path, [
        {"t0": T[k], "fs": RATE, "pos_mm": SIGNALS["pos_mm"][k : k + 100],
         "force_N": SIGNALS["force_N"][k : k + 100]} for k in every
    ])  # fmt: skip


def mat73(path: Path) -> Path:
    """A structure with time of Simulink: an array of structs, whose fields are references."""
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w", userblock_size=512) as file:
        file["scope/time"] = T[None, :]
        made = file.create_group("#refs#")
        for field, values in (
            ("values", (1e3 * Q[None, :], F[None, :])), ("label", ("pos [mm]", "force [N]")),
        ):  # fmt: skip
            references = []
            for k, value in enumerate(values):
                text = isinstance(value, str)
                name = f"{field}{k}"
                made[name] = np.array([[ord(c)] for c in value], "u2") if text else value
                if text:
                    made[name].attrs["MATLAB_class"] = np.bytes_("char")
                references.append(made[name].ref)
            where = file.create_dataset(f"scope/signals/{field}", (2, 1), dtype=h5py.ref_dtype)
            where[:, 0] = references
    with open(path, "r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file".ljust(512, b" "))
    return path


def arrow(path: Path) -> Path:
    pyarrow, feather = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.feather")
    feather.write_feather(pyarrow.table(SIGNALS), path)
    return path


def records_of_numpy(path: Path) -> Path:
    table = np.zeros(COUNT, [(n, "f8") for n in SIGNALS])
    for name, column in SIGNALS.items():
        table[name] = column
    np.save(path, table)
    return path


def archive(path: Path) -> Path:
    np.savez(path, **SIGNALS)
    return path


def decimals(path: Path) -> Path:
    return parquet(path, {**SIGNALS, "pos_mm": [Decimal(f"{1e3 * q:.4f}") for q in Q]})


def structs(path: Path) -> Path:
    x = rows(pos_mm=SIGNALS["pos_mm"], force_N=SIGNALS["force_N"])
    return parquet(path, {"t": T, "x": x})


def of_pandas(path: Path) -> Path:
    table = {n: {str(k): v for k, v in enumerate(c)} for n, c in SIGNALS.items()}
    path.write_text(json.dumps(table))
    return path


def numbers_as_text(path: Path) -> Path:
    return lines(path, rows(**{n: [f"{v:.6f}" for v in c] for n, c in SIGNALS.items()}))


def two_rates_stated(path: Path) -> Path:
    entries = {n: PLAIN[n] for n in ("position", "force")}
    return hdf5(path, entries, camera_frame_rate=30.0, sample_rate=RATE)


def rate_in_kilohertz(path: Path) -> Path:
    signals = {n: SIGNALS[n] for n in ("pos_mm", "force_N")}
    path.write_text(json.dumps({"sample_rate": 2, "sample_rate_unit": "kHz", **signals}))
    return path


def heartbeat(path: Path) -> Path:
    return parquet(path, {**SIGNALS, "alive": ["on", "off"] * (COUNT // 2)})


@pytest.mark.parametrize(
    ("name", "write"),
    [
        ("a.h5", packed), ("a.h5", matrix), ("a.h5", preallocated), ("a.h5", beside_a_longer_one),
        ("a.h5", two_rates_stated), ("a.mat", cells), ("a.h5", rate_with_its_unit_beside),
        ("a.json", rate_in_kilohertz), ("a.jsonl", batches),
        ("a.mat", mat73), ("a.feather", arrow), ("a.npy", records_of_numpy), ("a.npz", archive),
        ("a.parquet", decimals), ("a.parquet", structs), ("a.json", of_pandas),
        ("a.parquet", heartbeat),
        ("a.jsonl", numbers_as_text),
    ],
    ids=lambda one: getattr(one, "__name__", str(one)),
)  # fmt: skip
def test_a_recording_is_read_as_it_was_written(
    tmp_path: Path, name: str, write: Callable[[Path], Path]
) -> None:
    assert_right(imported(write(tmp_path / name)))


def test_a_last_line_that_is_cut_off_is_left_out(tmp_path: Path) -> None:
    path = lines(tmp_path / "a.jsonl", rows(**SIGNALS)[:-1], end='\n{"t": 1.99')
    assert_right(imported(path), COUNT - 1)
    broken = path.read_text().splitlines()
    broken[7] = broken[7][:-3]
    path.write_text("\n".join(broken))
    assert "line 8 is no JSON" in refusal_of(path)


def test_a_channel_of_tdms_that_is_left_at_a_second_a_sample_states_no_rate(tmp_path: Path) -> None:
    nptdms = pytest.importorskip("nptdms")
    period = {"wf_increment": 1.0}
    channels = [nptdms.ChannelObject("log", n, np.array(c), period) for n, c in SIGNALS.items()]
    with nptdms.TdmsWriter(str(tmp_path / "a.tdms")) as writer:
        writer.write_segment(channels)
    assert_right(imported(tmp_path / "a.tdms"))


def of_axes(path: Path) -> Path:
    both = {n: np.repeat(c, 2) for n, c in SIGNALS.items()}
    return parquet(path, {**both, "t": np.arange(2 * COUNT) / 4e3, "axis": ["X", "Y"] * COUNT})


def runs(path: Path) -> Path:
    return hdf5(path, {f"run_{k}/{n}": one for k in (1, 2, 3) for n, one in PLAIN.items()})


def test_axes_without_times_of_their_own_are_no_recordings(tmp_path: Path) -> None:
    entries = {n: PLAIN[n] for n in ("position", "force")}
    both = {f"axis_{a}/{n}": one for a in "xy" for n, one in entries.items()}
    log = imported(hdf5(tmp_path / "a.h5", both, sample_rate=RATE))
    assert (log.axes.keys(), log.sample_rate) == ({"x", "y"}, RATE)


def two_periods(path: Path) -> Path:
    savemat(path, {"Ts": 1.25e-4, "Ts_log": 5e-4, "pos_mm": 1e3 * Q, "force_N": F})
    return path


def slow_rate(path: Path) -> Path:
    savemat(path, {"fs": 2.0, "pos_mm": 1e3 * Q, "force_N": F})
    return path


def shorter_force(path: Path) -> Path:
    savemat(path, {"t": T, "pos_mm": 1e3 * Q, "ref_mm": 1e3 * Q, "force_N": F[::4]})
    return path


def zipped(path: Path) -> Path:
    path.write_bytes(b"PK\x03\x04" + bytes(200))
    return path


def holed(path: Path) -> Path:
    return parquet(path, {**SIGNALS, "ref_mm": [None, *SIGNALS["pos_mm"][1:]]})


@pytest.mark.parametrize(
    ("name", "write", "said"),
    [
        ("a.parquet", of_axes, "column 'axis' tells of what a row is, X or Y"),
        ("a.h5", runs, "holds 3 recordings: run_1, run_2, run_3; give each as a file of its own"),
        ("a.mat", two_periods, "'Ts = 0.000125; Ts_log = 0.0005' and other rates"),
        ("a.mat", slow_rate, "the file states 'fs = 2' without a unit; give sample_rate"),
        ("a.mat", shorter_force, "'force_N' has 1000 rows, the others 4000: give the file twice"),
        ("a.csv.gz", zipped, "is compressed; unpack it first"),
        ("a.csv", zipped, "is compressed, or a workbook, whatever its name"),
        ("a.parquet", holed, "column 'ref_mm' is nan in row 1 of 4000"),
    ],
    ids=lambda one: getattr(one, "__name__", str(one)[:20]),
)
def test_what_is_not_known_is_asked_for(
    tmp_path: Path, name: str, write: Callable[[Path], Path], said: str
) -> None:
    assert said in refusal_of(write(tmp_path / name))
