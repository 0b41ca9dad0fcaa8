"""Recover a damaged log: every stretch of samples that a checksum proves, without a gap in it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from mcap.opcode import Opcode

from twin.errors import InputError
from twin.log.assemble import Extras, Run
from twin.log.container import has_checksum, open_mcap, reading
from twin.log.decode import read_strictly
from twin.log.instants import seconds
from twin.log.log import Log
from twin.log.salvage import Part, Salvage

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


class _Stretches:
    """The samples of a damaged log in stretches without a gap."""

    def __init__(self, data: bytes, reason: str, keep_unproved: bool) -> None:
        self._keep_unproved = keep_unproved
        self._salvage = Salvage(data, reason, keep_unproved)
        self._lost = self._salvage.lost
        self._parts = self._sorted(list(self._salvage.parts()))

    def result(self) -> tuple[Log, Recovery]:
        """The longest series and the others; raises InputError where there is none."""
        runs = self._runs()
        self._report_absent_chunks()
        counts = [self._count(run) for run in runs]
        if not any(counts):
            hint = (
                ""
                if self._keep_unproved or not self._salvage.unproved
                else "; read it with --unproved"
            )
            why = "; ".join(dict.fromkeys([*self._lost, *self._salvage.unproved]))
            raise InputError(f"nothing can be recovered ({why}){hint}")
        # the rate is stated in every chunk too, and there a checksum protects it
        self._salvage.extras.metadata.pop("sample_rate_hz", None)
        longest = counts.index(max(counts))
        log, kept = self._log(runs[longest], counts[longest])
        others = list(self._others(runs, counts, longest))
        lost = self._lost if self._keep_unproved else [*self._lost, *self._salvage.unproved]
        extras = self._salvage.extras
        unproved: list[str] = [METADATA] if extras.metadata and not extras.proved else []
        unproved += self._salvage.unproved if self._keep_unproved else []
        recovery = Recovery(
            kept, tuple(dict.fromkeys(lost)), tuple(dict.fromkeys(unproved)), tuple(others)
        )
        return log, recovery

    def _log(self, run: Run, count: int) -> tuple[Log, str]:
        kept = f"{count} samples from {seconds(run.start())}"
        metadata = {**self._salvage.extras.metadata, "recovered": kept}
        if self._keep_unproved and self._salvage.unproved:
            metadata["not_proved"] = "; ".join(self._salvage.unproved)
        return run.trimmed_log(Extras(metadata, self._salvage.extras.attachments)), kept

    def _others(self, runs: list[Run], counts: list[int], longest: int) -> Iterator[Log]:
        for i, (run, count) in enumerate(zip(runs, counts, strict=True)):
            if i == longest or not count:
                continue
            start = seconds(run.start())
            try:
                yield self._log(run, count)[0]
            except InputError as error:
                self._lost.append(f"{count} samples from {start}: {error}")
                continue
            self._lost.append(
                f"{count} intact samples from {start} are in a log of their own: a gap separates "
                "them from the longer run"
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

    def _runs(self) -> list[Run]:
        """The samples in stretches without a gap."""
        runs: list[Run] = []
        losses = -1  # how many were known when the last samples were read
        for part in self._parts:
            explained, losses = part.losses != losses, part.losses
            if runs:
                try:
                    runs[-1].extend(part.blocks)
                    continue
                except InputError as error:
                    if not explained:  # no damage was seen where the gap is
                        self._lost.append(f"{part.place}: {error}")
            runs.append(Run(self._salvage.topics))
            try:
                runs[-1].extend(part.blocks)
            except InputError as error:
                self._lost.append(f"{part.place}: {error}")
        return runs

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

    def _count(self, run: Run) -> int:
        try:
            return run.common_count()
        except InputError as error:
            self._lost.append(str(error))
            return 0
