"""Notes: channel delays, fits that did not converge, parameters that an effect changed."""

from __future__ import annotations

from identify.output.remarks import remarks_on
from identify.output.report.blocks import Listing, Section
from identify.output.report.subject import Subject
from identify.output.report.units import SCALED, spaced


def section(subject: Subject) -> Section | None:
    """Notes of all axes and of the model's history, each once."""
    notes: list[str] = []
    for axis in subject.axes:
        if subject.diagnosis is not None and subject.diagnosed(axis.axis) is not None:
            notes.extend(
                f"Axis {axis.axis}: {_sentence(note)}"
                for note in remarks_on(subject.diagnosis, axis.axis, SCALED)
            )
    for step in (*subject.steps, *(a.step for a in subject.additions)):
        done = "given the shape found" if step.action == "shape" else "added"
        what = f"Axis {step.axis}, {spaced(step.effect)} {done}"
        notes.extend(f"{what}: {_sentence(note)}" for note in step.notes)
    return Section("notes", "Notes", [Listing(tuple(dict.fromkeys(notes)))]) if notes else None


def _sentence(text: str) -> str:
    return text if text.endswith(".") else f"{text}."
