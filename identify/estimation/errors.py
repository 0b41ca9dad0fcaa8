"""RMS force errors of fits, on the logs of a role."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.dataset.dataset import Dataset, Role
from identify.dataset.prepared_log import PreparedLog, moving, sticks
from identify.estimation.evidence import rms
from identify.estimation.fit import Fit
from identify.estimation.force_balance import residual
from twin.model.machine import AxisModel

Array = NDArray[np.float64]


def error_on(axis: AxisModel, logs: Sequence[PreparedLog]) -> Array:
    """Force residual (n,) N of a model on other logs, without refitting."""
    return residual(axis, logs)[moving(logs, sticks(axis))]


@dataclass(frozen=True)
class Errors:
    """RMS force errors (N) without a change of a model and with it, on the logs of a role."""

    before: float
    after: float
    on: Role

    @classmethod
    def of(cls, before: Fit, after: Fit, dataset: Dataset, on: Role) -> Errors:
        """The errors of two fits."""
        first = error_in(on, before, dataset)
        return cls(first, first if after is before else error_in(on, after, dataset), on)

    def share_of(self, whole: float, floor: float) -> float:
        """Part of the square of a whole error above a noise floor (N) by which this one falls.

        Of this one before, where that is more: that of a fit without one finding may be.
        """
        above = max(whole, self.before) ** 2 - floor**2
        return min((self.before**2 - self.after**2) / above, 1.0) if above > 0.0 else 0.0


def error_in(role: Role, fit: Fit, dataset: Dataset) -> float:
    """RMS force error (N) on the logs of a role; no number where there are none."""
    return fit.error if role is Role.TRAINING else rms(error_on(fit.axis, dataset.having(role)))


def error_if_any(role: Role, fit: Fit, dataset: Dataset) -> float | None:
    """The same, or None where there are none, or none that say anything of this model."""
    logs = dataset.having(role)
    return error_in(role, fit, dataset) if logs and moving(logs, sticks(fit.axis)).any() else None
