"""Recover a damaged log: every stretch of samples that a checksum proves, without a gap in it.

Samples stay in the file until they are written or asked for, so that a log of any length can be
recovered: it is read to find what is proved, in the order of time to find the gaps, and to be kept.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

from mcap.opcode import Opcode

from twin.errors import InputError, at
from twin.files import is_same_file
from twin.logs.assemble import EVERYTHING, Extras
from twin.logs.container import FileBytes, has_checksum, open_mcap, reading
from twin.logs.decode import log_parts
from twin.logs.layout import Block, sample_times
from twin.logs.log import Log, joined
from twin.logs.salvage import Part, Salvage
from twin.logs.series import seconds
from twin.logs.stretch import Stretch, Trace
from twin.logs.topics import Topic
from twin.logs.writer import write_parts

METADATA = "the metadata (experiment, seed, source) has no checksum of its own"
INTACT_STEP = 1 << 17  # samples of an intact log that are held in memory at a time


@dataclass(frozen=True)
class Recovery:
    """What was kept of a log, and one sentence for each loss (none: the log was intact).

    unproved: what was kept although no checksum proves it, one sentence each. others: the stretches
    of samples that a gap separates from the longest one, in the order of time.
    """

    kept: str
    lost: tuple[str, ...]
    unproved: tuple[str, ...] = ()
    others: tuple[Log, ...] = ()

    def __str__(self) -> str:
        lost = self.lost or ("nothing was lost",)
        return "\n".join((f"kept {self.kept}", *(f"not proved: {u}" for u in self.unproved), *lost))


@dataclass(frozen=True)
class _Kept:
    """A stretch of samples: what it is, and its logs, which follow each other."""

    text: str
    logs: Callable[[], Iterator[Log]]


def recover_log(path: str | Path, *, unproved: bool = False) -> tuple[Log, Recovery]:
    """Read the longest series of intact chunks without a gap between them, and all others.

    Samples are kept only where a checksum proves them, or, where ``unproved`` is asked for, where
    nothing speaks against them. Metadata has no checksum of its own; where it contradicts the
    chunks it is ignored. Raises InputError where nothing is left.
    """
    with _recovered(Path(path), unproved) as (kept, recovery):
        log, *others = [joined(stretch.logs()) for stretch in kept]
    return log, replace(recovery, others=tuple(others))


def recover_file(
    path: Path, out: Path, *, unproved: bool = False
) -> tuple[Recovery, dict[Path, str]]:
    """Write what ``recover_log`` reads to files, a piece at a time: the longest series to ``out``.

    The others are beside it. Returns the recovery without its logs, and what each file holds.
    Raises InputError as recover_log does, and where writing fails.
    """
    with _recovered(path, unproved) as (kept, recovery):
        names = (out.with_name(f"{out.stem}.part{n}{out.suffix}") for n in range(1, len(kept)))
        files = dict(zip((out, *names), kept, strict=True))
        for name in files:
            if is_same_file(name, path):
                raise InputError(f"{path}: would be overwritten; give another name than {out}")
        for name, stretch in files.items():
            write_parts(stretch.logs(), name)
    return recovery, {name: stretch.text for name, stretch in files.items()}


@contextmanager
def _recovered(path: Path, unproved: bool) -> Iterator[tuple[list[_Kept], Recovery]]:
    """What is kept, the longest first; the file stays open until it was read."""
    try:
        count = sum(len(part) for part in _intact(path))
    except InputError as error:
        reason = str(error).removeprefix(f"{path}: ")
    else:
        doubt = _doubt(path)
        if doubt and not unproved:
            raise InputError(f"{path}: {doubt[0]}; it can be read as it is, or with --unproved")
        text = f"all {count} samples"
        yield [_Kept(text, lambda: _intact(path))], Recovery(text, (), doubt)
        return
    with reading(path):
        stream = open(path, "rb")  # noqa: SIM115
    with stream:
        with reading(path):
            file = FileBytes(stream, os.fstat(stream.fileno()).st_size)
            kept, recovery = _Stretches(path, file, reason, unproved).result()
        yield kept, recovery


def _intact(path: Path) -> Iterator[Log]:
    """A log in which no fault is found, in parts; raises InputError."""
    with open_mcap(path) as file:
        yield from log_parts(file, file.records(), EVERYTHING, INTACT_STEP)


def _doubt(path: Path) -> tuple[str, ...]:
    """Why nothing proves the samples of a log in which no fault was found."""
    with open_mcap(path) as file:
        records = file.records()
        opcodes = {r.opcode for r in records if r.opcode != Opcode.CHUNK or not has_checksum(r)}
        if file.checked or not opcodes & {Opcode.CHUNK, Opcode.MESSAGE}:
            return ()
    return ("the log has no checksums that prove its samples",)


class _Stretches:
    """The samples of a damaged log in stretches without a gap."""

    def __init__(self, path: Path, file: FileBytes, reason: str, keep_unproved: bool) -> None:
        self._name = str(path)
        self._keep_unproved = keep_unproved
        self._salvage = Salvage(file, reason, keep_unproved)
        self._lost = self._salvage.lost
        self._parts = self._sorted(list(self._salvage.parts()))

    def result(self) -> tuple[list[_Kept], Recovery]:
        """The longest series and the others; raises InputError where there is none."""
        stretches = self._together(self._by_topic())
        self._report_absent_chunks()
        if not stretches:
            hint = (
                ""
                if self._keep_unproved or not self._salvage.unproved
                else "; read it with --unproved"
            )
            why = "; ".join(dict.fromkeys([*self._lost, *self._salvage.unproved]))
            raise InputError(f"nothing can be recovered ({why}){hint}")
        extras = self._salvage.extras
        # the rate is stated in every chunk too, and there a checksum protects it
        extras.metadata.pop("sample_rate_hz", None)
        longest = max(stretches, key=lambda s: s.count * len(s.spans))
        longest.empty(extras)
        others = list(self._others(stretches, longest))
        lost = self._lost if self._keep_unproved else [*self._lost, *self._salvage.unproved]
        unproved: list[str] = [METADATA] if extras.metadata and not extras.proved else []
        unproved += self._salvage.unproved if self._keep_unproved else []
        recovery = Recovery(
            longest.text, tuple(dict.fromkeys(lost)), tuple(dict.fromkeys(unproved))
        )
        return [self._kept(stretch) for stretch in (longest, *others)], recovery

    def _kept(self, stretch: Stretch) -> _Kept:
        metadata = {**self._salvage.extras.metadata, "recovered": stretch.text}
        if self._keep_unproved and self._salvage.unproved:
            metadata["not_proved"] = "; ".join(self._salvage.unproved)
        extras = Extras(metadata, self._salvage.extras.attachments)
        return _Kept(stretch.text, lambda: self._logs(stretch, extras))

    def _logs(self, stretch: Stretch, extras: Extras) -> Iterator[Log]:
        with at(self._name):
            yield from stretch.logs(extras)

    def _others(self, stretches: list[Stretch], longest: Stretch) -> Iterator[Stretch]:
        topics = set().union(*(s.names for s in stretches))
        for stretch in stretches:
            if stretch is longest:
                continue
            try:
                stretch.empty(self._salvage.extras)
            except InputError as error:
                self._lost.append(f"{stretch.text}: {error}")
                continue
            yield stretch
            absent = ", ".join(sorted(topics - stretch.names))
            why = (
                f"{absent} has no samples there"
                if absent
                else "a gap separates them from the longer run"
            )
            self._lost.append(
                f"{stretch.count} intact samples from {seconds(stretch.start)} are in a log of "
                f"their own: {why}"
            )

    def _sorted(self, parts: list[Part]) -> list[Part]:
        """In the order of time, each once."""
        seen: dict[tuple[int, ...], str] = {}
        once = []
        for part in parts:
            if (first := seen.setdefault(part.identity, part.place)) != part.place:
                self._lost.append(f"a copy of the {first} is left out (the {part.place})")
            else:
                once.append(part)
        ordered = sorted(once, key=lambda p: p.start)
        if [p.place for p in ordered] != [p.place for p in once]:
            self._lost.append("chunks were out of order; they are sorted by time")
        return ordered

    def _by_topic(self) -> list[Trace]:
        """The samples of each topic in series without a gap, topics in the order of the file."""
        found: dict[int, list[Trace]] = {}
        known: dict[int, int] = {}  # losses when the last samples of a channel were read
        channels: dict[str, int] = {}
        for part in self._parts:
            for number, block in enumerate(self._salvage.blocks(part)):
                topic = self._salvage.topics.topic(block.channel, b"")
                if topic is None:
                    continue
                if channels.setdefault(topic.name, block.channel) != block.channel:
                    self._lost.append(f"{part.place}: another channel has the topic {topic.name}")
                    continue
                own = found.setdefault(block.channel, [])
                explained = bool(own) and known[block.channel] != part.losses
                known[block.channel] = part.losses
                self._append(own, topic, (part, number, block), explained)
        every = (trace for _, own in sorted(found.items()) for trace in own)
        return [trace for trace in every if trace.count and self._has_rate(trace)]

    def _append(
        self, own: list[Trace], topic: Topic, samples: tuple[Part, int, Block], explained: bool
    ) -> None:
        """Take samples into the last series, or a new one.

        explained: whether damage that was seen explains a gap, so that it is no loss of its own.
        """
        place = "" if explained else f"{samples[0].place}: "
        if own:
            try:
                own[-1].append(*samples)
                return
            except InputError as error:
                if not explained:
                    self._lost.append(f"{place}{error}")
        own.append(Trace(topic, self._salvage.blocks))
        try:
            own[-1].append(*samples)
        except InputError as error:
            self._lost.append(f"{place}{error}")

    def _has_rate(self, trace: Trace) -> bool:
        try:
            return trace.sample_rate() > 0.0
        except InputError as error:
            self._lost.append(str(error))
            return False

    def _together(self, series: list[Trace]) -> list[Stretch]:
        """The stretches of time in which the same topics have samples, an axis at least."""
        if not series:
            return []
        zero, rate = min(s.start for s in series), series[0].sample_rate()
        begins = [round((s.start - zero) * 1e-9 * rate) for s in series]
        spans = {s: range(b, b + s.count) for s, b in zip(series, begins, strict=True)}
        out = []
        for a, b in pairwise(sorted({e for r in spans.values() for e in (r.start, r.stop)})):
            here = {s.topic.name: s for s, r in spans.items() if a in r}
            if all(s.topic.is_truth for s in here.values()):
                if here:
                    self._lost.append(
                        f"{b - a} samples of {', '.join(here)} have no axis beside them"
                    )
                continue
            within = {s: slice(a - spans[s].start, b - spans[s].start) for s in here.values()}
            start = max(s.start + int(sample_times(w.start, 1, rate)[0]) for s, w in within.items())
            out.append(Stretch(within, b - a, start))
        return out

    def _report_absent_chunks(self) -> None:
        """Chunks of the summary that were not found at all, not even damaged."""
        there = {p.span for p in self._parts}
        for place, span in self._salvage.announced:
            if span not in there and place not in self._salvage.damaged:
                self._lost.append(
                    f"the chunk of samples from {seconds(span[0])} to {seconds(span[1])} that the "
                    "summary announces is not there"
                )
