"""The results that a report shows, and what it shows of each axis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from identify.dataset.dataset import Role
from identify.output.words.diagnosis import Said, said_of
from identify.output.words.next_step import UNKNOWN, Source, names_of
from identify.output.words.verdict import all_found
from identify.results.grown import Addition
from identify.results.results import UNTOLD, AxisSummary, Comparison, Diagnosis, OnMachine
from identify.results.signals import Signals, signals_of
from identify.rules import RULE
from identify.selection.diagnosis import AxisDiagnosis, Verdict
from identify.validation.comparison import AxisComparison
from twin.model.machine import AxisModel, HistoryStep
from twin.model.units import AxisUnits


@dataclass(frozen=True, eq=False)
class Subject:
    """What a report shows: a result, and the effects that were added to its model (history).

    source: what the page is made of. machine: what the model says of its loop. findings: of the
    check of the logs.
    """

    title: str
    result: Diagnosis | Comparison
    history: Sequence[HistoryStep] = ()
    additions: Sequence[Addition] = ()
    source: Source = UNKNOWN
    machine: OnMachine = UNTOLD
    findings: Sequence[str] = ()

    @classmethod
    def of(cls, result: Diagnosis | Comparison, source: Source = UNKNOWN, **more: Any) -> Subject:
        """That of a result under its usual title; more: fields."""
        told = isinstance(result, Diagnosis)
        given = result.fitted if isinstance(result, Diagnosis) else result.model
        title = "what the model lacks" if told else "model against measurement"
        return cls(f"{given.name}: {title}", result, given.history, source=source, **more)

    @property
    def diagnosis(self) -> Diagnosis | None:
        return self.result if isinstance(self.result, Diagnosis) else None

    @property
    def comparison(self) -> Comparison:
        return self.result.comparison if isinstance(self.result, Diagnosis) else self.result

    @cached_property
    def logs(self) -> dict[Role, list[str]]:
        """Names of the logs by role; those of a comparison alone are given as training logs."""
        compared = (log.motion.name for a in self.comparison.axes.values() for log in a.logs)
        named = {Role.TRAINING: [*compared], Role.SELECTION: [], Role.TEST: []}
        for d in self.diagnosis.axes.values() if self.diagnosis else ():
            for role, names in names_of(d.dataset).items():
                named[role] += names
        return {role: list(dict.fromkeys(names)) for role, names in named.items()}

    def still_to_do(self, commands: Sequence[str]) -> list[str]:
        """Commands with the model and the logs of the page, less what was done."""
        return self.source.still_to_do(commands, self.logs)

    def command(self, text: str) -> str:
        """A command with the model and the logs of this page in the place of MODEL and LOG..."""
        return self.source.filled(text, self.logs)

    @cached_property
    def views(self) -> list[AxisView]:
        """The axes in the order of the model, but first the one that the answer is about."""
        axes = self.comparison.axes.values()
        first = max(axes, key=lambda a: a.ratio >= RULE.at_floor and a.ratio).axis
        if self.diagnosis:
            leading = self.diagnosis.leading
            quiet = leading.verdict is Verdict.NOTHING_MISSING
            first = "" if quiet else leading.dataset.axis
        return [self._view(axis) for axis in sorted(axes, key=lambda a: a.axis != first)]

    def _view(self, axis: AxisComparison) -> AxisView:
        if self.diagnosis is None or axis.axis not in self.diagnosis.axes:
            return AxisView(self, axis)
        name, told = axis.axis, self.diagnosis
        return AxisView(self, axis, told.axes[name], told.summaries[name], said_of(told, name))


@dataclass(frozen=True, eq=False)
class AxisView:
    """One axis of a report. axis: the errors of the model of the comparison.

    found: its diagnosis; summary: what is told of its final model; said: the sentences about it.
    """

    subject: Subject
    axis: AxisComparison
    found: AxisDiagnosis | None = None
    summary: AxisSummary | None = None
    said: Said | None = None

    @property
    def name(self) -> str:
        return self.axis.axis

    @property
    def units(self) -> AxisUnits:
        return self.axis.units

    def words(self, linear: str) -> str:
        """Words that are for a linear axis, on this one."""
        return self.units.words(linear)

    @property
    def model(self) -> AxisModel:
        """The model of the comparison."""
        return self.subject.comparison.model.axes[self.name]

    @property
    def label(self) -> str:
        """What was found on this axis; "" where nothing was."""
        return all_found(self.found) if self.found else ""

    @property
    def free_runs(self) -> Mapping[str, float]:
        """Free-running position error with all that was found, log -> m RMS; none of nothing."""
        result = self.subject.result
        runs = result.free_runs if isinstance(result, Diagnosis) and self.label else {}
        return runs.get(self.name, {})

    @property
    def floors(self) -> Mapping[Role, float]:
        """The noise floors by role of logs, N RMS."""
        return self.summary.floors if self.summary else {Role.TRAINING: self.axis.floor}

    @cached_property
    def signals(self) -> Signals:
        """What is drawn: of all logs of a diagnosis, else of those that were compared."""
        if self.found is None:
            return signals_of(dict.fromkeys(self.axis.logs), self.model, None)
        logs = {log: role for role in Role for log in self.found.dataset.having(role)}
        final = self.found.final.axis if self.label else None
        return signals_of(logs, self.found.base.axis, final)
