"""What the chapters share: how one is run, and a planted value beside what was found for it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from twin.effects import Catalogue
from twin.log import Log
from twin.model.machine import MachineModel
from twin.progress import Progress

Array = NDArray[np.float64]
Size = TypeVar("Size")
Result = TypeVar("Result", covariant=True)


@dataclass(frozen=True)
class Chapter(Generic[Size, Result]):
    """A chapter and what it needs: names of model files, its whole size and a quick one.

    run: from those models, the catalogue of effects, a size, a generator for all that is drawn, and
    progress. on_logs: the same from logs of a real machine with its model, where that makes sense;
    then nothing is planted.
    """

    models: tuple[str, ...]
    full: Size
    small: Size
    run: Callable[[Sequence[MachineModel], Catalogue, Size, np.random.Generator, Progress], Result]
    on_logs: Callable[[MachineModel, Mapping[str, Log]], Any] | None = None


@dataclass(frozen=True, eq=False)
class Recovered:
    """One parameter: planted, found (trials,) and printed in the thesis (None if it is not)."""

    true: float
    values: Array
    unit: str
    printed: float | None = None

    @property
    def mean(self) -> float:
        """Mean of what was found."""
        return float(np.mean(self.values))

    @property
    def sd(self) -> float:
        """Standard deviation of what was found; 0 for one trial."""
        return float(np.std(self.values, ddof=1)) if len(self.values) > 1 else 0.0

    @property
    def error(self) -> float:
        """Mean less the planted value, over the planted value."""
        return self.mean / self.true - 1.0

    @property
    def rms_error(self) -> float:
        """Usual error of one trial, over the planted value."""
        return float(np.sqrt(np.mean((self.values / self.true - 1.0) ** 2)))
