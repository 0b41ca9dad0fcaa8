"""Logs of other writers: the stock MCAP writer with protobuf, JSON and CDR."""

import json
import struct
from dataclasses import replace

import numpy as np
import pytest
from google.protobuf.descriptor_pb2 import FileDescriptorProto, FileDescriptorSet
from google.protobuf.message_factory import GetMessages
from log_cases import assert_same_samples, column, protobuf_encoder, write_foreign
from mcap.writer import CompressionType, Writer

from twin.errors import InputError
from twin.logs import AxisLog, Log, read_log

X_FIELDS = ("position", "velocity", "current")
ROS2MSG = "\n".join(["# drive sample", *(f"float64 {f}  # SI" for f in X_FIELDS)])
ROS2IDL = "module twin { struct S {\n" + "".join(f"  double {f};\n" for f in X_FIELDS) + "}; };"


def same_fields(count: int = 600) -> Log:
    axes = {
        name: AxisLog({f: column(count, i + s) for i, f in enumerate(X_FIELDS)})
        for name, s in (("x", 0), ("y", 7))
    }
    return Log(10_000.0, axes)


def _protobuf(path, log, **options):
    schema, encode = protobuf_encoder(X_FIELDS)
    options.setdefault("schema", ("twin.AxisSample", "protobuf", schema))
    write_foreign(path, log, encode, encoding="protobuf", **options)


def _json(path, log, **options):
    schema = ("twin.AxisSample", "jsonschema", b"{}")
    write_foreign(
        path, log, lambda v: json.dumps(v).encode(), schema=schema, encoding="json", **options
    )


def _cdr(path, log, order=("<", b"\0\1\0\0"), schema=("ros2msg", ROS2MSG), **options):
    def encode(values):
        return order[1] + struct.pack(f"{order[0]}3d", *values.values())

    schema = ("twin/S", schema[0], schema[1].encode())
    write_foreign(path, log, encode, schema=schema, encoding="cdr", **options)


def _cdr_big_endian(path, log, **options):
    _cdr(path, log, order=(">", b"\0\0\0\0"), schema=("ros2idl", ROS2IDL), **options)


@pytest.mark.parametrize("write", [_protobuf, _json, _cdr, _cdr_big_endian])
@pytest.mark.parametrize(
    "options",
    [
        {},
        {"compression": CompressionType.LZ4},
        {"compression": CompressionType.NONE},
        {"use_chunking": False},
        {"chunk_size": 1},
        {"metadata": {"sample_rate_hz": "10000"}},
        {"start": 1_700_000_000_123_456_789},
    ],
    ids=str,
)
def test_stock_written_files_are_read_identically(tmp_path, write, options):
    write(tmp_path / "a.mcap", same_fields(), **options)
    assert_same_samples(read_log(tmp_path / "a.mcap"), same_fields())


def test_fields_in_another_order_and_of_other_types(tmp_path):
    file = FileDescriptorProto(name="s.proto", package="drive", syntax="proto3")
    message = file.message_type.add(name="S")
    message.field.add(name="status", number=1, type=9, label=1)  # a string
    message.field.add(name="current", number=2, type=2, label=1)  # a float
    message.field.add(name="position", number=9, type=1, label=1)  # a double
    schema = FileDescriptorSet(file=[file])
    cls = GetMessages(schema.file)["drive.S"]
    write_foreign(
        tmp_path / "a.mcap",
        log := Log(1e4, {"x": AxisLog({"position": column(50, 1), "current": np.arange(50.0)})}),
        lambda v: cls(status="ok", **v).SerializeToString(),
        schema=("drive.S", "protobuf", schema.SerializeToString()),
        encoding="protobuf",
    )
    assert_same_samples(read_log(tmp_path / "a.mcap"), log)


def test_the_last_value_of_a_repeated_field_counts(tmp_path):
    schema, encode = protobuf_encoder(X_FIELDS)
    write_foreign(
        tmp_path / "a.mcap",
        same_fields(),
        lambda values: (
            encode(dict.fromkeys(values, 1.0)) + encode({f: v or -0.0 for f, v in values.items()})
        ),
        schema=("twin.AxisSample", "protobuf", schema),
        encoding="protobuf",
    )
    got, want = read_log(tmp_path / "a.mcap"), same_fields()
    assert all(np.array_equal(got.axes[n].position, want.axes[n].position) for n in want.axes)


def test_host_times_with_jitter_give_the_nominal_rate(tmp_path):
    jitter = np.random.default_rng(3).integers(-4_000, 4_000, 600)
    log = same_fields()
    _protobuf(tmp_path / "a.mcap", log, times=lambda k: k * 100_000 + 5_000 + int(jitter[k]))
    assert_same_samples(read_log(tmp_path / "a.mcap"), log)


def _spoiled(k, value):
    log = same_fields()
    position = log.axes["y"].columns["position"].copy()
    position[k] = value
    y = replace(log.axes["y"], columns={**log.axes["y"].columns, "position": position})
    return replace(log, axes={**log.axes, "y": y})


RATE = {"sample_rate_hz": "10000"}
FAULTS = [
    (lambda p: _protobuf(p, _spoiled(321, np.nan)), "/axis/y: position is nan at 0.0321 s"),
    (lambda p: _json(p, _spoiled(3, np.inf)), "/axis/y: position is inf at 0.0003 s"),
    (
        lambda p: _protobuf(p, same_fields(), times=lambda k: (k + (k > 99)) * 100_000),
        r"/axis/x: gap: 0.0099 s is followed by 0.0101 s at sample 100",
    ),
    (
        lambda p: _protobuf(
            p, same_fields(), times=lambda k: (k + (k > 99)) * 100_000, metadata=RATE
        ),
        r"/axis/x: gap: 0.0099 s is followed by 0.0101 s at sample 100",
    ),
    (
        lambda p: _protobuf(p, same_fields(), times=lambda k: k * 100_000 if k != 50 else 0),
        "time does not increase: 0.0049 s is followed by 0 s at sample 50",
    ),
    (
        lambda p: _protobuf(p, same_fields(), metadata={"sample_rate_hz": "5000"}),
        r"uneven time: 0 s is followed by 0.0001 s at sample 1, .*\(5000 Hz\)",
    ),
    (
        lambda p: _protobuf(p, same_fields(), metadata={"sample_rate_hz": "fast"}),
        "sample_rate_hz is 'fast'; give a number above 0",
    ),
    (
        lambda p: _protobuf(p, same_fields(), metadata={"unit.position": "mm"}),
        "/axis/x: unit of position is 'mm', allowed is m or rad",
    ),
    (lambda p: _protobuf(p, same_fields(1)), "1 samples do not determine the sample rate"),
    (
        lambda p: _protobuf(p, same_fields(), schema=("twin.AxisSample", "protobuf", b"\xff")),
        "/axis/x: the protobuf schema 'twin.AxisSample' cannot be used",
    ),
    (
        lambda p: _cdr(p, same_fields(), schema=("ros2msg", ROS2MSG + "\nstring name")),
        "/axis/x: the CDR message 'twin/S' does not consist of float64 fields alone",
    ),
    (
        lambda p: write_foreign(
            p, same_fields(), lambda v: b"", schema=("S", "capnproto", b""), encoding="capnproto"
        ),
        "/axis/x: messages are encoded as 'capnproto'",
    ),
    (
        lambda p: write_foreign(
            p, same_fields(), lambda v: b"[" * 99_999, schema=("S", "", b""), encoding="json"
        ),
        "a message is not valid JSON",
    ),
]


@pytest.mark.parametrize(("write", "message"), FAULTS)
def test_faults_of_other_writers_are_named(tmp_path, write, message):
    write(tmp_path / "a.mcap")
    with pytest.raises(InputError, match=message) as caught:
        read_log(tmp_path / "a.mcap")
    assert "\n" not in str(caught.value)
    assert str(tmp_path / "a.mcap") in str(caught.value)


@pytest.mark.parametrize("missing", ["position", "current"])
def test_a_missing_field_is_named_with_those_there(tmp_path, missing):
    x = {f: c for f, c in same_fields().axes["x"].columns.items() if f != missing}
    _json(tmp_path / "a.mcap", Log(1e4, {"x": AxisLog(x)}))
    with pytest.raises(InputError, match=f"/axis/x has no {missing}.*velocity"):
        read_log(tmp_path / "a.mcap")


def test_topics_that_hold_no_axis_are_listed(tmp_path):
    with open(tmp_path / "a.mcap", "wb") as stream:
        writer = Writer(stream)
        writer.start()
        channel = writer.register_channel("/axes/x", "json", 0)
        writer.add_message(channel, 0, b"{}", 0)
        writer.finish()
    with pytest.raises(InputError, match=r"no samples on a topic /axis/<name>.*: /axes/x; rename"):
        read_log(tmp_path / "a.mcap")


def _two_json_axes(path, y_count, y_step, y_start=0):
    with open(path, "wb") as stream:
        writer = Writer(stream)
        writer.start()
        for name, count, step, start in (("x", 10, 100_000, 0), ("y", y_count, y_step, y_start)):
            channel = writer.register_channel(f"/axis/{name}", "json", 0)
            for k in range(count):
                time = 20_000 + start + k * step
                writer.add_message(channel, time, b'{"position": 1, "force": 2}', 0, k)
        writer.finish()


def test_axes_of_different_length_are_refused(tmp_path):
    _two_json_axes(tmp_path / "a.mcap", 9, 100_000)
    with pytest.raises(InputError, match=r"/axis/x has 10 samples from .* to 0.00092 s"):
        read_log(tmp_path / "a.mcap")


def test_axes_of_different_rate_are_refused(tmp_path):
    _two_json_axes(tmp_path / "a.mcap", 5, 200_000)
    with pytest.raises(InputError, match="/axis/x is sampled at 10000 Hz, /axis/y says 5000 Hz"):
        read_log(tmp_path / "a.mcap")


def test_axes_stamped_one_after_the_other_are_simultaneous(tmp_path):
    _two_json_axes(tmp_path / "a.mcap", 10, 100_000, y_start=40_000)
    assert len(read_log(tmp_path / "a.mcap").axes["y"]) == 10


def test_a_lost_message_shows_in_the_sequence_numbers(tmp_path):
    with open(tmp_path / "a.mcap", "wb") as stream:
        writer = Writer(stream)
        writer.start()
        channel = writer.register_channel("/axis/x", "json", 0)
        for k in range(10):
            data = b'{"position": 1, "force": 2}'
            writer.add_message(channel, k * 100_000, data, 0, sequence=k + (k > 6))
        writer.finish()
    with pytest.raises(InputError, match="message 7 has sequence number 8, expected 7"):
        read_log(tmp_path / "a.mcap")
