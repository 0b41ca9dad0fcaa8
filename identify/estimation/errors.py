"""Force errors of fits on the logs of a role: logs that were fitted, that chose, or that test."""

from __future__ import annotations

from dataclasses import dataclass

from identify.dataset.dataset import Dataset
from identify.dataset.given_logs import Role
from identify.dataset.prepared_log import moving, sticks
from identify.estimation.evidence import rms
from identify.estimation.fit import Fit, error_on


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


def error_in(role: Role, fit: Fit, dataset: Dataset) -> float:
    """RMS force error (N) on the logs of a role; no number where there are none."""
    return fit.error if role is Role.TRAINING else rms(error_on(fit.axis, dataset.having(role)))


def error_if_any(role: Role, fit: Fit, dataset: Dataset) -> float | None:
    """The same, or None where there are none, or none that say anything of this model."""
    logs = dataset.having(role)
    return error_in(role, fit, dataset) if logs and moving(logs, sticks(fit.axis)).any() else None


def holdout_error(fit: Fit, dataset: Dataset) -> float | None:
    """RMS force error on the selection logs in N, or None where there are none."""
    return error_if_any(Role.SELECTION, fit, dataset)
