"""How a model grew: one record for each effect that was added or replaced."""

from __future__ import annotations

from dataclasses import dataclass

from twin.model.units import LINEAR


@dataclass(frozen=True)
class HistoryStep:
    """One step of the model's growth.

    Errors are RMS force errors in ``unit``; None where not measured. The selection logs may have
    taken part in the choice of the effect; on the test logs nothing was decided.
    """

    action: str
    effect: str
    axis: str
    fit_error_before: float
    fit_error_after: float
    holdout_error_before: float | None
    holdout_error_after: float | None
    unit: str = LINEAR.force
    notes: tuple[str, ...] = ()
    test_error_before: float | None = None
    test_error_after: float | None = None
