"""Recover a damaged log: every stretch of samples that a checksum proves, without a gap in it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from mcap.opcode import Opcode

from twin.errors import InputError
from twin.log.assemble import Extras, assembled, common_rate, require_fields
from twin.log.chunks import has_checksum
from twin.log.container import open_mcap, reading
from twin.log.decode import read_strictly
from twin.log.instants import seconds
from twin.log.layout import Block, sample_times
from twin.log.log import Log
from twin.log.salvage import Part, Salvage
from twin.log.series import Series
from twin.log.topics import Topic

METADATA = "the metadata (experiment, seed, source) has no checksum of its own"


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


def recover_log(path: str | Path, *, unproved: bool = False) -> tuple[Log, Recovery]:
    """Read the longest series of intact chunks without a gap between them, and all others.

    Samples are kept only where a checksum proves them, or, where ``unproved`` is asked for, where
    nothing speaks against them. Metadata has no checksum of its own; where it contradicts the
    chunks it is ignored. Raises InputError where nothing is left.
    """
    path = Path(path)
    try:
        log = read_strictly(path)
    except InputError as error:
        reason = str(error).removeprefix(f"{path}: ")
    else:
        doubt = _doubt(path)
        if doubt and not unproved:
            raise InputError(f"{path}: {doubt[0]}; it can be read as it is, or with --unproved")
        return log, Recovery(f"all {len(log)} samples", (), doubt)
    with reading(path):
        return _Stretches(path.read_bytes(), reason, unproved).result()


def _doubt(path: Path) -> tuple[str, ...]:
    """Why nothing proves the samples of a log in which no fault was found."""
    with open_mcap(path) as file:
        records = file.records()
        opcodes = {r.opcode for r in records if r.opcode != Opcode.CHUNK or not has_checksum(r)}
        if file.checked or not opcodes & {Opcode.CHUNK, Opcode.MESSAGE}:
            return ()
    return ("the log has no checksums that prove its samples",)


@dataclass(frozen=True)
class _Stretch:
    """Samples of topics side by side: which of each series, how many, time of the first in ns."""

    spans: Mapping[Series, slice]
    count: int
    start: int

    @property
    def text(self) -> str:
        return f"{self.count} samples from {seconds(self.start)}"

    @property
    def names(self) -> set[str]:
        return {series.topic.name for series in self.spans}

    def log(self, extras: Extras) -> Log:
        """The log; raises InputError where an axis has too few signals, or rates differ."""
        for series in self.spans:
            if not series.topic.is_truth:
                require_fields(series.topic)
        rate = common_rate(list(self.spans), extras)
        columns = ((s.topic, s.part(span)) for s, span in self.spans.items())
        return assembled(columns, rate, extras)


class _Stretches:
    """The samples of a damaged log in stretches without a gap."""

    def __init__(self, data: bytes, reason: str, keep_unproved: bool) -> None:
        self._keep_unproved = keep_unproved
        self._salvage = Salvage(data, reason, keep_unproved)
        self._lost = self._salvage.lost
        self._parts = self._sorted(list(self._salvage.parts()))

    def result(self) -> tuple[Log, Recovery]:
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
        # the rate is stated in every chunk too, and there a checksum protects it
        self._salvage.extras.metadata.pop("sample_rate_hz", None)
        longest = max(stretches, key=lambda s: s.count * len(s.spans))
        log = self._log(longest)
        others = list(self._others(stretches, longest))
        lost = self._lost if self._keep_unproved else [*self._lost, *self._salvage.unproved]
        extras = self._salvage.extras
        unproved: list[str] = [METADATA] if extras.metadata and not extras.proved else []
        unproved += self._salvage.unproved if self._keep_unproved else []
        recovery = Recovery(
            longest.text, tuple(dict.fromkeys(lost)), tuple(dict.fromkeys(unproved)), tuple(others)
        )
        return log, recovery

    def _log(self, stretch: _Stretch) -> Log:
        metadata = {**self._salvage.extras.metadata, "recovered": stretch.text}
        if self._keep_unproved and self._salvage.unproved:
            metadata["not_proved"] = "; ".join(self._salvage.unproved)
        return stretch.log(Extras(metadata, self._salvage.extras.attachments))

    def _others(self, stretches: list[_Stretch], longest: _Stretch) -> Iterator[Log]:
        topics = set().union(*(s.names for s in stretches))
        for stretch in stretches:
            if stretch is longest:
                continue
            try:
                yield self._log(stretch)
            except InputError as error:
                self._lost.append(f"{stretch.text}: {error}")
                continue
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
        seen: dict[bytes, str] = {}
        once = []
        for part in parts:
            if (first := seen.setdefault(part.data, part.place)) != part.place:
                self._lost.append(f"a copy of the {first} is left out (the {part.place})")
            else:
                once.append(part)
        ordered = sorted(once, key=lambda p: p.start)
        if [p.place for p in ordered] != [p.place for p in once]:
            self._lost.append("chunks were out of order; they are sorted by time")
        return ordered

    def _by_topic(self) -> list[Series]:
        """The samples of each topic in series without a gap, topics in the order of the file."""
        found: dict[int, list[Series]] = {}
        known: dict[int, int] = {}  # losses when the last samples of a channel were read
        channels: dict[str, int] = {}
        for part in self._parts:
            for block in part.blocks:
                topic = self._salvage.topics.topic(block.channel, b"")
                if topic is None:
                    continue
                if channels.setdefault(topic.name, block.channel) != block.channel:
                    self._lost.append(f"{part.place}: another channel has the topic {topic.name}")
                    continue
                own = found.setdefault(block.channel, [])
                explained = bool(own) and known[block.channel] != part.losses
                known[block.channel] = part.losses
                self._append(own, topic, block, "" if explained else part.place)
        every = (series for _, own in sorted(found.items()) for series in own)
        return [series for series in every if series.count and self._has_rate(series)]

    def _append(self, own: list[Series], topic: Topic, block: Block, place: str) -> None:
        """Take samples into the last series, or a new one.

        place: where damage that was seen does not explain a gap, so that it is a loss of its own.
        """
        if own:
            try:
                own[-1].append(block)
                return
            except InputError as error:
                if place:
                    self._lost.append(f"{place}: {error}")
        own.append(Series(topic, 0))
        try:
            own[-1].append(block)
        except InputError as error:
            self._lost.append(f"{place}: {error}" if place else str(error))

    def _has_rate(self, series: Series) -> bool:
        try:
            return series.sample_rate() > 0.0
        except InputError as error:
            self._lost.append(str(error))
            return False

    def _together(self, series: list[Series]) -> list[_Stretch]:
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
            out.append(_Stretch(within, b - a, start))
        return out

    def _report_absent_chunks(self) -> None:
        """Chunks of the summary that were not found at all, not even damaged."""
        there = {p.span for p in self._parts}
        for index in self._salvage.announced:
            span = (index.message_start_time, index.message_end_time)
            if span not in there and index.chunk_start_offset not in self._salvage.damaged:
                self._lost.append(
                    f"the chunk of samples from {seconds(span[0])} to {seconds(span[1])} that the "
                    "summary announces is not there"
                )
