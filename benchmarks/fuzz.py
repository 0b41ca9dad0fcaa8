"""Damaged and edited inputs of every kind: refused in one line, read as they are, or a fault.

Bytes are flipped, overwritten, removed, doubled and moved; numbers and words of text files are
exchanged for others. Of a log nothing else than what was written may come back.
"""

from __future__ import annotations

import json
import re
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from io import BytesIO
from pathlib import Path
from time import perf_counter

import numpy as np
import scipy.io
from mcap.writer import CompressionType, Writer

from benchmarks.figures import Figure, Target
from twin.effects import load_catalogue
from twin.errors import InputError
from twin.importers import import_log, import_notes, load_mapping
from twin.logs import AxisLog, Log, read_log, recover_log, write_log
from twin.model.file import find_model, load_model

INPUTS = 10_000
SLOW = 5.0  # s, from which on an answer is a hang
TITLE = f"Fuzz: {INPUTS} damaged inputs"
RATE, SAMPLES = 1000.0, 400
WORDS = (
    b"-1", b"0", b"nan", b"inf", b"1e999", b"true", b'""', b"[]", b"{}", b"99999999999999999999",
    b"\x00", b"\xff", b"'", b"=", b"[[", b"1e-320", b"0x10", b"2020-01-01", b"\n", b",", b";",
)  # fmt: skip
MAP = b"""sample_rate = 1000.0
[axes.x]
position = {column = "q", unit = "mm", sign = -1, delay_samples = 2}
force = {column = "f", unit = "V", scale = 35.0}
"""
TOPICS = b"""sample_rate = 1000.0
[axes.x]
position = {column = "/axis/x.position", unit = "mm"}
force = {column = "/axis/x.force", unit = "N"}
"""

Rng = np.random.Generator


@dataclass(frozen=True)
class Subject:
    """A kind of input: an intact file, and what reads it; ``read`` says whether it was changed."""

    name: str
    ending: str
    data: bytes
    read: Callable[[Path], bool]
    text: bool


def measure() -> list[Figure]:
    """Faults of every kind, of which there may be none."""
    with tempfile.TemporaryDirectory() as folder:
        table = run(INPUTS, 1, Path(folder))
    none = Target(high=0.0)
    figures = [
        Figure(f"{fault} of {sum(table.values())} inputs", float(_count(table, fault)), "1", none)
        for fault in ("silent", "traceback", "hang")
    ]
    for name in sorted({kind for kind, _ in table}):
        ended = {answer: n for (kind, answer), n in table.items() if kind == name}
        shown = ", ".join(f"{answer} {n}" for answer, n in sorted(ended.items()))
        figures.append(Figure(f"{name}: {shown}", None, "1"))
    return figures


def _count(table: Counter[tuple[str, str]], answer: str) -> int:
    return sum(n for (_, found), n in table.items() if found == answer)


def run(inputs: int, seed: int, folder: Path) -> Counter[tuple[str, str]]:
    """(kind of input, answer) -> how many; answers are refused, read, silent, traceback, hang."""
    rng = np.random.default_rng(seed)
    subjects = list(_subjects(folder))
    table: Counter[tuple[str, str]] = Counter()
    for i in range(inputs):
        subject = subjects[i % len(subjects)]
        path = folder / f"fuzzed{subject.ending}"
        path.write_bytes(damaged(subject.data, subject.text, rng))
        began = perf_counter()
        answer = _answer(subject, path)
        table[subject.name, "hang" if perf_counter() - began > SLOW else answer] += 1
        if answer == "traceback":
            path.rename(folder.parent / f"fuzz_{seed}_{i}{subject.ending}")
    return table


def _answer(subject: Subject, path: Path) -> str:
    try:
        same = subject.read(path)
    except InputError as error:
        return "refused" if "\n" not in str(error) else "traceback"
    except Exception:
        return "traceback"
    return "read" if same else "silent"


def damaged(data: bytes, text: bool, rng: Rng) -> bytes:
    """The bytes with one to three changes."""
    for _ in range(int(rng.integers(1, 4))):
        change = _exchange if text and rng.random() < 0.6 else _CHANGES[rng.integers(len(_CHANGES))]
        data = change(data, rng) if data else data
    return data


def _place(data: bytes, rng: Rng) -> tuple[int, int]:
    start = int(rng.integers(len(data)))
    return start, start + int(rng.integers(1, max(2, min(len(data) - start, 300))))


def _flip(data: bytes, rng: Rng) -> bytes:
    out, bit = bytearray(data), int(rng.integers(8 * len(data)))
    out[bit // 8] ^= 1 << bit % 8
    return bytes(out)


def _overwrite(data: bytes, rng: Rng) -> bytes:
    a, b = _place(data, rng)
    return data[:a] + (bytes(b - a) if rng.random() < 0.5 else rng.bytes(b - a)) + data[b:]


def _remove(data: bytes, rng: Rng) -> bytes:
    a, b = _place(data, rng)
    return data[:a] + data[b:]


def _double(data: bytes, rng: Rng) -> bytes:
    a, b = _place(data, rng)
    return data[:b] + data[a:b] + data[b:]


def _move(data: bytes, rng: Rng) -> bytes:
    a, b = _place(data, rng)
    rest, to = data[:a] + data[b:], int(rng.integers(len(data) - (b - a) + 1))
    return rest[:to] + data[a:b] + rest[to:]


def _cut(data: bytes, rng: Rng) -> bytes:
    return data[: int(rng.integers(len(data)))]


_CHANGES = (_flip, _overwrite, _remove, _double, _move, _cut)


def _exchange(data: bytes, rng: Rng) -> bytes:
    """A number, word or sign of a text for another."""
    tokens = list(re.finditer(rb"[\w.+-]+|[^\w\s]", data))
    if not tokens:
        return data
    token = tokens[rng.integers(len(tokens))]
    return data[: token.start()] + WORDS[rng.integers(len(WORDS))] + data[token.end() :]


def _subjects(folder: Path) -> Iterator[Subject]:
    catalogue = load_catalogue()
    t = np.arange(SAMPLES) / RATE
    columns = {"t": t, "q": 30.0 * np.sin(9.0 * t), "f": 5.0 * np.cos(9.0 * t)}
    log = Log(RATE, {"x": AxisLog({"position": columns["q"], "force": columns["f"]})})
    (folder / "map.toml").write_bytes(MAP)
    yield Subject("log", ".mcap", _log_bytes(log, folder), lambda p: _same(read_log(p), log), False)
    yield Subject("recovery", ".mcap", _log_bytes(log, folder), lambda p: _recovered(p, log), False)
    plain = _plain_bytes(log)
    yield Subject("recovery, plain", ".mcap", plain, lambda p: _recovered(p, log), False)
    (folder / "topics.toml").write_bytes(TOPICS)
    by_topic = partial(_imported_as, mapping=folder / "topics.toml", log=log)
    yield Subject("mcap", ".mcap", plain, by_topic, False)
    model = find_model("example_machine").read_bytes().replace(b'mujoco = "proton_xy.xml"\n', b"")
    yield Subject("model", ".toml", model, lambda p: bool(load_model(p, catalogue)), True)
    yield Subject("map", ".toml", MAP, lambda p: bool(load_mapping(p)), True)
    rows = "\n".join(
        ",".join(f"{v:.9g}" for v in row) for row in zip(*columns.values(), strict=True)
    )
    csv = f"t,q,f\n{rows}\n".encode()
    scipy.io.savemat(folder / "a.mat", columns)
    table = json.dumps({n: list(map(float, c)) for n, c in columns.items()}).encode()
    mat = (folder / "a.mat").read_bytes()
    for name, data in (("csv", csv), ("json", table), ("mat", mat)):
        yield Subject(
            name, f".{name}", data, lambda p: _imported(p, folder / "map.toml"), name != "mat"
        )


def _log_bytes(log: Log, folder: Path) -> bytes:
    """The log in several chunks."""
    write_log(log, folder / "a.mcap", chunk_bytes=4000)
    return (folder / "a.mcap").read_bytes()


def _plain_bytes(log: Log) -> bytes:
    """The log as another program may write it: JSON in chunks that are not compressed."""
    stream = BytesIO()
    writer = Writer(stream, chunk_size=4000, compression=CompressionType.NONE)
    writer.start()
    channel = writer.register_channel("/axis/x", "json", 0)
    columns = log.axes["x"].columns
    for k in range(len(log)):
        time = round(k * 1e9 / RATE)
        data = json.dumps({name: float(column[k]) for name, column in columns.items()})
        writer.add_message(channel, time, data.encode(), time)
    writer.finish()
    return stream.getvalue()


def _imported(path: Path, mapping: Path) -> bool:
    return len(import_log(path, load_mapping(mapping))) > 0


def _imported_as(path: Path, mapping: Path, log: Log) -> bool:
    """Whether whole chunks gave what was written, and it is told what the others held."""
    found, written = import_log(path, load_mapping(mapping)), log.axes["x"]
    x = found.axes["x"]
    if len(found) != len(log):
        return bool(import_notes(found)) and bool(np.isin(x.force, written.force).all())
    return np.array_equal(x.force, written.force) and np.allclose(
        x.position, 1e-3 * written.position, rtol=1e-12, atol=0.0
    )


def _same(found: Log, log: Log, first: int = 0) -> bool:
    part = slice(first, first + len(found))
    return all(
        np.array_equal(found.axes["x"].columns[n], c[part])
        for n, c in log.axes["x"].columns.items()
    )


def _recovered(path: Path, log: Log) -> bool:
    found, recovery = recover_log(path)
    starts = (re.search(r"from (\S+) s", p.metadata.get("recovered", "")) for p in recovery.others)
    parts = [(found, re.search(r"from (\S+) s", found.metadata.get("recovered", "")))]
    parts += zip(recovery.others, starts, strict=True)
    return all(_same(p, log, round(float(m[1]) * RATE) if m else 0) for p, m in parts)
