"""What the chapters share: a planted value beside what was found for it and what is printed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Progress = Callable[[str, int, int], None]  # what, done, of how many


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
