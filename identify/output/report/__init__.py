"""The report: one HTML file that needs nothing else; its sections are in ``SECTIONS``, in order."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from identify.dataset.given_logs import Role
from identify.output.numbers import quantity
from identify.output.report import answer, effects, residual
from identify.output.report.drawing import drawing_style
from identify.output.report.page import Answer, Block, Heading, Part, Section
from identify.output.report.page import page as whole_page
from identify.output.report.subject import Subject
from identify.results.addition import Addition
from identify.results.results import Comparison, Diagnosis
from twin.files import require_writable, write_atomically
from twin.model.machine import HistoryStep

SECTIONS = (
    Part("answer", "Answer", answer.cards),
    Part("law-shape", "The shape of a law", effects.law_shapes),
    Part("force", "Measured and modelled force", residual.forces),
    Part("residual", "What the model leaves unexplained", residual.residuals),
    Part("regions", "Where the error is", residual.regions),
    Part("tests", "Is the residual noise?", residual.whiteness, residual.reasons),
    Part("shape", "Fitted curves without physics", effects.curves),
    Part("ranking", "Candidates, ranked", effects.ranking),
    Part("growth", "The error, effect by effect", of_all=effects.growth),
    Part("equations", "The laws of the named effects", effects.equations),
    Part("parameters", "Parameters", effects.parameters),
    Part("logs", "Errors log by log", residual.logs),
    Part("notes", "Notes", of_all=answer.notes),
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
        text = whole_page(subject.title, facts(subject), sections(subject))
    write_atomically(path, text.encode("utf-8"))


def sections(subject: Subject, parts: Sequence[Part] = SECTIONS) -> list[Section]:
    """The sections that have something to show: of each axis, then of all."""
    made = []
    for part in parts:
        blocks: list[Block] = []
        for view in subject.views:
            own = part.of_axis(view) if part.of_axis else []
            if own and len(subject.views) > 1 and not isinstance(own[0], Answer | Heading):
                blocks.append(Heading(f"Axis {view.name}"))
            blocks += own
        if part.of_all:
            blocks += part.of_all(subject)
        if blocks:
            made.append(Section(part.anchor, part.title.replace("force", subject.forces), blocks))
    return made


def facts(subject: Subject) -> list[tuple[str, str]]:
    """The line under the title: model, logs by role, test functions."""
    axes = subject.comparison.axes.values()
    logs = dict.fromkeys(log.motion.name for a in axes for log in a.logs)
    lengths = dict.fromkeys(quantity(a.logs[0].test_function.length, "s") for a in axes)
    diagnosed = subject.diagnosis.axes.values() if subject.diagnosis else ()
    shown = [("Not confirmed", line) for line in subject.assumed]
    shown.append(("Model", subject.comparison.model.name))
    shown.append(("Training logs" if diagnosed else "Logs", ", ".join(logs)))
    for name, role in (("Selection logs", Role.SELECTION), ("Test logs", Role.TEST)):
        others = (log.motion.name for d in diagnosed for log in d.dataset.having(role))
        if text := ", ".join(dict.fromkeys(others)):
            shown.append((name, text))
    return [*shown, ("Test functions", ", ".join(lengths))]


__all__ = ["write_report"]
