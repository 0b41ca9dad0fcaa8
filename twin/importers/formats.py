"""MATLAB, HDF5, JSON, Parquet, TDMS and MCAP of other writers, each as columns by name.

HDF5: a dataset is named by its path; fields of a compound dataset as ``path/field``. JSON: arrays
by name, a matrix (``name[1]``, ``name[2]``, ...; a list of as many names beside it names its
columns), or one object a row. Parquet: an empty cell is NaN, which the importer refuses. TDMS of
LabVIEW: a channel is named ``group/channel``; its waveform may state the rate. MATLAB: versions 4
to 7.2 through SciPy, 7.3 as the HDF5 file it is; a field of a struct is named ``struct.field``.

MCAP of other writers: protobuf, JSON and ROS 2 messages, one column a number in a message.

A column is ``topic.field``, ``topic.field.inner``, or ``topic.field[1]`` for the first of an array;
where a message names the entries of its arrays, as sensor_msgs/JointState does, or an entry has a
name of its own, also ``topic.field.name``. ``topic.log_time`` and time stamps in a message are
times since 1970.
"""

from __future__ import annotations

import json
import struct
import zlib
from array import array
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import scipy.io
from mcap.opcode import Opcode
from numpy.typing import NDArray

from twin.errors import InputError
from twin.importers.mapping import ImportMap
from twin.importers.table import (
    SMALLEST_TABLE,
    SignalTable,
    chosen,
    extra,
    parsing,
    require_columns,
    require_fits,
    split_columns,
)
from twin.isolated import isolated
from twin.logs.container import (
    IN_CHUNKS,
    Damaged,
    FileBytes,
    Inflation,
    McapFile,
    open_chunk,
    record_at,
)
from twin.logs.topics import Topics

_SIGNATURE = b"\x89HDF\r\n\x1a\n"
ROWS = "data"  # what the rows of a bare list are called in JSON
_PERIOD = "wf_increment"  # s a sample, of TDMS
_FED, _PIECE = 1 << 16, 1 << 20  # bytes that are decompressed, and that come of them, at once


def read_hdf5(path: Path, mapping: ImportMap, separator: str = "/") -> SignalTable:
    """Columns of an HDF5 file, ``separator`` between the parts of a name; raises InputError."""
    h5py = extra("h5py")
    wanted = mapping.column_names()
    with parsing("HDF5"), h5py.File(path, "r") as file:
        datasets: dict[str, Any] = {}

        def visit(name: str, item: Any) -> None:
            if isinstance(item, h5py.Dataset) and not name.startswith("#"):
                datasets[name.replace("/", separator)] = item

        file.visititems(visit)
        # only what may hold a wanted column is read, the rest is known by its name
        columns: dict[str, NDArray] = {}
        size = 0.0
        for name, dataset in datasets.items():
            if not wanted or any(w.startswith(name) for w in wanted):
                size += float(dataset.size or 0) * dataset.dtype.itemsize
                require_fits(size, path)
                if dataset.ndim in (0, 1, 2):
                    values, parts = np.asarray(dataset[()]), dataset.dtype.names
                    own = {f"{name}{separator}{part}": values[part] for part in parts or ()}
                    for key, column in (own or {name: values}).items():
                        columns |= split_columns(key, column)
        require_columns(wanted, {**datasets, **columns})  # lists all there are
        return SignalTable({name: columns[name] for name in chosen(wanted, columns)})


def read_json(path: Path, mapping: ImportMap) -> SignalTable:
    """Columns of a JSON file; raises InputError."""
    with parsing("JSON"):
        content = json.loads(path.read_text(encoding="utf-8-sig"))
        columns = _flat("", content if isinstance(content, dict) else {ROWS: content})
    return SignalTable({name: columns[name] for name in chosen(mapping.column_names(), columns)})


def _flat(prefix: str, content: Mapping[str, Any]) -> dict[str, NDArray]:
    """The columns in arrays, lists and tables within tables, called ``prefix`` and a name."""
    columns: dict[str, NDArray] = {}
    names: list[str] = next((v for v in content.values() if _are_all(str, v)), [])
    for key, value in content.items():
        name = f"{prefix}{key}"
        if isinstance(value, Mapping):
            columns |= _flat(f"{name}.", value)
        elif _are_all(dict, value):
            columns |= {k: np.array([row.get(k, np.nan) for row in value]) for k in value[0]}
        elif isinstance(value, list) and not _are_all(str, value):
            split = split_columns(name, _numeric(value))
            named = len(names) == len(split) > 1
            columns |= dict(zip(names, split.values(), strict=True)) if named else split
        elif isinstance(value, np.ndarray | np.generic | int | float | str):
            columns |= split_columns(name, np.asarray(value))
    return columns


def _are_all(kind: type, value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(v, kind) for v in value)


def _numeric(value: list[Any]) -> NDArray:
    """Rows as an array; what is no number, or is ragged, stays as it is and is refused later."""
    try:
        return np.array(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        return np.array([str(v) for v in value], dtype=object)


def read_parquet(path: Path, mapping: ImportMap) -> SignalTable:
    """Columns of a Parquet file; raises InputError."""
    parquet = extra("pyarrow.parquet")
    with parsing("Parquet"), parquet.ParquetFile(path) as file:
        wanted = list(chosen(mapping.column_names(), file.schema_arrow.names))
        require_fits(8.0 * file.metadata.num_rows * len(wanted), path)
        table = file.read(columns=wanted)
        return SignalTable({name: table.column(name).to_numpy() for name in wanted})


def read_tdms(path: Path, mapping: ImportMap) -> SignalTable:
    """Columns of a TDMS file; raises InputError."""
    nptdms = extra("nptdms")
    with parsing("TDMS"), nptdms.TdmsFile.open(path) as file:
        channels = {f"{g.name}/{c.name}": c for g in file.groups() for c in g.channels()}
        read = {name: channels[name] for name in chosen(mapping.column_names(), channels)}
        require_fits(sum(8.0 * len(channel) for channel in read.values()), path)
        periods = {n: c.properties[_PERIOD] for n, c in read.items() if _PERIOD in c.properties}
        for name, period in periods.items():
            first, expected = next(iter(periods.items()))
            if period != expected or not period > 0.0:
                raise InputError(
                    f"channel '{first}' has a sample every {expected:.9g} s, '{name}' every "
                    f"{period:.9g} s; export them at one rate"
                )
        rate = 1.0 / next(iter(periods.values())) if periods else None
        return SignalTable({name: c[:] for name, c in read.items()}, rate)


def read_mat(path: Path, mapping: ImportMap) -> SignalTable:
    """Columns of a MAT file; raises InputError."""
    matlab_header = 512  # bytes before the signature in a MAT file of version 7.3
    with open(path, "rb") as stream:
        head = stream.read(matlab_header + len(_SIGNATURE))
    if head.startswith(_SIGNATURE) or head[matlab_header:] == _SIGNATURE:  # of version 7.3
        return read_hdf5(path, mapping, separator=".")
    with parsing("MAT"):
        content = content_bytes(path)
    shortest = 5.0  # s that a MAT file may take, whatever its size
    slowest = 2e7  # bytes of its content a second
    copies = 4  # of its content, that SciPy and the way back to this process take
    # In a process of its own: SciPy's reader of damaged files may crash, hang or fill the memory.
    seconds, memory = shortest + content / slowest, SMALLEST_TABLE + copies * content
    return SignalTable(
        isolated(_load, path, mapping.column_names(), seconds=seconds, memory=memory)
    )


def content_bytes(path: Path) -> int:
    """Bytes that a file of version 4 to 7.2 holds, decompressed, found in little memory.

    What is compressed proves itself by a checksum, so that only so much memory need be granted as
    there are data. Raises zlib.error, and InputError for more than such a file may hold.
    """
    header, compressed = 128, 15
    size = path.stat().st_size
    with open(path, "rb") as stream:
        marks = stream.read(header)[-4:]
        if marks not in (b"\x00\x01IM", b"\x01\x00MI"):  # version 5 to 7.2, either byte order
            return size
        tag = struct.Struct("<II" if marks.endswith(b"IM") else ">II")
        total = 0
        while len(head := stream.read(tag.size)) == tag.size:
            kind, length = tag.unpack(head)
            if kind == compressed:
                for piece in _inflated(stream.read(min(length, size))):
                    total += piece
                    require_fits(total, path)
            else:
                total += min(length, size)
                stream.seek(length, 1)
    return total


def _inflated(data: bytes) -> Iterator[int]:
    """Sizes of the pieces of decompressed data; raises zlib.error."""
    stream = zlib.decompressobj()
    for start in range(0, len(data), _FED):
        fed = data[start : start + _FED]
        while fed and not stream.eof:
            yield len(stream.decompress(fed, _PIECE))
            fed = stream.unconsumed_tail


def _load(path: Path, names: Sequence[str]) -> dict[str, NDArray]:
    with parsing("MAT"):
        content = scipy.io.loadmat(path, simplify_cells=True)
    columns = _flat("", {k: v for k, v in content.items() if not k.startswith("__")})
    return {name: columns[name] for name in chosen(names, columns)}


# --- MCAP of other writers ------------------------------------------------------------------------

LOG_TIME = "log_time"
_STAMPS = (("sec", "nanosec"), ("seconds", "nanos"))  # ROS 2, protobuf

_MODULES = {"cdr": "mcap_ros2.decoder", "protobuf": "mcap_protobuf.decoder"}
_MESSAGE_HEAD = struct.Struct("<HIQQ")  # channel, sequence, log time, publish time


def read_mcap(path: Path, mapping: ImportMap) -> SignalTable:
    """Columns of an MCAP file; raises InputError."""
    wanted = mapping.column_names()
    held: dict[str, array] = {}
    stamps: set[str] = set()
    seen: dict[str, None] = {}
    with parsing("MCAP"):
        for topic, time, decoded in _messages(path, wanted):
            values = _of_message(topic, decoded)
            values[f"{topic}.{LOG_TIME}"] = np.datetime64(time, "ns")
            seen.update(dict.fromkeys(values))
            for name in wanted or values:
                if name in values:
                    value = values[name]
                    if isinstance(value, np.datetime64):
                        stamps.add(name)
                        value = int(value.astype(np.int64))
                    held.setdefault(name, array("q" if name in stamps else "d")).append(value)
                elif name in held and name.startswith(f"{topic}."):
                    raise InputError(f"a message on {topic} at {time} ns has no '{name}'")
    require_columns(wanted, seen)
    kinds = {name: "datetime64[ns]" if name in stamps else None for name in wanted or held}
    return SignalTable({name: np.array(held[name], kind) for name, kind in kinds.items()})


def _messages(path: Path, wanted: Sequence[str]) -> Iterator[tuple[str, int, Any]]:
    """Topic, log time in ns and message; of topics not wanted the first alone. Raises Damaged."""
    topics, shown = Topics(), Counter[int]()
    decoders: dict[int, Callable[[bytes], Any] | None] = {}
    with open(path, "rb") as stream:
        file = McapFile(FileBytes(stream))
        for opcode, content in _records(file):
            if opcode != Opcode.MESSAGE:
                topics.register(opcode, content)
                continue
            number, _, time, _ = _MESSAGE_HEAD.unpack_from(content)
            channel = topics.channels[number]
            shown[number] += 1
            if shown[number] > 1 and not any(
                w.startswith(f"{channel.topic}.") for w in wanted or (f"{channel.topic}.",)
            ):
                continue
            if number not in decoders:
                encoding, schema = channel.message_encoding, topics.schemas.get(channel.schema_id)
                decoders[number] = json.loads if encoding == "json" else None
                if encoding in _MODULES:
                    factory = extra(_MODULES[encoding]).DecoderFactory()
                    decoders[number] = factory.decoder_for(encoding, schema)
            decode = decoders[number]
            yield channel.topic, time, decode(content[_MESSAGE_HEAD.size :]) if decode else None
    # a chunk whose kind is damaged is passed over
    if file.counts is not None and shown.total() != sum(file.counts.values()):
        raise Damaged(
            f"{shown.total()} messages where its statistics announce {sum(file.counts.values())}; "
            "copy the file again"
        )


def _records(file: McapFile) -> Iterator[tuple[int, bytes]]:
    """Opcode and content of schemas, channels and messages, in chunks and outside."""
    budget = Inflation(file.size)
    for record in file.records():
        if record.opcode == Opcode.CHUNK:
            data, _ = open_chunk(record, budget)
            offset = 0
            while offset < len(data):
                opcode, content, offset = record_at(data, offset)
                yield opcode, content
        elif record.opcode in IN_CHUNKS:
            yield record.opcode, record.content


def _of_message(name: str, value: Any, names: Sequence[str] = ()) -> dict[str, Any]:
    """The numbers and time stamps in a value, by name; names: of its entries, if it has as many."""
    if isinstance(value, bool | int | float | np.number):
        return {name: float(value)}
    out: dict[str, Any] = {}
    if (fields := _fields(value)) is not None:
        for seconds, rest in _STAMPS:
            if fields.keys() == {seconds, rest}:
                time = int(fields[seconds]) * 10**9 + int(fields[rest])
                return {name: np.datetime64(time, "ns")}
        lists = [v for v in fields.values() if _are_entries(v) and len(v)
                 and all(isinstance(text, str) for text in v)]  # fmt: skip
        for key, inner in fields.items():
            out |= _of_message(f"{name}.{key}", inner, lists[0] if lists else ())
    elif _are_entries(value):
        for k, entry in enumerate(value):
            texts = [v for v in (_fields(entry) or {}).values() if isinstance(v, str)]
            called = names[k : k + 1] if len(names) == len(value) else texts  # as that of a joint
            keys = [f"{name}.{called[0]}"] if len(called) == 1 and called[0] else []
            for key in (f"{name}[{k + 1}]", *keys):
                out |= _of_message(key, entry)
    return out


def _are_entries(value: Any) -> bool:
    """Whether it is a list, of whatever kind a library makes them."""
    return hasattr(value, "__len__") and not isinstance(value, str | bytes | Mapping)


def _fields(value: Any) -> Mapping[str, Any] | None:
    """The fields of a message; None where it is none."""
    if isinstance(value, Mapping):
        return value
    if hasattr(value, "__len__"):
        return None
    if hasattr(value, "DESCRIPTOR"):
        return {f.name: getattr(value, f.name) for f in value.DESCRIPTOR.fields}
    slots = getattr(value, "__slots__", None)
    return None if slots is None else {name: getattr(value, name) for name in slots}
