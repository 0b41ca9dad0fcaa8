"""A log written is the log read, by this reader and by the stock one."""

import tracemalloc
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from log_cases import assert_same_log, two_axes
from mcap.data_stream import ReadDataStream
from mcap.reader import NonSeekingReader, make_reader
from mcap.records import Chunk, MessageIndex
from mcap.stream_reader import get_chunk_data_stream

from twin.errors import InputError
from twin.logs import ROTARY_UNITS, AxisLog, Log, read_log, write_log
from twin.logs import writer as encode

decoder = pytest.importorskip(
    "mcap_protobuf.decoder", reason="mcap-protobuf-support is not installed (extra: test)"
)


@pytest.fixture(autouse=True)
def _small_chunks(monkeypatch):
    monkeypatch.setattr(encode, "CHUNK_BYTES", 20_000)


def test_two_axes_and_truth_come_back_whole(tmp_path):
    log = two_axes()
    write_log(log, tmp_path / "a.mcap")
    assert_same_log(read_log(tmp_path / "a.mcap"), log)


def test_writing_what_was_read_gives_the_same_bytes(tmp_path):
    first, second, third = (tmp_path / name for name in ("a.mcap", "b.mcap", "c.mcap"))
    write_log(two_axes(), first)
    write_log(two_axes(), second)
    write_log(read_log(first), third)
    assert first.read_bytes() == second.read_bytes()
    assert first.read_bytes() == third.read_bytes()


def test_the_stock_reader_agrees_bit_for_bit(tmp_path):
    log = two_axes()
    write_log(log, tmp_path / "a.mcap")
    got = {}
    with open(tmp_path / "a.mcap", "rb") as stream:
        reader = make_reader(
            stream, validate_crcs=True, decoder_factories=[decoder.DecoderFactory()]
        )
        for _, channel, message, sample in reader.iter_decoded_messages():
            k = len(got.setdefault(channel.topic, []))
            assert (message.log_time, message.publish_time) == (k * 100_000, k * 100_000)
            assert message.sequence == k
            got[channel.topic].append([getattr(sample, f.name) for f in sample.DESCRIPTOR.fields])
    want = {f"/axis/{n}": axis.columns for n, axis in log.axes.items()}
    want["/truth/x"] = log.truth["x"]
    assert set(got) == set(want)
    for topic, columns in want.items():
        assert np.array(got[topic]).tobytes() == np.column_stack(list(columns.values())).tobytes()


def test_the_container_is_complete_for_stock_tools(tmp_path):
    log = two_axes()
    write_log(log, tmp_path / "a.mcap")
    with open(tmp_path / "a.mcap", "rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        header = reader.get_header()
        metadata = {m.name: m.metadata for m in reader.iter_metadata()}
        attachments = {a.name: a.data for a in reader.iter_attachments()}
        second_chunk = [m for _, _, m in reader.iter_messages("/axis/y", starting_at=49_900_000)]
        stream.seek(0)
        every = NonSeekingReader(stream, validate_crcs=True)  # this one checks the data section
        assert sum(1 for _ in every.iter_messages(log_time_order=False)) == 3 * len(log)
    assert header.library.startswith("proton-twin ")
    assert summary.statistics.message_count == 3 * len(log)
    assert summary.statistics.chunk_count == len(summary.chunk_indexes) > 3
    assert all(len(c.message_index_offsets) == 1 for c in summary.chunk_indexes)
    assert [m.sequence for m in second_chunk] == [499]
    assert metadata["twin"]["axes"] == "x,y"
    assert metadata["twin"]["sample_rate_hz"] == "10000.0"
    assert attachments == log.attachments
    channels = {c.topic: c.metadata for c in summary.channels.values()}
    assert channels["/axis/y"] == {
        "axis": "y",
        "sample_rate_hz": "10000.0",
        "unit.position": "m",
        "unit.current": "A",
        "force_constant": "53.4",
    }
    assert channels["/truth/x"]["unit.position"] == "m"
    assert "unit.z0" not in channels["/truth/x"]


def test_message_index_points_at_the_messages(tmp_path):
    write_log(two_axes(), tmp_path / "a.mcap")
    with open(tmp_path / "a.mcap", "rb") as stream:
        for index in make_reader(stream).get_summary().chunk_indexes:
            stream.seek(index.chunk_start_offset + 9)
            chunk = Chunk.read(ReadDataStream(stream))
            payload = get_chunk_data_stream(chunk)[0].read(chunk.uncompressed_size)
            indexes_end = index.chunk_start_offset + index.chunk_length + index.message_index_length
            stream.seek(indexes_end)
            assert stream.read(1) in (b"\x06", b"\x0f")  # the next chunk, or the data end
            for channel, offset in index.message_index_offsets.items():
                stream.seek(offset + 9)
                records = MessageIndex.read(ReadDataStream(stream)).records
                for time, place in (records[0], records[-1]):
                    assert payload[place] == 5
                    assert int.from_bytes(payload[place + 9 : place + 11], "little") == channel
                    assert int.from_bytes(payload[place + 15 : place + 23], "little") == time


def test_one_sample_and_an_odd_rate(tmp_path):
    for count, rate in ((1, 10_000.0), (5_000, 3_000.0), (5_000, 44_100.5)):
        axis = AxisLog({"position": np.arange(float(count)), "force": np.zeros(count)})
        log = Log(rate, {"motor": axis})
        write_log(log, tmp_path / "a.mcap")
        assert_same_log(read_log(tmp_path / "a.mcap"), log)
        with open(tmp_path / "a.mcap", "rb") as stream:
            for k, (_, _, message) in enumerate(make_reader(stream).iter_messages()):
                assert message.log_time == round(Fraction(k * 10**9) / Fraction(rate))


def test_a_rotary_axis_keeps_its_units(tmp_path):
    columns = {"position": np.ones(3), "current": np.ones(3)}
    log = Log(1e3, {"motor": AxisLog(columns, ROTARY_UNITS, 0.1)})
    write_log(log, tmp_path / "a.mcap")
    assert read_log(tmp_path / "a.mcap").axes["motor"].units == ROTARY_UNITS


def test_axes_can_be_selected(tmp_path):
    log = two_axes()
    write_log(log, tmp_path / "a.mcap")
    got = read_log(tmp_path / "a.mcap", axes=("y",))
    assert list(got.axes) == ["y"]
    assert not got.truth
    assert np.array_equal(got.axes["y"].position, log.axes["y"].position)


def test_reading_needs_little_more_memory_than_the_result(tmp_path, monkeypatch):
    monkeypatch.setattr(encode, "CHUNK_BYTES", 1 << 20)
    count = 200_000
    axis = AxisLog({"position": np.arange(float(count)), "force": np.ones(count)})
    write_log(Log(1e4, {"x": axis, "y": axis}), tmp_path / "a.mcap")
    tracemalloc.start()
    read_log(tmp_path / "a.mcap")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    result = 4 * 8 * count
    assert peak < result + 6 * (1 << 20)


def test_progress_reaches_the_end(tmp_path):
    seen = []
    write_log(two_axes(), tmp_path / "a.mcap", lambda done, total: seen.append((done, total)))
    assert seen == sorted(seen)
    assert seen[-1] == (500, 500)


def test_a_failing_write_leaves_what_was_there(tmp_path):
    target = tmp_path / "a.mcap"

    def fail(done, total):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_log(two_axes(), target, fail)
    assert list(tmp_path.iterdir()) == []
    target.write_bytes(b"older")
    with pytest.raises(KeyboardInterrupt):
        write_log(two_axes(), target, fail)
    assert [(p, p.read_bytes()) for p in tmp_path.iterdir()] == [(target, b"older")]


@pytest.mark.parametrize(
    ("name", "why"), [("no/such/folder/a.mcap", "its folder does not exist"), (".", "is a folder")]
)
def test_a_place_that_cannot_be_written_is_named(tmp_path, name, why):
    with pytest.raises(InputError, match=why):
        write_log(two_axes(), tmp_path / name)


def _with_x(log, **columns):
    axis = replace(log.axes["x"], columns={**log.axes["x"].columns, **columns})
    return replace(log, axes={**log.axes, "x": axis})


def _nan_at(k):
    values = np.ones(500)
    values[k] = np.nan
    return values


BAD_LOGS = [
    (lambda g: _with_x(g, current=_nan_at(123)), r"/axis/x: current is nan at 0.0123 s"),
    (lambda g: _with_x(g, force=np.ones(499)), r"/axis/x: force has shape \(499,\)"),
    (lambda g: _with_x(g, force=np.full(500, "1")), "/axis/x: force holds <U1 values"),
    (lambda g: _with_x(g, torque=np.ones(500)), "unknown signal torque; allowed: setpoint"),
    (lambda g: replace(g, sample_rate=0.0), "sample rate is 0.0 Hz"),
    (lambda g: replace(g, axes={}), "no samples"),
    (lambda g: replace(g, axes={"x/y": g.axes["x"]}), "axis name 'x/y'"),
    (lambda g: replace(g, truth={"x": {"a b": np.ones(500)}}), "/truth/x: column name 'a b'"),
    (lambda g: replace(g, truth={"x": {"a": _nan_at(0)}}), "/truth/x: a is nan at 0 s"),
    (lambda g: replace(g, metadata={"seed": 3}), "metadata seed is 3"),
    (
        lambda g: replace(g, axes={"x": AxisLog({"position": np.ones(3)})}, truth={}),
        "/axis/x: .*position and one of current and force",
    ),
    (
        lambda g: replace(g, axes={"x": replace(g.axes["x"], units={"position": "mm"})}),
        "/axis/x: unit of position is 'mm', allowed is m or rad",
    ),
    (
        lambda g: replace(g, axes={"x": replace(g.axes["x"], force_constant=-1.0)}),
        "/axis/x: force constant is -1.0 N/A",
    ),
]


@pytest.mark.parametrize(("spoil", "message"), BAD_LOGS)
def test_a_log_that_could_not_be_read_back_is_refused(tmp_path, spoil, message):
    with pytest.raises(InputError, match=message) as caught:
        write_log(spoil(two_axes()), tmp_path / "a.mcap")
    assert "\n" not in str(caught.value)
    assert list(tmp_path.iterdir()) == []


def test_the_truth_is_left_out_where_it_is_not_wanted(tmp_path):
    write_log(two_axes(), tmp_path / "a.mcap")
    whole, bare = read_log(tmp_path / "a.mcap"), read_log(tmp_path / "a.mcap", truth=False)
    assert whole.truth
    assert not bare.truth
    assert bare.metadata == whole.metadata
    for name, axis in whole.axes.items():
        np.testing.assert_array_equal(bare.axes[name].position, axis.position)
