"""The samples of one topic as they arrive, block by block."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from twin.errors import InputError
from twin.log.instants import seconds
from twin.log.layout import Block
from twin.log.log import Array
from twin.log.spacing import Spacing
from twin.log.topics import Topic


class Series(Spacing):
    """Columns of one topic; ``append`` refuses what is not evenly spaced and finite.

    capacity: samples expected; more are taken too. wanted: the fields that are kept, None for all.
    """

    def __init__(self, topic: Topic, capacity: int, wanted: Collection[str] | None = None) -> None:
        super().__init__(topic)
        fields = [f for f in topic.fields if wanted is None or f in wanted]
        self._columns = {name: np.empty(capacity) for name in fields}

    def append(self, block: Block) -> None:
        """Take the next samples; raises InputError for a gap, a NaN or a time out of place."""
        self.check(block)
        self._reserve(len(block.log_time))
        span = slice(self.count, self.count + len(block.log_time))
        for name, column in self._columns.items():
            column[span] = block.columns.get(name, 0.0)
            require_finite(self, block, name, column[span])
        self.take(block)

    def columns(self, span: slice) -> dict[str, Array]:
        """The samples in ``span`` of every field; releases the buffers."""
        out = {}
        for name in list(self._columns):
            column = self._columns.pop(name)
            part = column[span]
            out[name] = part if len(part) == len(column) else part.copy()
        return out

    def _reserve(self, more: int) -> None:
        need = self.count + more
        for name, column in self._columns.items():
            if need > len(column):
                grown = np.empty(max(need, 2 * len(column)))
                grown[: self.count] = column[: self.count]
                self._columns[name] = grown


def require_finite(samples: Spacing, block: Block, name: str, column: Array) -> None:
    """Raise InputError where a column of the next samples is not a number."""
    finite = np.isfinite(column)
    if not finite.all():
        i = int(np.argmin(finite))
        raise InputError(
            f"{samples.topic.name}: {name} is {column[i]} at {seconds(float(block.log_time[i]))} "
            f"(sample {samples.count + i}); leave out a signal that was not recorded, "
            "or keep the longest part without it with: twin recover"
        )
