"""Laws of times, schemas and rows: exact times, one field a number, rows that lie as described."""

from fractions import Fraction

import numpy as np
import pytest
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from google.protobuf.message_factory import GetMessages
from mcap.records import Channel, Message, Schema
from mcap_bytes import CHANNEL, SCHEMA, joined, json_channel, parsed, records

from twin.errors import InputError
from twin.logs import AxisLog, Log, write_log
from twin.logs.decode import Decoder
from twin.logs.layout import MessageLayout, RowLayout, sample_times
from twin.logs.schema import fields_of, file_descriptor_set, protobuf_segments, segments_of
from twin.logs.topics import Topics


def exact(k: int, rate: float) -> int:
    return round(Fraction(k * 10**9) / Fraction(rate))


@pytest.mark.parametrize("rate", [1.0, 3.0, 50.0, 999.5, 1000.0, 44_100.5, 65_537.0, 1e6 / 7.0])
def test_times_are_exact_at_every_rate_for_an_hour(rate):
    """A double resolves a thousandth of a nanosecond there."""
    rng = np.random.default_rng(11)
    for first in (0, 1, *(int(k) for k in rng.integers(2, 3600.0 * rate, 40))):
        times = sample_times(first, 3, rate)
        assert times.tolist() == [exact(k, rate) for k in range(first, first + 3)]


def test_equal_axes_share_one_schema_and_others_do_not(tmp_path):
    columns = {"position": np.arange(3.0), "force": np.arange(3.0)}
    other = {"position": np.arange(3.0), "current": np.arange(3.0)}
    axes = {"a": AxisLog(columns), "b": AxisLog(columns), "c": AxisLog(other)}
    write_log(Log(100.0, axes), tmp_path / "a.mcap")
    data = (tmp_path / "a.mcap").read_bytes()
    assert [parsed(Schema, p).id for p in records(data) if p.opcode == SCHEMA] == [1, 2]
    assert [parsed(Channel, p).schema_id for p in records(data) if p.opcode == CHANNEL] == [1, 1, 2]
    assert [parsed(Channel, p).id for p in records(data) if p.opcode == CHANNEL] == [1, 2, 3]


@pytest.mark.parametrize("number", [1, 15, 16, 100, 2047, 2048, 300_000])
def test_a_payload_is_its_segments_and_segments_are_its_payload(number):
    numbers = {"late": number, "early": number + 1}
    descriptors = file_descriptor_set("twin.Any", numbers)
    kind = GetMessages(FileDescriptorSet.FromString(descriptors).file)["twin.Any"]
    fields = fields_of(
        Channel(1, "/axis/x", "protobuf", {}, 1), Schema(1, descriptors, "protobuf", "twin.Any")
    )
    stock = kind(late=1.5, early=-2.5).SerializeToString()
    segments = protobuf_segments(numbers)
    doubles = {"late": np.float64(1.5).tobytes(), "early": np.float64(-2.5).tobytes()}
    assert b"".join(doubles[s] if isinstance(s, str) else s for s in segments) == stock
    assert segments_of(stock, fields) == segments
    assert fields == {number: "late", number + 1: "early"}
    for size in range(len(stock)):  # a payload cut off is never taken for one of this layout
        assert segments_of(stock[:size], fields) is None


LAYOUT = RowLayout(
    (MessageLayout(3, (b"ab", "u", "v", b"c")), MessageLayout(258, ("w", b"defg", "q")))
)


def rows_of(count: int) -> tuple[np.ndarray, bytes]:
    rows = np.zeros(count, LAYOUT.dtype)
    for k, (message, part) in enumerate(LAYOUT.parts(rows)):
        part[:] = message.template
        part[".sequence"] = 100 * k + np.arange(count)
        part[".log_time"] = 7_000 * k + np.arange(count)
        for name in LAYOUT.messages[k].names:
            part[name] = ord(name) + np.arange(count) / 8.0
    return rows, rows.tobytes()


def test_a_row_lies_as_the_format_says():
    """Each record by hand: opcode, length, channel, sequence, two times, then the payload."""
    _, data = rows_of(2)
    expected = b""
    for k in range(2):
        for number, payload in (
            (3, [b"ab", ord("u"), ord("v"), b"c"]),
            (258, [ord("w"), b"defg", ord("q")]),
        ):
            body = b"".join(
                p if isinstance(p, bytes) else np.array(p + k / 8.0, "<f8").tobytes()
                for p in payload
            )
            head = number.to_bytes(2, "little") + (100 * (number > 3) + k).to_bytes(4, "little")
            head += (7_000 * (number > 3) + k).to_bytes(8, "little") + bytes(8)
            content = head + body
            expected += b"\x05" + len(content).to_bytes(8, "little") + content
    assert data == expected


@pytest.mark.parametrize("before", [0, 5])
@pytest.mark.parametrize("behind", [0, 30])
@pytest.mark.parametrize("count", [1, 4])
def test_rows_are_taken_whole_from_where_they_begin(before, behind, count):
    _, data = rows_of(count)
    rows = LAYOUT.rows(b"\xff" * before + data + b"\xff" * behind, before)
    assert rows.tobytes() == data
    blocks = {b.channel: b for b in LAYOUT.blocks(rows)}
    assert blocks[3].sequence.tolist() == list(range(count))
    assert blocks[258].log_time.tolist() == [7_000 + k for k in range(count)]
    got = {name: c.tolist() for b in blocks.values() for name, c in b.columns.items()}
    assert got == {n: [ord(n) + k / 8.0 for k in range(count)] for n in "uvwq"}
    assert LAYOUT.rows(data[:-1], 0) is None or count > 1
    assert LAYOUT.rows(b"", 0) is None


def test_a_byte_that_is_the_same_in_every_row_must_be_so_and_no_other():
    """Opcode, length, channel and literals, in the last of three rows; all else may vary."""
    _, data = rows_of(3)
    size = len(data) // 3
    second = 31 + 19
    constant = {*range(11), 31, 32, 31 + 18, *range(second, second + 11)}
    constant |= set(range(second + 39, second + 43))
    for place in range(size):
        spoilt = bytearray(data)
        spoilt[2 * size + place] ^= 0x10
        assert (LAYOUT.rows(bytes(spoilt), 0) is None) == (place in constant), place


def decoded(items, extra: bytes = b"") -> dict[int, list[tuple]]:
    """Samples by channel of some bytes."""
    found: dict[int, list[tuple]] = {}
    for block in Decoder(Topics()).blocks(joined(items) + extra):
        columns = [block.columns[n] for n in sorted(block.columns)]
        rows = zip(block.sequence.tolist(), block.log_time.tolist(), *columns, strict=True)
        found.setdefault(block.channel, []).extend(rows)
    return found


def protobuf_items():
    """Two protobuf channels whose messages alternate, all numbers distinct."""
    numbers = {"position": 4, "force": 7}
    descriptors = file_descriptor_set("twin.AxisSample", numbers)
    kind = GetMessages(FileDescriptorSet.FromString(descriptors).file)["twin.AxisSample"]
    items = [
        Schema(1, descriptors, "protobuf", "twin.AxisSample"),
        *(Channel(c, f"/axis/{n}", "protobuf", {}, 1) for c, n in ((4, "x"), (9, "y"))),
    ]
    want: dict[int, list[tuple]] = {4: [], 9: []}
    for k in range(6):
        for c in (4, 9):
            force, position = 1.0 + 10.0 * c + k / 8.0, -2.0 - 10.0 * c - k / 8.0
            data = kind(position=position, force=force).SerializeToString()
            items.append(Message(c, 1000 * k + c, data, 0, 50 * c + k))
            want[c].append((50 * c + k, 1000 * k + c, force, position))
    return items, want


def test_samples_arrive_by_channel_and_chunks_of_no_axis_are_passed_over():
    items, want = protobuf_items()
    assert decoded(items) == want
    for topic in ("/camera", "/axis/1x", "/axis/x/y", "/axes/x"):
        assert decoded([json_channel(5, topic), Message(5, 0, b"{}", 0, 0)]) == {}
    with pytest.raises(InputError, match="channel 77, which is not defined"):
        decoded([Message(77, 0, b"{}", 0, 0)])


def test_messages_in_another_order_are_refused():
    items, _ = protobuf_items()
    with pytest.raises(InputError, match="not laid out"):
        decoded([*items[:-2], items[-1], items[-2]])


@pytest.mark.parametrize("size", [1, 8, 9, 20, 30, 31, 40])
def test_a_record_cut_off_within_a_chunk_is_refused(size):
    items, _ = protobuf_items()
    last = joined(items[-1:])
    assert len(last) == 31 + 18
    with pytest.raises(InputError):
        Decoder(Topics()).blocks(joined(items[:-1]) + last[:size])
    with pytest.raises(InputError):
        Decoder(Topics()).blocks(joined(items[:3]) + last[:size])
