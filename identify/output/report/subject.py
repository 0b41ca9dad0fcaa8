"""The results that a report shows, and the forces that its pictures are drawn from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.dataset.prepared_log import PreparedLog, moving
from identify.estimation.fit import sticks
from identify.estimation.force_balance import residual
from identify.experiment_design.plan import Plan
from identify.output.addition import Addition
from identify.output.results import Comparison, Diagnosis
from identify.selection.candidates import Candidate
from identify.selection.confounded import Refit
from identify.selection.diagnosis import AxisDiagnosis, Verdict
from identify.validation.misfit_maps import AxisComparison, Region
from twin.model.history import HistoryStep
from twin.model.machine import AxisModel
from twin.model.units import LINEAR

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Subject:
    """The results that a report shows."""

    title: str
    diagnosis: Diagnosis | None
    comparison: Comparison
    history: Sequence[HistoryStep]
    additions: Sequence[Addition]

    @property
    def axes(self) -> list[AxisComparison]:
        """The axes in the order of the model, but the leading axis of the diagnosis first."""
        leading = self.diagnosis.leading if self.diagnosis else None
        first = (
            leading.dataset.axis
            if leading and leading.verdict is not Verdict.NOTHING_MISSING
            else None
        )
        return sorted(self.comparison.axes.values(), key=lambda a: a.axis != first)

    def diagnosed(self, axis: str) -> AxisDiagnosis | None:
        """The diagnosis of one axis, where there is one."""
        return self.diagnosis.axes.get(axis) if self.diagnosis else None

    def next_experiment(self, axis: str) -> Plan | None:
        """The experiment that decides what the diagnosis of one axis could not."""
        return self.diagnosis.next_experiments.get(axis) if self.diagnosis else None

    def left_over(self, axis: str) -> Region | None:
        """Where what the diagnosis leaves of one axis is largest."""
        return self.diagnosis.left_over.get(axis) if self.diagnosis else None

    def refit(self, axis: str) -> Refit | None:
        """What fitting changed of the given model on one axis."""
        return self.diagnosis.refits.get(axis) if self.diagnosis else None

    def named(self, axis: str) -> Candidate | None:
        """The effect that the diagnosis names on this axis."""
        found = self.diagnosed(axis)
        return found.best if found else None

    def model(self, axis: str) -> AxisModel:
        """The model of the comparison."""
        return self.comparison.model.axes[axis]

    @property
    def steps(self) -> Sequence[HistoryStep]:
        """The added effects, from the model's history or else from the additions."""
        return self.history or tuple(a.step for a in self.additions)

    def heading(self, axis: str) -> str:
        """Heading of what belongs to one axis of several, "" where there is one only."""
        return f"Axis {axis}" if len(self.comparison.axes) > 1 else ""


@dataclass(frozen=True, eq=False)
class LogForces:
    """Forces of one axis over one log, each (n,) in ``unit``; time (n,) s.

    explain: command less inertia, the force that the effects must explain. model, named: that force
    by the model, and by the model with the named effect; nan where static friction is undetermined.
    """

    name: str
    time: Array
    explain: Array
    model: Array
    named: Array | None
    unit: str = LINEAR.force


def log_forces(log: PreparedLog, model: AxisModel, named: AxisModel | None) -> LogForces:
    """Forces of a model, and of a richer one, over one log."""
    explain = log.command - model.mass * log.acceleration
    return LogForces(
        name=log.motion.name,
        time=log.time,
        explain=explain,
        model=explain - shown_residual(model, log),
        named=None if named is None else explain - shown_residual(named, log),
        unit=log.motion.units.force,
    )


def shown_residual(model: AxisModel, log: PreparedLog) -> Array:
    """Force residual (n,) N, nan where it carries no information."""
    return np.where(moving([log], sticks(model)), residual(model, [log]), np.nan)
