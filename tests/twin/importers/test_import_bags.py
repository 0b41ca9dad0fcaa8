"""Bags of other writers: cut, damaged, with other publishers, joints and encodings."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import cli_runs
import numpy as np
import pytest
from import_cases import guess_map, map_of, mapping
from mcap.writer import CompressionType, Writer

from twin.errors import InputError
from twin.importers import import_log, import_notes
from twin.logs import Log, recover_file

COUNT = 1500
T = 2e-3 * np.arange(COUNT)
Q, F = np.round(50.0 * np.sin(3.0 * T), 4), np.round(-0.4 * np.sin(3.0 * T), 5)
EPOCH = 1_700_000_000 * 10**9
MAP = map_of("/drive.q", "/drive.f", clock="/drive.t in s")


def message(k: int) -> dict:
    return {"t": T[k], "q": Q[k], "f": F[k]}


def write_bag(
    path: Path, of: Callable[[int], dict] = message, second: Callable[[int], dict] | None = None,
    compression: CompressionType = CompressionType.ZSTD, chunk: int = 4000,
) -> None:  # fmt: skip
    """Messages of JSON on /drive, and some of another publisher of it."""
    with open(path, "wb") as stream:
        writer = Writer(stream, chunk_size=chunk, compression=compression)
        writer.start()
        schema = writer.register_schema("Drive", "jsonschema", b'{"type": "object"}')
        first = writer.register_channel("/drive", "json", schema)
        other = second and writer.register_channel("/drive", "json", schema)
        for k in range(COUNT):
            at = EPOCH + 2_000_000 * k
            writer.add_message(first, at, json.dumps(of(k)).encode(), at)
            if second is not None and other is not None and k % 5 == 0:
                writer.add_message(other, at + 300, json.dumps(second(k)).encode(), at + 300)
        writer.finish()


def imported(path: Path, text: str = MAP) -> Log:
    return import_log(path, mapping(path.parent, text))


@pytest.mark.parametrize(
    "compression", [CompressionType.ZSTD, CompressionType.LZ4, CompressionType.NONE]
)
@pytest.mark.parametrize("share", [0.3, 0.61, 0.9])
def test_of_a_bag_that_was_cut_off_whole_chunks_are_read_and_recovered(
    tmp_path, compression, share
):
    path, good = tmp_path / "a.mcap", tmp_path / "good.mcap"
    write_bag(path, compression=compression)
    data = path.read_bytes()
    path.write_bytes(data[: int(share * len(data))])
    log = imported(path)
    assert 0.7 * share * COUNT < len(log) <= COUNT
    np.testing.assert_allclose(log.axes["x"].position, 1e-3 * Q[: len(log)], atol=1e-12)
    told = import_notes(log)[0]
    assert told.startswith("bytes ")
    assert f" to {int(share * len(data)) - 1}" in told
    assert "UTC" in told
    recovery, files = recover_file(path, good)
    assert recovery.kept.startswith(f"{len(log)} messages on /drive")
    assert recovery.lost == (told,)
    assert list(files) == [good]
    whole = imported(good)
    assert not import_notes(whole)
    np.testing.assert_array_equal(whole.axes["x"].position, log.axes["x"].position)


def test_a_bag_without_its_end_has_all_messages(tmp_path):
    path = tmp_path / "a.mcap"
    write_bag(path)
    path.write_bytes(path.read_bytes()[:-60])
    log = imported(path)
    assert len(log) == COUNT
    assert "cut off" in import_notes(log)[0]


def test_of_a_bag_with_a_hole_all_is_recovered_and_the_longest_part_imported(tmp_path):
    path = tmp_path / "a.mcap"
    write_bag(path)
    data = bytearray(path.read_bytes())
    place = len(data) // 4
    data[place : place + 3] = b"\xff\x00\xff"
    path.write_bytes(data)
    log = imported(path)
    told = " ".join(import_notes(log))
    assert "wrong checksum" in told or "cannot be decompressed" in told
    assert f"/drive: {len(log)} of " in told
    assert COUNT / 2 < len(log) < COUNT
    recovery, _ = recover_file(path, tmp_path / "good.mcap")
    assert int(recovery.kept.split()[0]) > len(log)
    done = cli_runs.twin("recover", "a.mcap", "-o", "b.mcap", folder=tmp_path)
    assert done.returncode == 0
    assert "messages on /drive" in done.stdout


def test_a_null_in_one_message_is_named_and_bridged_by_a_clock(tmp_path):
    path = tmp_path / "a.mcap"
    write_bag(path, lambda k: message(k) | ({"f": None} if k == 700 else {}))
    found = guess_map(path)
    assert found.missing[0].startswith("message 701 (1.4 s) has no f ('/drive.f'), as 1 of 1500")
    with pytest.raises(InputError, match=r"message 701 \(1\.4 s\) has no f .* give resample"):
        imported(path)
    log = imported(path, "resample = 500.0\n" + MAP)
    assert len(log) == COUNT
    assert "message 701 (1.4 s) has no f" in import_notes(log)[0]
    assert abs(log.axes["x"].force[700] - F[700]) < 1e-5


def test_a_second_publisher_has_columns_of_its_own(tmp_path):
    path = tmp_path / "a.mcap"
    write_bag(path, second=lambda k: {"t": T[k], "q": -7.0, "g": 2.0})
    log = imported(path)
    np.testing.assert_allclose(log.axes["x"].position, 1e-3 * Q, atol=1e-12)
    assert "/drive has 2 publishers, of 1500, 300 messages" in import_notes(log)[0]
    other = MAP.replace("/drive.", "/drive#2.").replace("#2.f", "#2.g")
    assert set(imported(path, other).axes["x"].position) == {-7e-3}


def joints(k: int) -> dict:
    """Arm and gripper on one topic, in an order that changes."""
    if k % 3 == 2:
        return {"t": T[k], "name": ["finger"], "position": [9.0], "effort": [8.0]}
    order = [0, 1, 2] if k % 2 else [2, 0, 1]
    values = {"wrist": (1.0, 2.0), "elbow": (Q[k], F[k]), "base": (3.0, 4.0)}
    names = [list(values)[j] for j in order]
    return {"t": T[k], "name": names, "position": [values[n][0] for n in names],
            "effort": [values[n][1] for n in names]}  # fmt: skip


def test_joints_go_by_their_names_in_whatever_order_with_others_between(tmp_path):
    path = tmp_path / "a.mcap"
    write_bag(path, joints)
    clock = "resample = 500.0\n"
    text = clock + map_of("/drive.position.elbow", "/drive.effort.elbow", clock="/drive.t in s")
    axis = imported(path, text).axes["x"]
    mine = np.arange(COUNT) % 3 != 2
    expected = np.interp(T[: len(axis.position)], T[mine], 1e-3 * Q[mine])
    np.testing.assert_allclose(axis.position, expected, atol=1e-9)
    numbered = text.replace("position.elbow", "position[2]").replace("effort.elbow", "effort[2]")
    with pytest.raises(InputError, match=r"'/drive.position\[2\]' is '.*wrist' in .*give these"):
        imported(path, numbered)


def test_stamps_that_are_wrong_leave_the_log_times_which_are_offered(tmp_path):
    path = tmp_path / "a.mcap"
    still = {"sec": 1_700_000_000, "nanosec": 0}
    write_bag(path, lambda k: {"stamp": still, "q": Q[k], "f": F[k]})
    text = guess_map(path).text
    assert 'time = {column = "/drive.log_time", unit = "s"}' in text
    wrong = map_of("/drive.q", "/drive.f", clock="/drive.stamp in s")
    with pytest.raises(InputError, match=r"the times of '/drive.log_time' rise: take these"):
        imported(path, wrong)
    slow = {"sec": 1_700_000_000}
    write_bag(path, lambda k: {"stamp": slow | {"nanosec": 1000 * k}, "q": Q[k], "f": F[k]})
    text = guess_map(path).text
    assert 'time = {column = "/drive.log_time", unit = "s"} # rises by 0.002 s' in text
    assert "the times of /drive.stamp take 0.001499 s, these 2.998 s" in text
    assert '# or: time = {column = "/drive.stamp", unit = "s"}' in text


@pytest.mark.parametrize(
    ("encoding", "schema"), [("flatbuffer", "flatbuffer"), ("msgpack", ""), ("cdr", "unknown")]
)
def test_an_encoding_that_is_not_read_is_named(tmp_path, encoding, schema):
    path = tmp_path / "a.mcap"
    with open(path, "wb") as stream:
        writer = Writer(stream)
        writer.start()
        kind = writer.register_schema("D", schema, b"") if schema else 0
        channel = writer.register_channel("/drive", encoding, kind)
        for k in range(30):
            writer.add_message(channel, k, bytes(24), k)
        writer.finish()
    for read in (lambda: imported(path), lambda: guess_map(path)):
        with pytest.raises(InputError, match=f"topic /drive is of encoding {encoding} with"):
            read()


JOINT_STATE = """std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
================================================================================
MSG: std_msgs/Header
{seq}{time} stamp
string frame_id
"""


@pytest.mark.parametrize("encoding", ["cdr", "big cdr", "ros1", "pl cdr"])
def test_messages_of_ros_1_and_of_either_order_of_bytes(tmp_path, encoding):
    typesys = pytest.importorskip("rosbags.typesys", reason="extra import")
    old = encoding == "ros1"
    store = typesys.get_typestore(typesys.Stores.ROS1_NOETIC if old else typesys.Stores.ROS2_HUMBLE)
    definition = JOINT_STATE.format(
        seq="uint32 seq\n" * old, time="time" if old else "builtin_interfaces/Time"
    )
    kind = "sensor_msgs/msg/JointState"
    state, header, time = (store.types[n] for n in (
        kind, "std_msgs/msg/Header", "builtin_interfaces/msg/Time"))  # fmt: skip
    path = tmp_path / "a.mcap"
    with open(path, "wb") as stream:
        writer = Writer(stream)
        writer.start()
        name = "sensor_msgs/JointState" if old else kind
        schema = writer.register_schema(name, "ros1msg" if old else "ros2msg", definition.encode())
        channel = writer.register_channel("/joints", "ros1" if old else "cdr", schema)
        for k in range(200):
            at = EPOCH + 2_000_000 * k
            stamp = time(at // 10**9, at % 10**9)
            values = np.array([1.0, Q[k]]), np.zeros(2), np.array([2.0, F[k]])
            message = state(header(k, stamp, "") if old else header(stamp, ""),
                            ["wrist", "elbow"], *values)  # fmt: skip
            if old:
                data = store.serialize_ros1(message, kind)
            else:
                data = store.serialize_cdr(message, kind, little_endian=encoding != "big cdr")
            data = bytearray(data)
            if encoding == "pl cdr":
                data[1] = 3
            writer.add_message(channel, at, bytes(data), at)
        writer.finish()
    clock = "/joints.header.stamp in s"
    text = map_of("/joints.position.elbow", "/joints.effort.elbow", clock=clock)
    if encoding == "pl cdr":
        with pytest.raises(InputError, match="is of CDR kind 3, which is not read"):
            imported(path, text)
        return
    log = imported(path, text)
    assert log.sample_rate == 500.0
    np.testing.assert_allclose(log.axes["x"].position, 1e-3 * Q[:200], atol=1e-12)


def test_a_message_that_is_none_is_named_though_many_are_decoded_at_once(tmp_path, monkeypatch):
    path = tmp_path / "a.mcap"
    real = json.dumps
    monkeypatch.setattr(json, "dumps", lambda m: real(m) if m["t"] != T[700] else '{"t": 1}, 2')
    write_bag(path)
    with pytest.raises(InputError, match=f"on /drive at {EPOCH + 1_400_000_000} ns cannot be read"):
        imported(path)
