"""Stretches of a damaged log without a gap, read from its file as often as they are needed."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from twin.logs.assemble import Extras, assembled, common_rate, require_fields
from twin.logs.layout import Block
from twin.logs.log import Array, Log
from twin.logs.salvage import Part
from twin.logs.series import Spacing, require_finite, seconds
from twin.logs.topics import Topic

STEP = 1 << 15  # samples that are held in memory at a time

Reader = Callable[[Part], list[Block]]
Columns = Mapping[str, Array]


class Trace(Spacing):
    """Samples of one topic without a gap: where they are, not what they are."""

    def __init__(self, topic: Topic, read: Reader) -> None:
        super().__init__(topic)
        self._read = read
        self._pieces: list[tuple[int, Part, int]] = []  # first sample, part, number of its block

    def append(self, part: Part, number: int, block: Block) -> None:
        """Take the next samples, block ``number`` of a part; raises InputError as Series does."""
        self.check(block)
        for name, column in block.columns.items():
            if name in self.topic.fields:
                require_finite(self, block, name, column)
        self._pieces.append((self.count, part, number))
        self.take(block)

    def columns(self, span: slice, sizes: list[int]) -> Iterator[Columns]:
        """The samples in ``span``, in pieces of these sizes."""
        blocks, held, there = self._blocks(span), self.none(), 0
        for size in sizes:
            parts = [held]
            while there < size:
                count, columns = next(blocks)
                parts.append(columns)
                there += count
            whole = {name: np.concatenate([p[name] for p in parts]) for name in self.topic.fields}
            yield {name: column[:size] for name, column in whole.items()}
            held, there = {name: column[size:] for name, column in whole.items()}, there - size

    def none(self) -> Columns:
        """No sample of any field."""
        return {name: np.empty(0) for name in self.topic.fields}

    def _blocks(self, span: slice) -> Iterator[tuple[int, Columns]]:
        for first, part, number in self._pieces:
            if first >= span.stop:
                return
            block = self._read(part)[number]
            inside = slice(max(0, span.start - first), min(len(block.log_time), span.stop - first))
            count = inside.stop - inside.start
            if count > 0:
                nothing = np.zeros(count)
                yield (
                    count,
                    {
                        name: block.columns[name][inside] if name in block.columns else nothing
                        for name in self.topic.fields
                    },
                )


@dataclass(frozen=True)
class Stretch:
    """Samples of topics side by side: which of each trace, how many, time of the first in ns."""

    spans: Mapping[Trace, slice]
    count: int
    start: int

    @property
    def text(self) -> str:
        """How many samples from which time on."""
        return f"{self.count} samples from {seconds(self.start)}"

    @property
    def names(self) -> set[str]:
        """The topics."""
        return {trace.topic.name for trace in self.spans}

    def empty(self, extras: Extras) -> Log:
        """The log without samples; raises InputError where an axis has too few signals, ..."""
        for trace in self.spans:
            if not trace.topic.is_truth:
                require_fields(trace.topic)
        rate = common_rate(self.spans, extras)
        return self._assembled([trace.none() for trace in self.spans], rate, extras)

    def logs(self, extras: Extras) -> Iterator[Log]:
        """Its samples as logs that follow each other; raises InputError as ``empty`` does."""
        rate = self.empty(extras).sample_rate
        sizes = [min(STEP, self.count - k) for k in range(0, self.count, STEP)]
        columns = [trace.columns(span, sizes) for trace, span in self.spans.items()]
        for parts in zip(*columns, strict=True):
            yield self._assembled(parts, rate, extras)

    def _assembled(self, columns: Iterable[Columns], rate: float, extras: Extras) -> Log:
        topics = (trace.topic for trace in self.spans)
        pairs = ((topic, dict(own)) for topic, own in zip(topics, columns, strict=True))
        return assembled(pairs, rate, extras)
