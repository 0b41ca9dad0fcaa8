"""Laws of what a file says about itself: definitions agree, times are even, fields stay apart.

Files are put together record by record. Clashes are one clear error each; every tolerance is
entered from both sides.
"""

import re
import struct

import numpy as np
import pytest
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, DataEnd, Footer, Header, Message, Metadata, Schema
from mcap_bytes import MAGIC, joined, json_channel, json_message, json_schema, plain_file
from plain_cases import HEAD, MS, SAMPLES, accepted, refused, sample

from twin.errors import InputError
from twin.importers.units import field_unit
from twin.logs import FIELDS, read_log, recover_log
from twin.logs import container as chunks
from twin.logs.log import LINEAR_UNITS, ROTARY_UNITS
from twin.logs.topics import complete_units

CLASHES = {
    "schema text": (json_schema(1, data=b"{ }"), "schema 1 is defined twice, differently"),
    "schema name": (json_schema(1, name="T"), "schema 1 is defined twice, differently"),
    "schema encoding": (Schema(1, b"{}", "other", "S"), "schema 1 is defined twice, differently"),
    "topic": (json_channel(1, "/axis/y", schema=1), "channel 1 is defined twice, differently"),
    "schema of a channel": (json_channel(1, "/axis/x", schema=2), "channel 1 is defined twice"),
    "metadata": (json_channel(1, "/axis/x", {"a": "b"}, 1), "channel 1 is defined twice"),
    "encoding": (Channel(1, "/axis/x", "cdr", {}, 1), "channel 1 is defined twice, differently"),
}


@pytest.mark.parametrize("case", CLASHES)
@pytest.mark.parametrize("place", [2, 5, 8])
def test_a_definition_that_changes_is_refused(tmp_path, case, place):
    other, message = CLASHES[case]
    items = [*HEAD, *SAMPLES]
    items.insert(place, other)
    refused(tmp_path / "a.mcap", items, message)


def test_definitions_may_be_repeated_word_for_word(tmp_path):
    items = [*HEAD, *SAMPLES[:3], *HEAD, *SAMPLES[3:], *HEAD]
    assert accepted(tmp_path / "a.mcap", items).axes["x"].position.tolist() == [
        10.0 + k for k in range(6)
    ]


def test_a_topic_on_two_channels_is_refused_and_one_that_is_not_wanted_is_not(tmp_path):
    twice = [*HEAD, json_channel(2, "/axis/x", schema=1), sample(0), sample(0, 2)]
    refused(tmp_path / "a.mcap", twice, "two channels have the topic /axis/x")
    y = [json_channel(n, "/axis/y", schema=1) for n in (2, 3)]
    path = tmp_path / "b.mcap"
    path.write_bytes(plain_file([*HEAD, *y, sample(0, 2), sample(0, 3), *SAMPLES]))
    assert len(read_log(path, axes=["x"])) == 6


@pytest.mark.parametrize("name", FIELDS)
def test_a_unit_of_each_field_is_that_of_a_linear_or_of_a_rotary_axis(name):
    linear, rotary = LINEAR_UNITS[name], ROTARY_UNITS[name]
    assert field_unit(name, linear).si == linear
    assert complete_units({name: linear}) == {**LINEAR_UNITS, name: linear}
    assert complete_units({name: rotary}) == (ROTARY_UNITS if linear != rotary else LINEAR_UNITS)
    for wrong in ("mm", "kN", "", "g"):
        with pytest.raises(InputError, match=f"unit of {name} is '{wrong}'"):
            complete_units({name: wrong})


def test_si_units_are_consistent_with_each_other():
    """Rates of a unit are the unit by s and s^2; work is one unit for both kinds of axis."""
    for units, length, force in ((LINEAR_UNITS, "m", "N"), (ROTARY_UNITS, "rad", "N m")):
        assert units == {
            "setpoint_position": length,
            "setpoint_velocity": f"{length}/s",
            "setpoint_acceleration": f"{length}/s^2",
            "position": length,
            "velocity": f"{length}/s",
            "current": "A",
            "force": force,
        }


def test_every_field_arrives_as_itself_in_every_encoding(tmp_path):
    """Fields in another order than the log's, each with its own number."""
    order = np.random.default_rng(8).permutation(FIELDS).tolist()
    values = {f: 1.0 + 10.0 * i for i, f in enumerate(order)}
    ros = "\n".join(f"float64 {f}" for f in order).encode()
    idl = ("module a { struct S {" + "".join(f"double {f};" for f in order) + " }; };").encode()
    doubles = list(values.values())
    cases = {
        "json": (json_schema(1), lambda k: json_message(1, MS * k, values).data),
        "cdr": (
            Schema(1, ros, "ros2msg", "S"),
            lambda k: b"\0\1\0\0" + struct.pack("<7d", *doubles),
        ),
        "cdr ": (
            Schema(1, idl, "ros2idl", "S"),
            lambda k: b"\0\2\0\0" + struct.pack(">7d", *doubles),
        ),
    }
    for encoding, (schema, data) in cases.items():
        items = [schema, Channel(1, "/axis/x", encoding.strip(), {}, 1)]
        items += [Message(1, MS * k, data(k), 0, 0) for k in range(3)]
        columns = accepted(tmp_path / "a.mcap", items).axes["x"].columns
        assert list(columns) == list(FIELDS)
        assert {f: c.tolist() for f, c in columns.items()} == {f: [values[f]] * 3 for f in FIELDS}


def test_only_numbers_of_a_json_message_are_fields(tmp_path):
    first = {"position": 1, "force": 2.5, "velocity": True, "current": "3", "note": None}
    items = [*HEAD, *(json_message(1, MS * k, first) for k in range(2))]
    assert set(accepted(tmp_path / "a.mcap", items).axes["x"].columns) == {"position", "force"}
    for second, message in (
        ({"position": 1}, "has no 'force'"),
        ({"position": 1, "force": "a"}, "no number"),
        ({"position": 1, "force": None}, "no number"),
    ):
        refused(tmp_path / "a.mcap", [*items, json_message(1, 2 * MS, second)], message)
    refused(tmp_path / "a.mcap", [*HEAD, Message(1, 0, b"[1]", 0, 0)], "not an object")


@pytest.mark.parametrize("size", [0, 3, 4, 19, 21, 28])
def test_a_cdr_message_of_another_size_is_refused(tmp_path, size):
    schema = Schema(1, b"float64 position\nfloat64 force", "ros2msg", "S")
    items = [schema, Channel(1, "/axis/x", "cdr", {}, 1)]
    data = (b"\0\1\0\0" + struct.pack("<3d", 1.0, 2.0, 3.0))[:size]
    items += [Message(1, 0, b"\0\1\0\0" + struct.pack("<2d", 1.0, 2.0), 0, 0)]
    refused(tmp_path / "a.mcap", [*items, Message(1, MS, data, 0, 0)], f"{size} bytes where 20 are")


@pytest.mark.parametrize("text", ["0", "-1", "nan", "inf", "-inf", "x", ""])
@pytest.mark.parametrize("key", ["sample_rate_hz", "force_constant"])
def test_a_number_that_must_be_positive_is(tmp_path, key, text):
    items = [json_channel(1, "/axis/x", {key: text}), *SAMPLES]
    refused(tmp_path / "a.mcap", items, f"metadata {key} is {text!r}; give a number above 0")
    items[0] = json_channel(1, "/axis/x", {"force_constant": "1e-300"})
    assert accepted(tmp_path / "a.mcap", items).axes["x"].force_constant == 1e-300


@pytest.mark.parametrize("missing", ["position", "force"])
def test_a_topic_without_position_or_without_force_is_refused_and_its_fields_named(
    tmp_path, missing
):
    values = {"position": 1.0, "force": 2.0, "velocity": 3.0, "note": 4.0}
    del values[missing]
    items = [*HEAD, *(json_message(1, MS * k, values) for k in range(3))]
    lacking = "current or force" if missing == "force" else missing
    there = ", ".join(values)
    refused(
        tmp_path / "a.mcap", items, f"/axis/x has no {lacking}; fields in its messages: {there}"
    )


@pytest.mark.parametrize("k", [0, 4])
def test_a_sample_that_is_no_number_is_named_with_its_number_and_time(tmp_path, k):
    spoilt = json_message(1, MS * k, {"position": 1.0, "force": np.nan})
    items = [*SAMPLES[:k], spoilt, *SAMPLES[k + 1 :]]
    message = rf"/axis/x: force is nan at {k / 1e3:g} s \(sample {k}\)"
    refused(tmp_path / "a.mcap", [*HEAD, *items], message)
    rows = [*HEAD, *SAMPLES[:2]]  # likewise in the second of two batches
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(chunks, "LOOSE_BYTES", len(joined(rows)))
        refused(tmp_path / "a.mcap", [*HEAD, *items], message)


def test_metadata_of_another_name_is_not_the_logs(tmp_path):
    others = {"schema_version": "9", "sample_rate_hz": "7", "source": "other"}
    twin = {"schema_version": "1", "sample_rate_hz": "1000", "source": "this"}
    items = [Metadata("twin", twin), Metadata("other", others), *HEAD, *SAMPLES]
    assert accepted(tmp_path / "a.mcap", items).metadata == twin
    items[0] = Metadata("twin", others)
    refused(tmp_path / "a.mcap", items, "version is '9', this program reads '1'")


@pytest.mark.parametrize(("before", "behind"), [(0, 2), (3, 0), (3, 2)])
def test_what_topics_have_in_common_is_kept_at_the_same_times(tmp_path, before, behind):
    """y begins some samples after x and ends some before it; both are cut to the same times."""
    times = range(before, 12 - behind)
    channels = [json_channel(2, "/axis/y", schema=1)]
    items = [
        *HEAD,
        *channels,
        *(sample(k, c) for k in range(12) for c in (1, 2) if c == 1 or k in times),
    ]
    message = "/axis/x has 12 samples from 0 s to 0.011 s" if not before else "/axis/[xy] has"
    refused(tmp_path / "a.mcap", items, message)
    log, recovery = recover_log(tmp_path / "a.mcap", unproved=True)
    for channel, name in ((1, "x"), (2, "y")):
        assert log.axes[name].position.tolist() == [10.0 * channel + k for k in times]
        assert log.axes[name].force.tolist() == [-100.0 * channel - k for k in times]
    start = f"{before / 1e3:g}"
    assert recovery.kept == f"{len(times)} samples from {start} s"


def test_topics_that_overlap_are_cut_at_both_ends(tmp_path):
    """x holds samples 0 to 9, y those from 4 to 13: both keep 4 to 9."""
    items = [*HEAD, json_channel(2, "/axis/y", schema=1)]
    items += [sample(k, c) for k in range(14) for c in (1, 2) if 4 * (c - 1) <= k < 6 + 4 * c]
    refused(tmp_path / "a.mcap", items, "/axis/x has 10 samples from 0 s to 0.009 s")
    log, recovery = recover_log(tmp_path / "a.mcap", unproved=True)
    assert log.axes["x"].position.tolist() == [10.0 + k for k in range(4, 10)]
    assert log.axes["y"].position.tolist() == [20.0 + k for k in range(4, 10)]
    assert recovery.kept == "6 samples from 0.004 s"


def test_two_gaps_without_a_summary_are_two_losses(tmp_path):
    gone = {4, 5, 20}
    items = [*HEAD, *(sample(k, sequence=k + 1) for k in range(40) if k not in gone)]
    for record_bytes in (1, 200):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(chunks, "LOOSE_BYTES", record_bytes)
            (tmp_path / "a.mcap").write_bytes(plain_file(items))
            log, recovery = recover_log(tmp_path / "a.mcap", unproved=True)
        told = " ".join(recovery.lost)
        assert log.axes["x"].position.tolist() == [10.0 + k for k in range(21, 40)]
        assert re.search(r"message 4 has sequence number 7, expected 5", told)
        assert re.search(r"has sequence number 22, expected 21", told)
        if record_bytes == 1:  # else a gap within a batch costs the batch, which is named
            assert "4 intact samples from 0 s" in told
            assert "14 intact samples from 0.006 s" in told


def test_messages_outside_chunks_are_read_in_order_with_those_inside(tmp_path, monkeypatch):
    inside = joined([*HEAD, *(sample(k) for k in (3, 4))])
    chunk = Chunk("", inside, 4 * MS, 3 * MS, 0, len(inside))
    items = [*HEAD, *(sample(k) for k in range(3)), chunk, sample(5), sample(6), sample(7)]
    size = len(joined([sample(0)]))
    for limit in (1, 2 * size, 1 << 20):
        monkeypatch.setattr(chunks, "LOOSE_BYTES", limit)
        log = accepted(tmp_path / "a.mcap", items)
        assert log.axes["x"].position.tolist() == [10.0 + k for k in range(8)]
    bad = [*items[:-1], json_message(1, 7 * MS, {"position": 1})]
    data = plain_file(bad)
    place = data.rindex(joined([sample(5)])[:30])
    refused(tmp_path / "a.mcap", bad, f"messages from byte {place}: /axis/x: a JSON message has no")


@pytest.mark.parametrize("length", [3, 5])
def test_a_data_end_of_another_size_is_damage(tmp_path, length):
    builder = RecordBuilder()
    builder.start_record(Opcode.DATA_END)
    builder.write(bytes(length))
    builder.finish_record()
    head = MAGIC + joined([Header("", ""), *HEAD, *SAMPLES])
    for end, good in ((joined([DataEnd(0)]), True), (builder.end(), False)):
        (tmp_path / "a.mcap").write_bytes(head + end + joined([Footer(0, 0, 0)]) + MAGIC)
        if good:
            assert len(read_log(tmp_path / "a.mcap")) == 6
        else:
            with pytest.raises(InputError, match="before the summary"):
                read_log(tmp_path / "a.mcap")


def test_zero_stands_for_no_checksum_and_nothing_else_does(tmp_path):
    head = MAGIC + joined([Header("", ""), *HEAD, *SAMPLES])
    for data_crc, summary_crc in ((0, 0), (1, 0), (0, 1)):
        footer = Footer(len(head) + 13, 0, summary_crc)
        data = head + joined([DataEnd(data_crc), *HEAD, footer]) + MAGIC
        (tmp_path / "a.mcap").write_bytes(data)
        if data_crc == summary_crc == 0:
            assert len(read_log(tmp_path / "a.mcap")) == 6
        else:
            with pytest.raises(InputError, match="wrong checksum"):
                read_log(tmp_path / "a.mcap")
