"""What else the reader should know: fits that did not end well, parameters that jumped."""

from __future__ import annotations

from identify.diagnose import AxisDiagnosis
from identify.fit import Outcome
from identify.report.blocks import Listing, Section
from identify.report.subject import Subject
from identify.report.units import spaced
from identify.workflow import moved_parameters


def section(subject: Subject) -> Section | None:
    """Notes of all axes and of the model's history, each once."""
    notes: list[str] = []
    for axis in subject.axes:
        found = subject.diagnosed(axis.axis)
        if found is not None:
            notes.extend(f"Axis {axis.axis}: {note}" for note in _notes(found))
    for step in (*subject.steps, *(a.step for a in subject.additions)):
        what = f"Axis {step.axis}, {spaced(step.effect)} added"
        notes.extend(f"{what}: {_sentence(note)}" for note in step.notes)
    return Section("notes", "Notes", [Listing(tuple(dict.fromkeys(notes)))]) if notes else None


def _notes(found: AxisDiagnosis) -> list[str]:
    notes = []
    if found.base.outcome is not Outcome.CONVERGED:
        notes.append(found.base.outcome.value)
    if found.best is not None:
        name = spaced(found.best.effect.name)
        if found.best.fit.outcome is not Outcome.CONVERGED:
            notes.append(f"with {name}: {found.best.fit.outcome.value}")
        moved = moved_parameters(found.base, found.best.fit)
        notes.extend(f"with {name}, {_sentence(note)}" for note in moved)
    if not found.study.holdout:
        notes.append(
            "no log was held out; candidates were judged on blocks left out of the fit, which is "
            "weaker. Give --holdout a log of another run."
        )
    return notes


def _sentence(text: str) -> str:
    return text if text.endswith(".") else f"{text}."
