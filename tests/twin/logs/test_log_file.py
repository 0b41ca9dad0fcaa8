"""The written file: every number in it is what a recount of the bytes gives.

The stock reader takes it apart; checksums, offsets, counts and times are computed anew, times with
exact fractions. What is read of it is what was written.
"""

import os
import subprocess
import sys
import zlib
from fractions import Fraction
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
import zstandard
from log_cases import assert_same_log, two_axes
from mcap import records as kinds
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap_bytes import of, parsed, parsed_message, pieces, records
from mcap_protobuf.decoder import DecoderFactory

from twin.errors import InputError
from twin.logs import FIELDS, AxisLog, Log, read_log, write_log

RATE, COUNT, PER_CHUNK = 3000.0, 45, 7
TRUTH = ("position", *(f"state{k}" for k in range(17)))


def distinct(name: str, axis: str) -> np.ndarray:
    """A column whose values occur in no other column."""
    number = 100.0 * (1 + (*FIELDS, *TRUTH).index(name)) + 10_000.0 * (1 + "xyzt".index(axis))
    return number + np.arange(COUNT) / 64.0


LOG = Log(
    RATE,
    {
        "x": AxisLog({f: distinct(f, "x") for f in FIELDS}, force_constant=7.25),
        "y": AxisLog({f: distinct(f, "y") for f in ("position", "current")}, force_constant=3.5),
        "z": AxisLog({f: distinct(f, "z") for f in ("position", "current")}, force_constant=2.0),
    },
    {"source": "a test"},
    {"x": {f: distinct(f, "t") for f in TRUTH}},
    {"model.toml": b"mass = 1\n", "stage.xml": b"<mujoco/>", "raw": bytes(range(200))},
)
FIRST_NUMBER = 1 << 18  # of the fields: their tags have four bytes
# bytes of a sample on four topics
ROW = (31 + len(FIELDS) * 12) + 2 * (31 + 2 * 12) + (31 + 18 * 12)


@pytest.fixture(scope="module")
def data(tmp_path_factory) -> bytes:
    path = tmp_path_factory.mktemp("log") / "a.mcap"
    write_log(LOG, path, chunk_bytes=PER_CHUNK * ROW + ROW - 1)
    return path.read_bytes()


def payload(chunk: kinds.Chunk) -> bytes:
    return zstandard.ZstdDecompressor().decompress(chunk.data)


def in_chunks(data: bytes) -> list[list]:
    """The records in every chunk, chunk by chunk."""
    contents = [payload(parsed(kinds.Chunk, p)) for p in of(data, Opcode.CHUNK)]
    return [pieces(content, 0, len(content)) for content in contents]


def exact(k: int, rate: float) -> int:
    return round(Fraction(k * 10**9) / Fraction(rate))


def test_the_sections_follow_each_other_with_the_checksums_of_their_bytes(data):
    count = -(-COUNT // PER_CHUNK)
    assert [p.opcode for p in records(data)] == [
        Opcode.HEADER, Opcode.METADATA, *[Opcode.ATTACHMENT] * 3,
        *[Opcode.CHUNK, Opcode.MESSAGE_INDEX] * count * 4, Opcode.DATA_END, *[Opcode.SCHEMA] * 3,
        *[Opcode.CHANNEL] * 4, Opcode.STATISTICS, *[Opcode.CHUNK_INDEX] * count * 4,
        *[Opcode.ATTACHMENT_INDEX] * 3, Opcode.METADATA_INDEX, *[Opcode.SUMMARY_OFFSET] * 6,
        Opcode.FOOTER,
    ]  # fmt: skip
    end, behind = of(data, Opcode.DATA_END)[0], of(data, Opcode.FOOTER)[0]
    footer = parsed(kinds.Footer, behind)
    assert parsed(kinds.DataEnd, end).data_section_crc == zlib.crc32(data[: end.start]) != 0
    assert footer.summary_crc == zlib.crc32(data[end.end : behind.end - 4]) != 0
    for body in (p.body for p in of(data, Opcode.ATTACHMENT)):
        assert int.from_bytes(body[-4:], "little") == zlib.crc32(body[:-4])
    place = footer.summary_start
    assert place == end.end
    for offset in (parsed(kinds.SummaryOffset, p) for p in of(data, Opcode.SUMMARY_OFFSET)):
        assert offset.group_start == place
        place += offset.group_length
        assert {p.opcode for p in pieces(data, offset.group_start, place)} == {offset.group_opcode}
    assert place == footer.summary_offset_start == of(data, Opcode.SUMMARY_OFFSET)[0].start


def test_a_summary_whose_writer_gave_no_checksum_is_read(data, tmp_path):
    """Zero says that there is none (MCAP specification, footer)."""
    crc = of(data, Opcode.FOOTER)[0].end - 4
    for name, proof in (("without", bytes(4)), ("wrong", b"abcd")):
        (tmp_path / name).write_bytes(data[:crc] + proof + data[crc + 4 :])
    assert len(read_log(tmp_path / "without")) == COUNT
    with pytest.raises(InputError, match="wrong checksum"):
        read_log(tmp_path / "wrong")


def test_every_chunk_holds_one_topic_can_be_read_alone_and_is_indexed(data):
    """The axes come last of each stretch: what a killed run leaves is seldom some axes alone."""
    schemas = {parsed(kinds.Schema, p).id: p.body for p in of(data, Opcode.SCHEMA)}
    channels = {parsed(kinds.Channel, p).id: p.body for p in of(data, Opcode.CHANNEL)}
    everything, order = records(data), []
    indexes = [parsed(kinds.ChunkIndex, p) for p in of(data, Opcode.CHUNK_INDEX)]
    for index, piece, content in zip(indexes, of(data, Opcode.CHUNK), in_chunks(data), strict=True):
        chunk, (schema, channel, *sent) = parsed(kinds.Chunk, piece), content
        assert chunk.uncompressed_crc == zlib.crc32(payload(chunk)) != 0
        messages = [parsed_message(p) for p in sent]
        (number,) = {m.channel_id for m in messages}
        assert channel.body == channels[number]
        assert schema.body == schemas[parsed(kinds.Channel, channel).schema_id]
        behind = everything[everything.index(piece) + 1]
        times = chunk.message_start_time, chunk.message_end_time
        assert times == (messages[0].log_time, messages[-1].log_time)
        assert index == kinds.ChunkIndex(
            chunk_length=piece.end - piece.start, chunk_start_offset=piece.start,
            compression=chunk.compression, compressed_size=len(chunk.data),
            message_start_time=times[0], message_end_time=times[1],
            message_index_length=behind.end - piece.end,
            message_index_offsets={number: behind.start},
            uncompressed_size=len(payload(chunk)),
        )  # fmt: skip
        entries = [(m.log_time, p.start) for m, p in zip(messages, sent, strict=True)]
        assert parsed(kinds.MessageIndex, behind) == kinds.MessageIndex(number, entries)
        order.append((number, len(messages)))
    full = [(number, PER_CHUNK) for number in (4, 3, 2, 1)] * (COUNT // PER_CHUNK)
    assert order == full + [(number, COUNT % PER_CHUNK) for number in (4, 3, 2, 1)]


def test_every_message_has_its_number_exact_time_and_each_value_in_its_own_field(data):
    """Field numbers are those the file format promises; equal axes share one schema."""
    wanted = {f"/axis/{n}": a.columns for n, a in LOG.axes.items()} | {"/truth/x": LOG.truth["x"]}
    found: dict[str, list] = {topic: [] for topic in wanted}
    reader = make_reader(BytesIO(data), validate_crcs=True, decoder_factories=[DecoderFactory()])
    for schema, channel, message, sample in reader.iter_decoded_messages():
        k, columns = len(found[channel.topic]), wanted[channel.topic]
        names = TRUTH if channel.topic == "/truth/x" else FIELDS
        assert schema.name == ("twin.AxisTruth" if names is TRUTH else "twin.AxisSample")
        numbers = {f.name: f.number for f in sample.DESCRIPTOR.fields}
        assert numbers == {n: names.index(n) + FIRST_NUMBER for n in columns}
        assert {n: getattr(sample, n) for n in columns} == {n: c[k] for n, c in columns.items()}
        found[channel.topic].append((message.sequence, message.log_time, message.publish_time))
    rows = [(k, exact(k, RATE), exact(k, RATE)) for k in range(COUNT)]
    assert found == dict.fromkeys(wanted, rows)
    channels = [parsed(kinds.Channel, p) for p in of(data, Opcode.CHANNEL)]
    assert [(c.id, c.schema_id, c.topic) for c in channels] == [
        (k, of, topic) for k, of, topic in zip((1, 2, 3, 4), (1, 2, 2, 3), wanted, strict=True)
    ]
    assert parsed(kinds.Statistics, of(data, Opcode.STATISTICS)[0]) == kinds.Statistics(
        attachment_count=3, channel_count=4,
        channel_message_counts=dict.fromkeys(range(1, 5), COUNT),
        chunk_count=len(of(data, Opcode.CHUNK)), message_count=4 * COUNT, metadata_count=1,
        message_end_time=exact(COUNT - 1, RATE), message_start_time=0, schema_count=3,
    )  # fmt: skip


def test_metadata_attachments_and_channels_say_what_the_log_holds(data):
    reader = make_reader(BytesIO(data), validate_crcs=True)
    attachments = list(reader.iter_attachments())
    assert {a.name: a.data for a in attachments} == LOG.attachments
    assert {(a.log_time, a.create_time) for a in attachments} == {(0, 0)}
    types = [a.media_type for a in attachments]
    assert types == ["application/toml", "application/xml", "application/octet-stream"]
    assert [parsed(kinds.AttachmentIndex, p) for p in of(data, Opcode.ATTACHMENT_INDEX)] == [
        kinds.AttachmentIndex(p.start, p.end - p.start, 0, 0, len(a.data), a.name, a.media_type)
        for p, a in zip(of(data, Opcode.ATTACHMENT), attachments, strict=True)
    ]
    place = of(data, Opcode.METADATA)[0]
    assert [parsed(kinds.MetadataIndex, p) for p in of(data, Opcode.METADATA_INDEX)] == [
        kinds.MetadataIndex(place.start, place.end - place.start, "twin")
    ]
    (entries,) = [m.metadata for m in reader.iter_metadata()]
    proof = entries.pop("checksum")
    assert entries == {
        "source": "a test", "schema_version": "1", "sample_rate_hz": "3000.0", "axes": "x,y,z",
    }  # fmt: skip
    texts = [text.encode() for entry in sorted(entries.items()) for text in entry]
    stated = b"".join(len(text).to_bytes(8, "little") + text for text in texts)
    assert proof == f"{zlib.crc32(stated):08x}"
    channels = [parsed(kinds.Channel, p).metadata for p in of(data, Opcode.CHANNEL)]
    assert channels[1] == {
        "axis": "y", "sample_rate_hz": "3000.0", "unit.position": "m", "unit.current": "A",
        "force_constant": "3.5",
    }  # fmt: skip
    assert channels[3] == {"axis": "x", "sample_rate_hz": "3000.0", "unit.position": "m"}


@pytest.mark.parametrize("rows", [0.5, 2, 44, 45])
def test_the_size_of_the_chunks_changes_no_sample(tmp_path, rows):
    """Of one row at least, though it is larger than a chunk."""
    write_log(LOG, tmp_path / "a.mcap", chunk_bytes=int(rows * ROW))
    chunks = of((tmp_path / "a.mcap").read_bytes(), Opcode.CHUNK)
    assert len(chunks) == 4 * -(-COUNT // max(1, int(rows)))
    assert_same_log(read_log(tmp_path / "a.mcap"), LOG)


def test_writing_what_was_read_gives_the_same_bytes(tmp_path):
    """Numbers bit for bit, -0.0 too, metadata and attachments."""
    first, second, third = (tmp_path / name for name in ("a.mcap", "b.mcap", "c.mcap"))
    log = two_axes(6000)  # of several chunks as they are by default
    write_log(log, first)
    write_log(log, second)
    assert_same_log(read_log(first), log)
    write_log(read_log(first), third)
    assert first.read_bytes() == second.read_bytes() == third.read_bytes()


@pytest.mark.parametrize("rate", [1.0, 999.5, 44_100.5, 1e6 / 7.0])
def test_times_are_exact_at_every_rate(tmp_path, rate):
    for count in (1, 5000):
        axis = AxisLog({"position": np.arange(float(count)), "force": np.zeros(count)})
        write_log(Log(rate, {"motor": axis}), tmp_path / "a.mcap")
        assert_same_log(read_log(tmp_path / "a.mcap"), Log(rate, {"motor": axis}))
    (content,) = in_chunks((tmp_path / "a.mcap").read_bytes())
    times = [parsed_message(p).log_time for p in content[2:]]
    assert times == [exact(k, rate) for k in range(5000)]


READING = """
import re, sys
from twin.logs import read_log

def peak():
    return int(re.search(r"VmHWM:\\s+(\\d+)", open("/proc/self/status").read())[1])
before = peak()
read_log(sys.argv[1])
print(peak() - before)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="kB of memory as Linux counts them")
def test_reading_needs_little_more_memory_than_the_result(tmp_path):
    """Resident, in a process of its own: what is freed in small pieces is not given back."""
    count = 500_000
    axis = AxisLog({"position": np.arange(float(count)), "force": np.ones(count)})
    write_log(Log(1e4, {"x": axis, "y": axis}), tmp_path / "a.mcap")
    done = subprocess.run(
        [sys.executable, "-c", READING, str(tmp_path / "a.mcap")], capture_output=True, text=True,
        check=True, env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[3])},
    )  # fmt: skip
    assert 1024 * int(done.stdout) < 4 * 8 * count + 6 * (1 << 20)
