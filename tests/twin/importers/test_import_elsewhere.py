"""Recordings of other programs: TwinCAT Scope, MCAP of other writers."""

import json
from pathlib import Path

import mcap_protobuf.writer
import numpy as np
import pytest
from google.protobuf import timestamp_pb2
from google.protobuf.descriptor_pb2 import FieldDescriptorProto as Kind
from google.protobuf.descriptor_pb2 import FileDescriptorProto
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message_factory import GetMessageClass
from import_cases import map_of, mapping, write_csv
from mcap.opcode import Opcode
from mcap_bytes import of

from twin.errors import InputError
from twin.importers import import_log, import_notes
from twin.importers.importer import table_of
from twin.importers.mapping import EVERY_COLUMN
from twin.logs import Log
from twin.logs.topics import instant

COUNT = 400
T = np.arange(COUNT) * 1e-3
Q, F = 50.0 * np.sin(3.0 * T), 2.0 * np.cos(5.0 * T)
EPOCH = 1_700_000_000
FILETIME = 116_444_736_000_000_000 + EPOCH * 10**7


def imported(folder: Path, name: str, text: str) -> Log:
    return import_log(folder / name, mapping(folder, text))


def assert_signals(log: Log, axis: str = "x", position: float = 1e-3) -> None:
    np.testing.assert_allclose(log.axes[axis].position, position * Q, rtol=0, atol=1e-12)
    np.testing.assert_allclose(log.axes[axis].force, F, rtol=0, atol=1e-9)


def scope(*, shared: bool, decimal: str = ",", end: str = "EOF\r\n", step: str = "1") -> str:
    """An export as Beckhoff describes it, a time for each channel or one for both."""
    between = [] if shared else [None]

    def row(key: str, *values: str) -> str:
        cells = [key]
        for k, value in enumerate(values):
            cells += ([key] if k and not shared else []) + [value]
        return "\t".join(cells)

    head = [
        "Name\tScope01", "File\tC:\\a.svd", f"StartRecord\t{FILETIME}\tDienstag\t22:13:20", "",
        row("Name", "ActPos", "Torque"), row("NetId", "1.1.1.1", "1.1.1.1"),
        row("Port", "851", "851"), row("SampleTime[ms]", "1", step),
        row("SymbolName", "MAIN.fPos", "MAIN.fForce"), row("Data-Type", "REAL64", "REAL64"), "",
    ]  # fmt: skip
    rows = []
    for k in range(COUNT):
        cells = [str(k), repr(float(Q[k])), *([str(k)] * len(between)), repr(float(F[k]))]
        rows.append("\t".join(cells).replace(".", decimal))
    return "\r\n".join([*head, *rows]) + "\r\n" + end


SCOPE_MAP = map_of("MAIN.fPos", "MAIN.fForce", clock="")


@pytest.mark.parametrize(("shared", "decimal", "end"), [(False, ",", "EOF\r\n"), (True, ".", "")])
def test_twincat_scope(tmp_path, shared, decimal, end):
    (tmp_path / "a.csv").write_text(scope(shared=shared, decimal=decimal, end=end))
    log = imported(tmp_path, "a.csv", SCOPE_MAP)
    assert log.sample_rate == 1000.0
    assert log.metadata["start_time_unix_ns"] == str(EPOCH * 10**9)
    assert_signals(log)
    timed = map_of("MAIN.fPos", "MAIN.fForce", clock="time in ms")
    assert_signals(imported(tmp_path, "a.csv", timed))


def test_the_times_of_each_channel_of_a_scope_are_numbered(tmp_path):
    (tmp_path / "a.csv").write_text(scope(shared=False))
    columns = table_of(tmp_path / "a.csv", EVERY_COLUMN).columns
    assert list(columns) == ["time", "MAIN.fPos", "time[2]", "MAIN.fForce"]
    np.testing.assert_array_equal(columns["time[2]"], np.arange(COUNT))


def test_two_scopes_begin_when_each_says_that_it_did(tmp_path):
    for name, ticks in (("a", FILETIME), ("b", FILETIME + 5 * 10**4)):  # of 100 ns: 5 ms later
        (tmp_path / f"{name}.csv").write_text(scope(shared=True).replace(str(FILETIME), str(ticks)))
    text = SCOPE_MAP.replace('"MAIN.fForce", ', '"MAIN.fForce", file = 2, ')
    both = mapping(tmp_path, 2 * "[[files]]\nsample_rate = 1000.0\n" + text)
    log = import_log([tmp_path / "a.csv", tmp_path / "b.csv"], both)
    axis = next(iter(log.axes.values()))
    np.testing.assert_allclose(axis.position, 1e-3 * Q[5:], atol=1e-12)
    np.testing.assert_allclose(axis.force, F[:-5], atol=1e-12)
    assert log.metadata["start_time_unix_ns"] == str(EPOCH * 10**9 + 5 * 10**6)


@pytest.mark.parametrize(("step", "rate"), [("0.25", 4000.0), ("8", 125.0), ("0", None)])
def test_the_rate_of_a_scope_is_that_of_its_sample_time(tmp_path, step, rate):
    text = scope(shared=True, decimal=".").replace("[ms]\t1\t1", f"[ms]\t{step}\t{step}")
    (tmp_path / "a.csv").write_text(text)
    other = map_of("MAIN.fPos", "MAIN.fForce", clock="sample_rate = 1000.0")
    if rate is None:  # which is none
        with pytest.raises(InputError, match="does not state its sample rate"):
            imported(tmp_path, "a.csv", SCOPE_MAP)
        assert imported(tmp_path, "a.csv", other).sample_rate == 1000.0
        return
    assert imported(tmp_path, "a.csv", SCOPE_MAP).sample_rate == rate
    with pytest.raises(InputError, match=f"is sampled at {rate:g} Hz, the map says 1000 Hz"):
        imported(tmp_path, "a.csv", other)


def test_channels_of_two_sample_times_are_refused(tmp_path):
    (tmp_path / "a.csv").write_text(scope(shared=False, step="2"))
    with pytest.raises(InputError, match="sample times of 1, 2 ms"):
        imported(tmp_path, "a.csv", SCOPE_MAP)


JOINT_STATE = """std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""


def write_joint_states(path: Path) -> None:
    ros2 = pytest.importorskip("mcap_ros2.writer", reason="extra import")
    with open(path, "wb") as stream:
        writer = ros2.Writer(stream)
        schema = writer.register_msgdef("sensor_msgs/msg/JointState", JOINT_STATE)
        for k in range(COUNT):
            at = EPOCH * 10**9 + k * 10**6
            message = {
                "header": {"stamp": {"sec": at // 10**9, "nanosec": at % 10**9}, "frame_id": ""},
                "name": ["wrist", "elbow"], "position": [0.0, Q[k]], "velocity": [0.0, 1.0],
                "effort": [1.0, F[k]],
            }  # fmt: skip
            writer.write_message("/joint_states", schema, message, log_time=at + 7 * (k % 5))
        writer.finish()


@pytest.mark.parametrize(("entry", "time"), [("[2]", "header.stamp"), (".elbow", "log_time")])
def test_joint_states_of_ros_2(tmp_path, entry, time):
    write_joint_states(tmp_path / "a.mcap")
    position, force = (f"/joint_states.{name}{entry}" for name in ("position", "effort"))
    clock = f"/joint_states.{time} in s"
    text = map_of(position, force, units=("mrad", "Nm"), axis="elbow", clock=clock)
    log = imported(tmp_path, "a.mcap", text)
    assert (log.sample_rate, log.axes["elbow"].kind.kind) == (1000.0, "rotary")
    assert log.metadata["start_time_unix_ns"] == str(EPOCH * 10**9)
    assert_signals(log, "elbow")
    with pytest.raises(InputError, match=r"did you mean '/joint_states.position"):
        imported(tmp_path, "a.mcap", text.replace("states.position", "states.positin"))


def protobuf_state() -> type:
    """A message of another program: a time stamp, a list of joints with names, numbers, an enum."""
    message, text, double = Kind.TYPE_MESSAGE, Kind.TYPE_STRING, Kind.TYPE_DOUBLE
    file = FileDescriptorProto(
        name="drive.proto", package="acme", syntax="proto3",
        dependency=["google/protobuf/timestamp.proto"],
    )  # fmt: skip
    mode = file.enum_type.add(name="Mode")
    mode.value.add(name="OFF", number=0)
    for name, fields in {
        "Joint": [
            ("name", text, "", 1), ("position", double, "", 1), ("effort", Kind.TYPE_FLOAT, "", 1),
        ],
        "State": [
            ("stamp", message, ".google.protobuf.Timestamp", 1),
            ("joints", message, ".acme.Joint", 3), ("values", double, "", 3),
            ("mode", Kind.TYPE_ENUM, ".acme.Mode", 1), ("raw", Kind.TYPE_BYTES, "", 1),
        ],
    }.items():  # fmt: skip
        made = file.message_type.add(name=name)
        for n, (field, kind, named, label) in enumerate(fields, 1):
            made.field.add(name=field, number=n, type=kind, type_name=named or None, label=label)
    pool = DescriptorPool()
    pool.AddSerializedFile(timestamp_pb2.DESCRIPTOR.serialized_pb)
    pool.AddSerializedFile(file.SerializeToString())
    return GetMessageClass(pool.FindMessageTypeByName("acme.State"))


@pytest.mark.parametrize("column", ["joints[2].{}", "joints.elbow.{}", "values[{}]"])
def test_protobuf_of_other_programs(tmp_path, column):
    state = protobuf_state()
    with open(tmp_path / "a.mcap", "wb") as stream:
        writer = mcap_protobuf.writer.Writer(stream)
        for k in range(COUNT):
            joints = [{"name": "wrist"}, {"name": "elbow", "position": Q[k], "effort": F[k]}]
            at = {"seconds": EPOCH, "nanos": k * 10**6}
            message = state(stamp=at, joints=joints, values=[Q[k], F[k]], raw=b"ab")
            writer.write_message("/state", message, log_time=k * 10**6)
        writer.finish()
    q, f = ("1", "2") if "values" in column else ("position", "effort")
    position, force = (f"/state.{column.format(name)}" for name in (q, f))
    log = imported(tmp_path, "a.mcap", map_of(position, force, clock="/state.stamp in s"))
    assert log.metadata["start_time_unix_ns"] == str(EPOCH * 10**9)
    np.testing.assert_allclose(log.axes["x"].position, 1e-3 * Q, rtol=0, atol=1e-12)
    np.testing.assert_allclose(log.axes["x"].force, F, rtol=1e-6)  # effort is a float of 32 bits
    with pytest.raises(InputError, match=r"no column '/state.jaw'; .*/state.joints.elbow.effort"):
        imported(tmp_path, "a.mcap", map_of("/state.jaw", "/state.jaw"))


def test_json_in_mcap_and_a_damaged_one(tmp_path):
    from mcap.writer import Writer

    with open(tmp_path / "a.mcap", "wb") as stream:
        writer = Writer(stream, chunk_size=4000)
        writer.start()
        channel = writer.register_channel("/drive", "json", 0)
        for k in range(COUNT):
            message = {"a": {"q": float(Q[k])}, "f": [float(F[k]), 0], "on": True, "id": "z"}
            text = json.dumps(message)
            writer.add_message(channel, k * 10**6, text.encode(), k * 10**6)
        writer.finish()
    text = map_of("/drive.a.q", "/drive.f[1]")
    assert_signals(imported(tmp_path, "a.mcap", text))
    intact = (tmp_path / "a.mcap").read_bytes()
    chunk = [r.start for r in of(intact, Opcode.CHUNK)][2]
    # of a chunk that is damaged, or is no chunk any more
    for place, bit, why in ((chunk + 60, 1, "chunk at byte"), (chunk, 128, "unreadable")):
        data = bytearray(intact)
        data[place] ^= bit
        (tmp_path / "a.mcap").write_bytes(data)
        log = imported(tmp_path, "a.mcap", text)
        assert COUNT / 2 < len(log) < COUNT
        lost, counted, kept = import_notes(log)
        assert f"bytes {chunk} to " in lost
        assert why in lost
        assert counted.startswith(f"of {COUNT} messages ")
        assert f"/drive: {len(log)} of " in kept
        np.testing.assert_allclose(log.axes["x"].position, 1e-3 * Q[-len(log) :], atol=1e-12)


def test_times_since_1970_are_shown_as_dates(tmp_path):
    assert instant(1.25) == "1.25 s"
    assert instant(EPOCH + 0.5) == "2023-11-14 22:13:20.5 UTC"
    t = EPOCH + T
    t[200:] += 0.5
    write_csv(tmp_path / "a.csv", {"t": t, "q": Q})
    text = map_of("q", "q", clock="t in s")
    with pytest.raises(InputError, match=r"between 2023-11-14 22:13:20\.199 UTC and 2023"):
        imported(tmp_path, "a.csv", text)


LVM = (
    "LabVIEW Measurement\nSeparator\tTab\nDecimal_Separator\t,\n***End_of_Header***\n\n"
    "Channels\t2\nSamples\t400\t400\nDate\t2024/05/03\t2024/05/03\nX_Dimension\tTime\tTime\n"
    "Delta_X\t0,002\t0,002\n***End_of_Header***\nX_Value\tWeg (mm)\tKraft (N)\tComment\n"
)


def rows(form: str, decimal: str = ".") -> str:
    time, force = 0.002 * np.arange(400), np.cos(5.0 * 0.002 * np.arange(400))
    lines = (form.format(t, 30.0 * np.sin(3.0 * t), f) for t, f in zip(time, force, strict=True))
    return "".join(lines).replace(".", decimal)


@pytest.mark.parametrize(
    ("name", "text", "position"),
    [
        ("a.lvm", LVM + rows("{:.6f}\t{:.6f}\t{:.5f}\n", ","), "Weg (mm)"),
        ("a.dat", "%   t   y_mm   F\n" + rows(3 * "{:16.8E}" + "\n").replace("E", "D"), "y_mm"),
        ("a.jsonl", rows('{{"t": {:.4f}, "axis": {{"pos": {:.6f}, "u": {:.5f}}}}}\n'), "axis.pos"),
        ("a.log", "boot\n" + rows("t: {:.4f} s, pos: {:.6f} mm, u: {:.5f}\n"), "pos [mm]"),
    ],
    ids=["names wider than rows", "a mark before the names", "a table a line", "labels"],
)  # fmt: skip
def test_files_of_other_tools_are_read(tmp_path, name, text, position):
    """A block of settings above the names, Fortran's exponents, JSON lines, a serial plotter."""
    (tmp_path / name).write_text(text)
    table = table_of(tmp_path / name, EVERY_COLUMN)
    np.testing.assert_allclose(
        table.columns[position], 30.0 * np.sin(0.006 * np.arange(400)), atol=1e-5
    )


@pytest.mark.parametrize(
    ("encoding", "names", "position"),
    [
        ("gb18030", "时间(ms),实际位置(mm),电机电流(A)", "实际位置(mm)"),
        ("shift_jis", "時間[s],位置フィードバック[mm],トルク[%]", "位置フィードバック[mm]"),
        ("cp1252", "Zeit [s],Lage für Übung [mm],Kraft [N]", "Lage für Übung [mm]"),
        ("utf-8", "Time [s],位置[mm],F [N]", "位置[mm]"),
    ],
)
def test_the_encoding_is_the_one_in_which_its_words_are_known(tmp_path, encoding, names, position):
    text = f"{names}\n" + rows("{:.4f},{:.6f},{:.5f}\n")
    (tmp_path / "a.csv").write_bytes(text.encode(encoding))
    assert position in table_of(tmp_path / "a.csv", EVERY_COLUMN).columns


def test_names_between_a_title_and_units_and_times_with_a_unit_in_each_cell(tmp_path):
    """As of IndraDrive, whose first name is left out, and of MATLAB's timetables."""
    (tmp_path / "a.csv").write_text(
        "Oszilloskop;;;\n;Lage-Istwert;Kraft-Istwert;\n[ms];[mm];[N];\n"
        + rows("{:.4f};{:.6f};{:.5f};\n", ",")
    )
    assert "Lage-Istwert [mm]" in table_of(tmp_path / "a.csv", EVERY_COLUMN).columns
    (tmp_path / "b.csv").write_text("Time,q,u\n" + rows("{:.4f} sec,{:.6f},{:.5f}\n"))
    columns = table_of(tmp_path / "b.csv", EVERY_COLUMN).columns
    np.testing.assert_allclose(columns["Time [sec]"], 0.002 * np.arange(400), atol=1e-9)
