"""What is told of one diagnosed axis beside its findings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from identify.dataset.dataset import Role
from identify.dataset.floor import NoiseFloor
from identify.dataset.noise_floor import floor_of
from identify.estimation.confounded import MovedParameter, moved_parameters
from identify.estimation.fit import Errors, error_in
from identify.estimation.intervals import Estimate, estimates
from identify.selection.acceptance import Judged
from identify.selection.diagnosis import AxisDiagnosis


@dataclass(frozen=True)
class Told:
    """The final model of an axis, and how it differs from the one that was fitted before.

    before, after: estimates without and with what was found. moved: parameters that what was found
    changed. tested, chosen: errors without and with it on the test logs and on those that chose.
    floors: noise floor of the final model on the logs of each role, N RMS, the only one that is
    told: never more than what the model leaves there, as noise is part of that. selection_ratio:
    error of the model without what was found on the selection logs over their noise floor; None
    where there are none. noise: the floor on the training logs with its parts.
    """

    before: tuple[Estimate, ...]
    after: tuple[Estimate, ...]
    moved: tuple[MovedParameter, ...]
    tested: Errors
    chosen: Errors
    floors: Mapping[Role, float]
    selection_ratio: float | None = None
    noise: NoiseFloor | None = None

    @property
    def floor(self) -> float:
        """Noise floor on the training logs, N RMS."""
        return self.floors[Role.TRAINING]


def told_of(found: AxisDiagnosis) -> Told:
    """What is told of a diagnosis."""
    base, final, dataset = found.base, found.final, found.dataset
    floors = {Role.TRAINING: final.floor}
    for role in (Role.SELECTION, Role.TEST):
        if logs := dataset.having(role):
            floors[role] = min(floor_of(final.axis, logs), error_in(role, final, dataset))
    judged, before = Judged(base, dataset), estimates(base)
    return Told(
        before=before,
        after=before if final is base else estimates(final),
        moved=() if final is base else moved_parameters(base, final),
        tested=found.tested,
        chosen=found.chosen,
        floors=floors,
        selection_ratio=judged.other_error / judged.other_floor if dataset.holdout else None,
        noise=final.noise,
    )
