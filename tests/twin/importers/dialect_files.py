"""One recording as each dialect writes it: names of its columns and what they hold."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from import_cases import write_hdf5, write_tdms
from mcap.writer import Writer
from scipy.io import savemat

COUNT, STEP = 500, 0.004  # samples, s
T = STEP * np.arange(COUNT)
RNG = np.random.default_rng(5)
Q = np.round(30.0 * np.sin(3.0 * T), 6)
F = np.round(5.0 * np.cos(3.0 * T) + RNG.normal(size=COUNT), 6)
BEGIN = datetime(2026, 3, 31, 23, 59, 59)
WHEN = [BEGIN + timedelta(milliseconds=4 * k) for k in range(COUNT)]
EPOCH = 1_700_000_000 * 10**9


@dataclass(frozen=True)
class Sample:
    """A dialect's file: its name, what writes it, and its columns of position and force.

    asks: whether the file tells no rate, so that it must be asked for.
    """

    file: str
    write: Callable[[Path], None]
    position: str
    force: str
    is_text: bool = True
    asks: bool = False


def text(line: Callable[[int], str], head: str, end: str = "\n") -> Callable[[Path], None]:
    def write(path: Path) -> None:
        body = [line(k) for k in range(COUNT)]
        path.write_bytes((end.join([*head.splitlines(), *body]) + end).encode())

    return write


def twincat(k: int) -> str:
    return f"{4 * k}\t{Q[k]:.6f}\t{4 * k}\t{F[k]:.6f}".replace(".", ",")


TWINCAT = """Name\tScope01
StartRecord\t128783093223690000\tDonnerstag, 5. Februar 2009\t13:08:42

Name\tActPos\tName\tTorque
SampleTime[ms]\t4\tSampleTime[ms]\t4
SymbolName\tMAIN.fPos\tSymbolName\tMAIN.fTorque
Data-Type\tREAL64\tData-Type\tREAL64
"""


def milli(time: datetime) -> str:
    return f"{time.microsecond // 1000:03d}"


ROCKWELL = """Controller Name:,"Line_3"
Trend Name:,"Trend1"
Trend Tags:,2
Sample Period:,4 ms
Description:,
Start Time:,2026/03/31,23:59:59;000
Header:,"Date","Time","Axis.ActualPosition","Program:Main.Torque"
"""


def wincc(path: Path) -> None:
    rows = ['"VarName";"TimeString";"VarValue";"Validity";"Time_ms"']
    for k, when in enumerate(WHEN):
        days = (when - datetime(1899, 12, 30)) / timedelta(days=1) * 1e6
        for name, column in (("Pos", Q), ("Torque", F)):
            value = f"{column[k]:.6f}".replace(".", ",")
            exact = f"{days:.6f}".replace(".", ",")
            rows.append(f'"{name}";"{when:%d.%m.%Y %H:%M:%S}";{value};1;{exact}')
    rows.append('"$RT_OFF$";"01.04.2026 00:00:02";0;2;46113000000,0')
    path.write_bytes("\r\n".join(rows).encode())


def parquet(path: Path) -> None:
    pyarrow, writer = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    table = pyarrow.table({"q": Q, "f": F})
    writer.write_table(table.replace_schema_metadata({"sample_rate": "250"}), path)


def lerobot(path: Path) -> None:
    pyarrow, writer = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    state, k = np.stack([0.0 * Q, Q], axis=1), np.arange(COUNT)
    columns = {"observation.state": list(state), "action": list(np.stack([F, F], axis=1)),
               "timestamp": T.astype(np.float32), "frame_index": k, "episode_index": 0 * k,
               "index": k, "task_index": 0 * k}  # fmt: skip
    writer.write_table(pyarrow.table(columns), path)
    names = {"names": ["shoulder.pos", "elbow.pos"]}
    features = {"observation.state": names, "action": {"names": {"motors": names["names"]}}}
    (path.parent / "meta").mkdir(exist_ok=True)
    info = {"codebase_version": "v3.0", "fps": 250, "features": features}
    (path.parent / "meta" / "info.json").write_text(json.dumps(info))


def simulink(path: Path) -> None:
    signals = np.array(
        [(Q[:, None], 1, "pos"), (F[:, None], 1, "torque")],
        dtype=[("values", object), ("dimensions", object), ("label", object)],
    )
    scope = {"time": T[:, None], "signals": signals, "blockName": "m/Scope"}
    savemat(path, {"ScopeData": scope}, do_compression=True)


def mcap(path: Path) -> None:
    with open(path, "wb") as stream:
        writer = Writer(stream, chunk_size=4000)
        writer.start()
        channel = writer.register_channel("/drive", "json", 0)
        for k in range(COUNT):
            message = json.dumps({"q": Q[k], "f": F[k]}).encode()
            writer.add_message(channel, EPOCH + 4_000_000 * k, message, EPOCH + 4_000_000 * k)
        writer.finish()


def rosbag(path: Path) -> None:
    rosbag1 = pytest.importorskip("rosbags.rosbag1", reason="extra import")
    typesys = pytest.importorskip("rosbags.typesys")
    store = typesys.get_typestore(typesys.Stores.ROS1_NOETIC)
    kind = "sensor_msgs/msg/JointState"
    joints, header, time = (store.types[n] for n in (
        kind, "std_msgs/msg/Header", "builtin_interfaces/msg/Time"))  # fmt: skip
    with rosbag1.Writer(path) as writer:
        connection = writer.add_connection("/joints", kind, typestore=store)
        for k in range(COUNT):
            ns = EPOCH + 4_000_000 * k
            stamp = header(k, time(ns // 10**9, ns % 10**9), "")
            values = np.array([1.0, Q[k]]), np.zeros(2), np.array([2.0, F[k]])
            message = joints(stamp, ["wrist", "elbow"], *values)
            writer.write(connection, ns + 7 * (k % 5), store.serialize_ros1(message, kind))


def feather(path: Path) -> None:
    arrow, writer = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.feather")
    writer.write_feather(arrow.table({"t": T, "q": Q, "f": F}), path)


SAMPLES = {
    "csv": Sample("a.csv", text(lambda k: f"{T[k]:.3f},{Q[k]},{F[k]}", "t,pos,u"), "pos", "u"),
    "twincat": Sample("a.csv", text(twincat, TWINCAT, "\r\n"), "MAIN.fPos", "MAIN.fTorque"),
    "halsampler": Sample(
        "a.txt", text(lambda k: f"{k} {Q[k]:f} {F[k]:f} ", ""), "2", "3", asks=True
    ),
    "labelled": Sample(
        "a.log", text(lambda k: f"t:{T[k]:.3f},pos:{Q[k]},u:{F[k]}", "boot"), "pos", "u",
    ),
    "klipper": Sample(
        "a.csv", text(lambda k: f"{T[k]:.6f},{Q[k]:.6f},{F[k]:.6f},0.000000",
                      "#time,accel_x,accel_y,accel_z"), "accel_x", "accel_y",
    ),
    "rockwell": Sample(
        "a.csv",
        text(lambda k: f"Data,{WHEN[k]:%Y/%m/%d},{WHEN[k]:%H:%M:%S};{milli(WHEN[k])},{Q[k]},{F[k]}",
             ROCKWELL, "\r\n"), "Axis.ActualPosition", "Program:Main.Torque",
    ),
    "wincc": Sample("a.csv", wincc, "Pos", "Torque"),
    "moteus": Sample(
        "a.csv", text(lambda k: f"{T[k]:.6f},10,{Q[k]},0.0,{F[k]},24.0,0",
                      "time,MODE,POSITION,VELOCITY,TORQUE,VOLTAGE,FAULT"), "POSITION", "TORQUE",
    ),
    "odrive": Sample(
        "a.csv", text(lambda k: f"{T[k]:.4f},{Q[k]},{F[k]}",
                      "time,odrv0.axis0.encoder.pos_estimate,"
                      "odrv0.axis0.motor.current_control.Iq_measured"),
        "odrv0.axis0.encoder.pos_estimate", "odrv0.axis0.motor.current_control.Iq_measured",
    ),
    "mat": Sample(
        "a.mat", simulink, "ScopeData.signals.pos", "ScopeData.signals.torque", is_text=False
    ),
    "hdf5": Sample(
        "a.h5", lambda path: write_hdf5(path, {"t": T, "q": Q, "f": F}), "run/q", "run/f",
        is_text=False,
    ),
    "json": Sample(
        "a.json", lambda path: path.write_text(json.dumps(
            {"fs": 250, "q": Q.tolist(), "f": F.tolist()})) and None, "q", "f", is_text=False,
    ),
    "feather": Sample("a.feather", feather, "q", "f", is_text=False),
    "npz": Sample(
        "a.npz", lambda path: np.savez(path, fs=250.0, q=Q, f=F), "q", "f", is_text=False
    ),
    "parquet": Sample("a.parquet", parquet, "q", "f", is_text=False),
    "lerobot": Sample(
        "a.parquet", lerobot, "observation.state.elbow.pos", "action.elbow.pos", is_text=False
    ),
    "tdms": Sample(
        "a.tdms", lambda path: write_tdms(path, {"q": Q, "f": F}, STEP), "run/q", "run/f",
        is_text=False,
    ),
    "mcap": Sample("a.mcap", mcap, "/drive.q", "/drive.f", is_text=False),
    "rosbag": Sample(
        "a.bag", rosbag, "/joints.position.elbow", "/joints.effort.elbow", is_text=False
    ),
}  # fmt: skip
__all__ = ["COUNT", "SAMPLES", "STEP", "F", "Q", "Sample"]
