"""Laws of what a log says about itself: definitions agree, times are even, fields stay apart.

Files are put together record by record. Clashes are one clear error each, and so is what is no log.
"""

import struct
import zlib
from collections.abc import Iterable, Mapping

import numpy as np
import pytest
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from google.protobuf.message_factory import GetMessages
from mcap.records import Channel, Chunk, DataEnd, Footer, Header, Message, Metadata, Schema
from mcap_bytes import MAGIC, joined, json_channel, log_file, plain_file

from twin.errors import InputError
from twin.logs import FIELDS, LINEAR_UNITS, ROTARY_UNITS, Log, read_log, recover_log
from twin.logs.topics import file_descriptor_set, tag

MS = 1_000_000
RATED = {"sample_rate_hz": "1000"}


def schema(number: int = 1, fields: Iterable[str] = ("position", "force")) -> Schema:
    """The schema of a message of these fields, numbered from 1."""
    numbers = {name: n for n, name in enumerate(fields, 1)}
    data = file_descriptor_set("twin.AxisSample", numbers)
    return Schema(number, data, "protobuf", "twin.AxisSample")


def channel(
    number: int, topic: str, metadata: Mapping[str, str] | None = None, of: int = 1
) -> Channel:
    """A channel of such messages at 1 kHz."""
    return Channel(number, topic, "protobuf", {**RATED, **(metadata or {})}, of)


def message(channel: int, k: int, values: Mapping[str, float], time: int | None = None) -> Message:
    """Message k of a channel, one a ms or at a time in ns."""
    data = b"".join(tag(n) + struct.pack("<d", value) for n, value in enumerate(values.values(), 1))
    at = MS * k if time is None else time
    return Message(channel, at, data, at, k)


def sample(k: int, channel: int = 1, time: int | None = None) -> Message:
    """Sample k of a channel: numbers that no other sample of the file has."""
    values = {"position": 10.0 * channel + k, "force": -100.0 * channel - k}
    return message(channel, k, values, time)


HEAD = [schema(), channel(1, "/axis/x")]
SAMPLES = [sample(k) for k in range(6)]


def refused(path, items, text: str) -> str:
    """The one line, naming the file, that a log of these records is answered with."""
    path.write_bytes(log_file(items))
    with pytest.raises(InputError, match=text) as caught:
        read_log(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)
    return str(caught.value)


def accepted(path, items) -> Log:
    """The log of a file of these records."""
    path.write_bytes(log_file(items))
    return read_log(path)


OWN = schema()
FULL = {"position": 1.0, "force": 2.0, "velocity": 3.0, "note": 4.0}


def stated(metadata: dict[str, str]) -> list:
    """Samples of a channel that says so."""
    return [HEAD[0], channel(1, "/axis/x", metadata), *SAMPLES]


def encoded(given: Schema, encoding: str, data: bytes) -> list:
    """Messages in some other encoding."""
    sent = [Message(1, MS * k, data, MS * k, k) for k in range(3)]
    return [given, Channel(1, "/axis/x", encoding, RATED, 1), *sent]


def without(name: str) -> list:
    values = {n: v for n, v in FULL.items() if n != name}
    return [schema(1, values), HEAD[1], *(message(1, k, values) for k in range(3))]


def later(off: int) -> list:
    """The samples from number 3 on are off in time."""
    return [*HEAD, *SAMPLES[:3], *(sample(k, time=MS * k + off) for k in range(3, 6))]


AT_3 = ".* at sample 3, expected a sample every 0.001 s .1000 Hz."
IMPORT = "(/axis/x|chunk at byte).*twin import"
REFUSED = {
    **{f"another {what}": ([*HEAD, other, *SAMPLES], text) for what, other, text in (
        ("schema text", schema(1, ("position",)), "schema 1 is defined twice, differently"),
        ("schema name", Schema(1, OWN.data, "protobuf", "T"), "schema 1 is defined twice"),
        ("topic", channel(1, "/axis/y"), "channel 1 is defined twice, differently"),
        ("schema of a channel", channel(1, "/axis/x", of=2), "channel 1 is defined twice"),
        ("metadata", channel(1, "/axis/x", {"a": "b"}), "channel 1 is defined twice"),
        ("encoding", Channel(1, "/axis/x", "cdr", RATED, 1), "channel 1 is defined twice"),
    )},
    "a topic twice": ([*HEAD, channel(2, "/axis/x"), sample(0), sample(0, 2)],
                      "two channels have the topic /axis/x"),
    "JSON": (encoded(Schema(1, b"{}", "jsonschema", "S"), "json", b'{"position": 1.0}'), IMPORT),
    "ROS 2": (encoded(Schema(1, b"float64 position", "ros2msg", "S"), "cdr", bytes(12)), IMPORT),
    "a broken schema": (encoded(Schema(1, b"\xff", "protobuf", "S"), "protobuf", b""),
                        "/axis/x.* cannot be used"),
    "a schema of another name": (encoded(OWN, "protobuf", b"\x09" + bytes(8)), IMPORT),
    "a schema without a package": (
        encoded(Schema(1, OWN.data, "protobuf", "S"), "protobuf", b""), IMPORT),
    "fields left out": ([*HEAD, *SAMPLES[:2], message(1, 2, {"position": 3.0}), *SAMPLES[3:]],
                        "not laid out .*twin import"),
    "no sample rate": ([HEAD[0], Channel(1, "/axis/x", "protobuf", {}, 1), *SAMPLES],
                       "states no sample rate; .*twin import"),
    **{f"{key} {text}": (stated({key: text}), f"metadata {key} is {text!r}; give a number above 0")
       for key in ("sample_rate_hz", "force_constant")
       for text in ("0", "nan", "x")},
    **{f"no {name}": (without(name), f"/axis/x has no {lacking}; fields in its messages: {there}$")
       for name, lacking, there in (("position", "position", "force, velocity, note.*"),
                                    ("force", "current or force", "position, velocity, note.*"))},
    **{f"{name} in {unit}": (stated({f"unit.{name}": unit}), f"unit of {name} is '{unit}'")
       for name in FIELDS for unit in ("mm", "")},
    **{f"nan {k}": ([*HEAD, *SAMPLES[:k], message(1, k, {"position": 1.0, "force": np.nan}),
                     *SAMPLES[k + 1 :]], rf"/axis/x: force is nan at {k / 1e3:g} s .sample {k}.")
       for k in (0, 4)},
    **{f"{off} ns late": (later(off), fault + AT_3) for off, fault in (
        (3, "uneven time"), (-3, "uneven time"), (MS // 2, "uneven time"),
        (MS, "gap: 0.002 s is followed by 0.004 s"), (-MS, "time does not increase"))},
    "a missing message": ([*HEAD, *SAMPLES[:4], SAMPLES[5]],
                          "message 4 has sequence number 5, expected 4"),
    "another version": ([Metadata("twin", {"schema_version": "9"}), *HEAD, *SAMPLES],
                        "version is '9', this program reads '1'"),
    **{topic: ([json_channel(5, topic), Message(5, 0, b"{}", 0, 0)],
               f"topics in the file: {topic}; rename them")
       for topic in ("/camera", "/axis/1x", "/axis/x/y", "/axes/x")},
    "no channel": ([Message(77, 0, b"{}", 0, 0)], "channel 77, which is not defined"),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_not_as_this_program_writes_it_is_refused_in_one_line(tmp_path, case):
    refused(tmp_path / "a.mcap", *REFUSED[case])


def test_a_message_outside_the_chunks_is_left_to_the_import(tmp_path):
    (tmp_path / "a.mcap").write_bytes(plain_file([*HEAD, *SAMPLES]))
    with pytest.raises(InputError, match=r"outside the chunks; .*twin import"):
        read_log(tmp_path / "a.mcap")


def test_what_may_be_otherwise_is_accepted(tmp_path):
    """Definitions again, a topic twice that is not wanted, any first number, other metadata."""
    path = tmp_path / "a.mcap"
    assert accepted(path, [*HEAD, *HEAD, *SAMPLES]).axes["x"].position.tolist() == [
        10.0 + k for k in range(6)
    ]
    assert len(accepted(path, [*HEAD, *SAMPLES[2:]])) == 4
    y = [channel(n, "/axis/y") for n in (2, 3)]
    path.write_bytes(log_file([*HEAD, *y, *(sample(0, n) for n in (1, 2, 3))]))
    assert len(read_log(path, axes=["x"])) == 1
    assert accepted(path, stated({"force_constant": "1e-300"})).axes["x"].force_constant == 1e-300
    twin = {"schema_version": "1", "sample_rate_hz": "1000", "source": "this"}
    other = {"schema_version": "9", "sample_rate_hz": "7", "source": "other"}
    items = [Metadata("twin", twin), Metadata("other", other), *HEAD, *SAMPLES]
    assert accepted(path, items).metadata == twin


@pytest.mark.parametrize("name", FIELDS)
def test_a_unit_of_each_field_is_that_of_a_linear_or_of_a_rotary_axis(tmp_path, name):
    for given, other in ((LINEAR_UNITS, ROTARY_UNITS), (ROTARY_UNITS, LINEAR_UNITS)):
        items = [schema(1, FIELDS), channel(1, "/axis/x", {f"unit.{name}": given[name]})]
        items += [message(1, 0, dict.fromkeys(FIELDS, 1.0))]
        wanted = given if given[name] != other[name] else LINEAR_UNITS
        assert accepted(tmp_path / "a.mcap", items).axes["x"].units == wanted


@pytest.mark.parametrize("time", [1 << 62, 1 << 63, (1 << 64) - 1])
@pytest.mark.parametrize("k", [0, 5])
def test_a_time_that_no_clock_shows_is_one_line(tmp_path, time, k):
    path = tmp_path / "a.mcap"
    samples = [sample(j, time=time if j == k else None) for j in range(6)]
    refused(path, [*HEAD, *samples], "/axis/x: ")
    with pytest.raises(InputError, match="nothing can be recovered"):
        recover_log(path)


@pytest.mark.parametrize("rate", ["9999", "1e-300", "999.999"])
def test_a_rate_that_the_times_deny_is_not_believed(tmp_path, rate):
    path = tmp_path / "a.mcap"
    refused(path, [HEAD[0], channel(1, "/axis/x", {"sample_rate_hz": rate}), *SAMPLES], "/axis/x: ")
    with pytest.raises(InputError, match="nothing can be recovered"):
        recover_log(path)
    lying = Metadata("twin", {"sample_rate_hz": rate})
    refused(path, [lying, *HEAD, *SAMPLES], "x is sampled at 1000 Hz, the metadata says")
    assert recover_log(path)[0].sample_rate == 1000.0


@pytest.mark.parametrize("y", [range(10), range(3, 12), range(3, 10), range(4, 14)], ids=str)
def test_what_topics_have_in_common_is_kept_at_the_same_times(tmp_path, y):
    """Each in a chunk of its own; the longest stretch is the one with most samples of all."""
    x = range(12)
    data = [[*HEAD, *(sample(k) for k in x)]]
    data += [[HEAD[0], channel(2, "/axis/y"), *(sample(k, 2) for k in y)]]
    chunks = [log_file(items)[len(MAGIC) + len(joined([Header("", "test")])) :] for items in data]
    ends = len(joined([DataEnd(0), Footer(0, 0, 0)])) + len(MAGIC)
    path = tmp_path / "a.mcap"
    head = MAGIC + joined([Header("", "test")])
    path.write_bytes(head + chunks[0][:-ends] + chunks[1])
    with pytest.raises(InputError, match=r"/axis/[xy] has \d+ samples from .*other topics differ"):
        read_log(path)
    both = range(y.start, min(x.stop, y.stop))
    log, recovery = recover_log(path)
    for number, name in ((1, "x"), (2, "y")):
        assert log.axes[name].position.tolist() == [10.0 * number + k for k in both]
    assert recovery.kept == f"{len(both)} samples from {both.start / 1e3:g} s"


def in_one_chunk(content: bytes) -> bytes:
    """A file of these schema, channel and message records, with their checksum."""
    return plain_file([Chunk("", content, 0, 0, zlib.crc32(content), len(content))])


def test_of_a_message_only_values_and_the_publish_time_may_be_any(tmp_path):
    """Opcode, length, channel, number, time and tags are what they must be, in every message."""
    path, content = tmp_path / "a.mcap", joined([*HEAD, *SAMPLES])
    size = len(joined(SAMPLES[-1:]))
    free = {*range(23, 31), *range(32, 40), *range(41, 49)}
    for place in range(size):
        spoilt = bytearray(content)
        spoilt[len(content) - size + place] ^= 0x10
        path.write_bytes(in_one_chunk(bytes(spoilt)))
        if place in free:
            assert len(read_log(path)) == len(SAMPLES), place
        else:
            with pytest.raises(InputError, match="chunk at byte"):
                read_log(path)


def test_a_record_cut_off_within_a_chunk_is_refused(tmp_path):
    content, path = joined([*HEAD, *SAMPLES]), tmp_path / "a.mcap"
    head = len(joined(HEAD))
    size = len(joined(SAMPLES[:1]))
    for cut in (1, 8, 10, 20, head - 1, head + 1, head + 9, head + 12, len(content) - size + 31):
        path.write_bytes(in_one_chunk(content[:cut]))
        with pytest.raises(InputError):
            read_log(path)


@pytest.mark.parametrize("numbers", [(1, 2), (15, 16), (2047, 2048), (300_000, 3)], ids=str)
def test_fields_may_have_any_numbers_but_are_in_the_order_of_the_schema(tmp_path, numbers):
    """Of tags of one to four bytes; the library writes them in the order of their numbers."""
    kinds = dict(zip(("position", "force"), numbers, strict=True))
    descriptors = file_descriptor_set("twin.AxisSample", kinds)
    items = [Schema(1, descriptors, "protobuf", "twin.AxisSample"), HEAD[1]]
    kind = GetMessages(FileDescriptorSet.FromString(descriptors).file)["twin.AxisSample"]
    for k in range(4):
        data = kind(position=k + 1.0, force=-k - 1.0).SerializeToString()
        items.append(Message(1, MS * k, data, MS * k, k))
    if numbers[0] > numbers[1]:
        refused(tmp_path / "a.mcap", items, "not laid out")
    else:
        axis = accepted(tmp_path / "a.mcap", items).axes["x"]
        assert axis.position.tolist() == (-axis.force).tolist() == [1.0, 2.0, 3.0, 4.0]


@pytest.mark.parametrize("read", [read_log, recover_log])
@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda p: None, "cannot be read: No such file or directory"),
        (lambda p: p.mkdir(), "cannot be read: Is a directory"),
        (lambda p: p.write_bytes(b""), "the file is empty|nothing can be recovered"),
        (lambda p: p.write_bytes(b"time,position\n" * 50), "not an MCAP file|nothing can be"),
        (lambda p: p.write_bytes(MAGIC), "truncated: ends at byte 8|nothing can be"),
    ],
)
def test_what_is_no_log_is_one_clear_line(tmp_path, read, make, text):
    path = tmp_path / "a.mcap"
    make(path)
    with pytest.raises(InputError, match=text) as caught:
        read(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)
