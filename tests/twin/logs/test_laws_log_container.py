"""Laws of the written file: every number in it is what a recount of the bytes gives.

The file is taken apart with ``struct`` and the stock record classes; checksums, offsets, counts and
times are computed anew, times with exact fractions.
"""

import zlib
from fractions import Fraction
from io import BytesIO

import numpy as np
import pytest
from container_log import (
    COUNT,
    FIRST_NUMBER,
    LOG,
    PER_CHUNK,
    RATE,
    ROW,
    TRUTH,
    in_chunks,
    messages,
    of,
    payload,
)
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from google.protobuf.message_factory import GetMessages
from mcap.reader import NonSeekingReader, make_reader
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    MessageIndex,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)
from mcap_bytes import (
    ATTACHMENT,
    ATTACHMENT_INDEX,
    CHANNEL,
    CHUNK,
    CHUNK_INDEX,
    DATA_END,
    FOOTER,
    HEADER,
    MESSAGE,
    MESSAGE_INDEX,
    METADATA,
    METADATA_INDEX,
    SCHEMA,
    STATISTICS,
    SUMMARY_OFFSET,
    parsed,
    parsed_message,
    pieces,
    records,
)

from twin.errors import InputError
from twin.logs import FIELDS, read_log, write_log
from twin.logs import writer as encode


@pytest.fixture(scope="module")
def data(tmp_path_factory) -> bytes:
    path = tmp_path_factory.mktemp("log") / "a.mcap"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(encode, "CHUNK_BYTES", PER_CHUNK * ROW + ROW - 1)
        write_log(LOG, path)
    return path.read_bytes()


def exact(k: int, rate: float) -> int:
    return round(Fraction(k * 10**9) / Fraction(rate))


def test_the_checksums_are_those_of_the_bytes(data):
    end = of(data, DATA_END)[0]
    assert parsed(DataEnd, end).data_section_crc == zlib.crc32(data[: end.start]) != 0
    footer_piece = of(data, FOOTER)[0]
    footer = parsed(Footer, footer_piece)
    assert footer.summary_start == end.end
    assert footer.summary_crc == zlib.crc32(data[end.end : footer_piece.end - 4]) != 0
    for piece in of(data, CHUNK):
        chunk = parsed(Chunk, piece)
        assert chunk.uncompressed_crc == zlib.crc32(payload(chunk)) != 0
        assert chunk.uncompressed_size == len(payload(chunk))
    for body in (p.body for p in of(data, ATTACHMENT)):
        assert int.from_bytes(body[-4:], "little") == zlib.crc32(body[:-4])


def test_the_sections_follow_each_other_as_the_format_orders(data):
    order = [p.opcode for p in records(data)]
    count = -(-COUNT // PER_CHUNK)
    assert order == [
        HEADER, METADATA, *[ATTACHMENT] * 3, *[CHUNK, MESSAGE_INDEX] * count * 4, DATA_END,
        *[SCHEMA] * 3, *[CHANNEL] * 4, STATISTICS, *[CHUNK_INDEX] * count * 4,
        *[ATTACHMENT_INDEX] * 3, METADATA_INDEX, *[SUMMARY_OFFSET] * 6, FOOTER,
    ]  # fmt: skip


def test_the_statistics_are_a_recount(data):
    statistics = parsed(Statistics, of(data, STATISTICS)[0])
    counts = {channel: len(m) for channel, m in messages(data).items()}
    assert counts == {1: COUNT, 2: COUNT, 3: COUNT, 4: COUNT}
    assert statistics == Statistics(
        attachment_count=len(LOG.attachments),
        channel_count=4,
        channel_message_counts=counts,
        chunk_count=len(of(data, CHUNK)),
        message_count=4 * COUNT,
        message_end_time=exact(COUNT - 1, RATE),
        message_start_time=0,
        metadata_count=1,
        schema_count=3,
    )


def test_every_chunk_index_points_at_its_chunk_and_its_message_indexes(data):
    everything = records(data)
    indexes = [parsed(ChunkIndex, p) for p in of(data, CHUNK_INDEX)]
    for index, piece, content in zip(indexes, of(data, CHUNK), in_chunks(data), strict=True):
        chunk = parsed(Chunk, piece)
        following = everything[everything.index(piece) + 1 :][:1]
        places = {int.from_bytes(p.body[:2], "little"): p.start for p in following}
        assert index == ChunkIndex(
            chunk_length=piece.end - piece.start,
            chunk_start_offset=piece.start,
            compression=chunk.compression,
            compressed_size=len(chunk.data),
            message_end_time=chunk.message_end_time,
            message_index_length=following[-1].end - piece.end,
            message_index_offsets=places,
            message_start_time=chunk.message_start_time,
            uncompressed_size=len(payload(chunk)),
        )
        (channel,) = {parsed_message(m).channel_id for m in content if m.opcode == MESSAGE}
        assert list(places) == [channel]


def test_every_message_index_lists_every_message_with_time_and_place(data):
    everything = records(data)
    for piece, content in zip(of(data, CHUNK), in_chunks(data), strict=True):
        entries: dict[int, list[tuple[int, int]]] = {}
        for record in content:
            if record.opcode == MESSAGE:
                message = parsed_message(record)
                entries.setdefault(message.channel_id, []).append((message.log_time, record.start))
        chunk = parsed(Chunk, piece)
        times = [time for channel in entries.values() for time, _ in channel]
        assert (chunk.message_start_time, chunk.message_end_time) == (min(times), max(times))
        found = parsed(MessageIndex, everything[everything.index(piece) + 1])
        assert {found.channel_id: list(found.records)} == entries


def test_attachment_and_metadata_indexes_repeat_what_they_point_at(data):
    attachments = [(p, parsed(Attachment, p)) for p in of(data, ATTACHMENT)]
    assert {a.name: a.data for _, a in attachments} == LOG.attachments
    assert {(a.log_time, a.create_time) for _, a in attachments} == {(0, 0)}
    types = {a.name: a.media_type for _, a in attachments}
    assert types == {
        "model.toml": "application/toml",
        "stage.xml": "application/xml",
        "raw": "application/octet-stream",
    }
    assert [parsed(AttachmentIndex, p) for p in of(data, ATTACHMENT_INDEX)] == [
        AttachmentIndex(p.start, p.end - p.start, 0, 0, len(a.data), a.name, a.media_type)
        for p, a in attachments
    ]
    metadata = of(data, METADATA)[0]
    assert [parsed(MetadataIndex, p) for p in of(data, METADATA_INDEX)] == [
        MetadataIndex(metadata.start, metadata.end - metadata.start, "twin")
    ]
    entries = parsed(Metadata, metadata).metadata
    proof = entries.pop("checksum")
    assert entries == {
        "source": "a test", "schema_version": "1", "sample_rate_hz": "3000.0", "axes": "x,y,z",
    }  # fmt: skip
    texts = [text.encode() for entry in sorted(entries.items()) for text in entry]
    stated = b"".join(len(text).to_bytes(8, "little") + text for text in texts)
    assert proof == f"{zlib.crc32(stated):08x}"


def test_the_summary_offsets_cut_the_summary_into_groups_of_one_kind(data):
    footer = parsed(Footer, of(data, FOOTER)[0])
    offsets = [parsed(SummaryOffset, p) for p in of(data, SUMMARY_OFFSET)]
    place = footer.summary_start
    for offset in offsets:
        assert offset.group_start == place
        place += offset.group_length
        group = pieces(data, offset.group_start, place)
        assert {p.opcode for p in group} == {offset.group_opcode}
    assert place == footer.summary_offset_start == of(data, SUMMARY_OFFSET)[0].start


def test_every_chunk_can_be_read_alone(data):
    schemas = {parsed(Schema, p).id: p.body for p in of(data, SCHEMA)}
    channels = {parsed(Channel, p).id: p.body for p in of(data, CHANNEL)}
    for schema, channel, *sent in in_chunks(data):
        assert {p.opcode for p in sent} == {MESSAGE}
        (number,) = {parsed_message(p).channel_id for p in sent}
        assert channel.body == channels[number]
        assert schema.body == schemas[parsed(Channel, channel).schema_id]


def test_the_axes_come_last_of_each_stretch(data):
    """So that what a killed run leaves of the last stretch is seldom some axes alone."""
    order = [parsed_message(content[-1]).channel_id for content in in_chunks(data)]
    assert order == [4, 3, 2, 1] * -(-COUNT // PER_CHUNK)


def test_chunks_are_as_full_as_they_may_be(data):
    rows = [len(content) - 2 for content in in_chunks(data)]
    assert rows == [PER_CHUNK] * (COUNT // PER_CHUNK) * 4 + [COUNT % PER_CHUNK] * 4


def test_every_message_has_its_number_and_its_exact_time(data):
    for sent in messages(data).values():
        assert [m.sequence for m in sent] == list(range(COUNT))
        want = [exact(k, RATE) for k in range(COUNT)]
        assert [m.log_time for m in sent] == [m.publish_time for m in sent] == want


def test_every_value_stands_in_its_own_field_for_the_stock_decoder(data):
    """Field numbers are those the file format promises, not those of one program."""
    schemas = {s.id: s for s in (parsed(Schema, p) for p in of(data, SCHEMA))}
    channels = {c.id: c for c in (parsed(Channel, p) for p in of(data, CHANNEL))}
    wanted = {f"/axis/{n}": a.columns for n, a in LOG.axes.items()} | {"/truth/x": LOG.truth["x"]}
    assert {c.topic for c in channels.values()} == set(wanted)
    for number, sent in messages(data).items():
        schema = schemas[channels[number].schema_id]
        kind = GetMessages(FileDescriptorSet.FromString(schema.data).file)[schema.name]
        columns = wanted[channels[number].topic]
        truth = channels[number].topic == "/truth/x"
        assert schema.name == ("twin.AxisTruth" if truth else "twin.AxisSample")
        numbers = {f.name: f.number for f in kind.DESCRIPTOR.fields}
        names = TRUTH if truth else FIELDS
        assert numbers == {n: names.index(n) + FIRST_NUMBER for n in columns}
        for k, message in enumerate(sent):
            sample = kind.FromString(message.data)
            assert {n: getattr(sample, n) for n in columns} == {n: c[k] for n, c in columns.items()}


def test_stock_readers_accept_every_checksum(data):
    for reader in (make_reader(BytesIO(data), validate_crcs=True),
                   NonSeekingReader(BytesIO(data), validate_crcs=True)):  # fmt: skip
        assert sum(1 for _ in reader.iter_messages()) == 4 * COUNT


@pytest.mark.parametrize("rows", [1, 2, 5, 44, 45, 46])
def test_the_size_of_the_chunks_changes_no_sample(tmp_path, monkeypatch, rows):
    monkeypatch.setattr(encode, "CHUNK_BYTES", rows * ROW)
    seen = []
    write_log(LOG, tmp_path / "a.mcap", lambda done, total: seen.append((done, total)))
    chunks = of((tmp_path / "a.mcap").read_bytes(), CHUNK)
    assert len(chunks) == 4 * -(-COUNT // rows)
    assert seen == [(min(k * rows, COUNT), COUNT) for k in range(1, len(chunks) // 4 + 1)]
    got = read_log(tmp_path / "a.mcap")
    for name, axis in LOG.axes.items():
        assert got.axes[name].force_constant == axis.force_constant
        for field, column in axis.columns.items():
            np.testing.assert_array_equal(got.axes[name].columns[field], column)
    for field, column in LOG.truth["x"].items():
        np.testing.assert_array_equal(got.truth["x"][field], column)


def test_a_chunk_holds_a_row_though_it_is_larger_than_a_chunk(tmp_path, monkeypatch):
    monkeypatch.setattr(encode, "CHUNK_BYTES", ROW // 2)
    write_log(LOG, tmp_path / "a.mcap")
    assert len(of((tmp_path / "a.mcap").read_bytes(), CHUNK)) == 4 * COUNT


def test_a_record_that_claims_more_than_follows_it_is_called_so(data, tmp_path):
    """At whatever place in the file: what counts is what follows, not what lies before."""
    for piece in (of(data, CHUNK)[0], of(data, CHUNK)[-1]):
        too_long = len(data) - piece.start
        at = piece.start + 1
        (tmp_path / "a.mcap").write_bytes(
            data[:at] + too_long.to_bytes(8, "little") + data[at + 8 :]
        )
        with pytest.raises(InputError, match=f"at byte {piece.start} claims {too_long} bytes"):
            read_log(tmp_path / "a.mcap")
