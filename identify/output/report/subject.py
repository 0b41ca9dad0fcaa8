"""The results that a report shows, and the forces that its pictures are drawn from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.dataset.given_logs import Role
from identify.estimation.fit import Fit
from identify.experiment_design.plan import Plan
from identify.output.report.units import spaced
from identify.results.addition import Addition
from identify.results.results import Comparison, Diagnosis
from identify.results.told import Told
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
    assumed: Sequence[str] = ()

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

    def told(self, axis: str) -> Told | None:
        """What is told of the final model of one axis, where it was diagnosed."""
        return self.diagnosis.told.get(axis) if self.diagnosis else None

    def floors(self, axis: str) -> Mapping[Role, float]:
        """The noise floors of one axis by role of logs, N RMS."""
        told, compared = self.told(axis), self.comparison.axes.get(axis)
        if told is not None:
            return told.floors
        return {} if compared is None else {Role.TRAINING: compared.floor}

    def final(self, axis: str) -> Fit | None:
        """The model of this axis with everything that was found; None where nothing was."""
        found = self.diagnosed(axis)
        return found.final if found and found.final is not found.base else None

    def found_on(self, axis: str) -> str:
        """What was found on this axis, as a label; "" where nothing was."""
        found = self.diagnosed(axis)
        return what_was_found(found) if found and found.final is not found.base else ""

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


def what_was_found(found: AxisDiagnosis) -> str:
    """A label for what was found: the effect where it is one."""
    names = dict.fromkeys(f.effect for f in found.findings)
    return spaced(next(iter(names))) if len(names) == 1 else "all that was found"


@dataclass(frozen=True, eq=False)
class LogForces:
    """Forces of one axis over one log, each (n,) in ``unit``; time (n,) s.

    explain: command less inertia, the force that the effects must explain. model, found: that force
    by the model, and by the model with what was found; nan where static friction is undetermined.
    """

    name: str
    time: Array
    explain: Array
    model: Array
    found: Array | None
    unit: str = LINEAR.force


def forces_by_log(axis: AxisComparison, mass: float, final: Fit | None) -> list[LogForces]:
    """Forces of a model of that mass (kg), and of the final one, over each log."""
    left = by_log(axis, axis.residual, axis.kept)
    less = None if final is None else by_log(axis, final.residual, final.kept)
    out = []
    for i, log in enumerate(axis.logs):
        explain = log.command - mass * log.acceleration
        out.append(
            LogForces(
                name=log.motion.name,
                time=log.time,
                explain=explain,
                model=explain - left[i],
                found=None if less is None else explain - less[i],
                unit=axis.units.force,
            )
        )
    return out


def by_log(axis: AxisComparison, residual: Array, kept: NDArray[np.bool_]) -> list[Array]:
    """A residual (n,) N of each log of a comparison, nan where it carries no information."""
    every = np.full(len(kept), np.nan)
    every[kept] = residual
    return np.split(every, np.cumsum([len(log) for log in axis.logs])[:-1])
