"""The report: one HTML file that needs nothing else, one module for each of its sections."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from identify.dataset.given_logs import Role
from identify.output.report import (
    answer,
    equations,
    growth,
    law_shape,
    logs,
    notes,
    overlay,
    parameters,
    ranking,
    regions,
    residuals,
    shape,
    whiteness,
)
from identify.output.report.blocks import Section
from identify.output.report.drawing import drawing_style
from identify.output.report.html import page
from identify.output.report.subject import Subject
from identify.output.report.units import quantity
from identify.results.addition import Addition
from identify.results.results import Comparison, Diagnosis
from twin.files import require_writable, write_atomically
from twin.model.history import HistoryStep

SECTIONS: tuple[Callable[[Subject], Section | None], ...] = (
    answer.section,
    law_shape.section,
    overlay.section,
    residuals.section,
    regions.section,
    whiteness.section,
    shape.section,
    ranking.section,
    growth.section,
    equations.section,
    parameters.section,
    logs.section,
    notes.section,
)


def write_report(
    path: Path,
    *,
    title: str,
    diagnosis: Diagnosis | None,
    comparison: Comparison,
    history: Sequence[HistoryStep],
    additions: Sequence[Addition] = (),
    assumed: Sequence[str] = (),
) -> None:
    """Write the report of a comparison, and of a diagnosis or additions where there are any.

    assumed: findings of the log check on what import maps assume, said first.

    One HTML file without outside references: styles and pictures are inside. It appears whole or
    not at all. Raises InputError where the folder does not exist.
    """
    require_writable(path)
    subject = Subject(
        title, diagnosis, comparison, tuple(history), tuple(additions), tuple(assumed)
    )
    with drawing_style():
        text = render(subject, sections(subject))
    write_atomically(path, text.encode("utf-8"))


def sections(subject: Subject) -> list[Section]:
    """The sections that have something to show."""
    made = (section(subject) for section in SECTIONS)
    return [s for s in made if s is not None]


def render(subject: Subject, shown: Sequence[Section]) -> str:
    """The page as HTML text."""
    return page(subject.title, _facts(subject), shown)


def _facts(subject: Subject) -> list[tuple[str, str]]:
    """The line under the title: model, logs, test functions."""
    axes = subject.comparison.axes.values()
    logs = list(dict.fromkeys(log.motion.name for a in axes for log in a.logs))
    lengths = list(dict.fromkeys(quantity(a.logs[0].test_function.length, "s") for a in axes))
    facts = [("Not confirmed", line) for line in subject.assumed]
    facts += [("Model", subject.comparison.model.name), ("Logs", ", ".join(logs))]
    for name, role in (("Held out", Role.SELECTION), ("Test", Role.TEST)):
        if others := _names(role, subject.diagnosis):
            facts.append((name, ", ".join(others)))
    return [*facts, ("Test function", ", ".join(lengths))]


def _names(role: Role, diagnosis: Diagnosis | None) -> list[str]:
    if diagnosis is None:
        return []
    logs = (log for d in diagnosis.axes.values() for log in d.dataset.having(role))
    return list(dict.fromkeys(log.motion.name for log in logs))


__all__ = ["write_report"]
