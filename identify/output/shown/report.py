"""The report: one HTML file that needs nothing else; its sections are in ``SECTIONS``, in order."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import date
from pathlib import Path

from identify.dataset.dataset import Role
from identify.output.blocks import AnswerBlock, Block, Chart, Heading
from identify.output.machine import ASSUMES
from identify.output.numbers import quantity
from identify.output.report.page import Section, fragment
from identify.output.report.page import page as whole_page
from identify.output.shown import answer, effects, loop, residual
from identify.output.shown.explorer import explored
from identify.output.shown.subject import AxisView, Subject
from identify.results.results import Comparison, Diagnosis
from twin.files import require_writable, write_atomically
from twin.model.file import format_model


@dataclass(frozen=True)
class PagePart:
    """A section of every report: its blocks for one axis, and those for all axes together."""

    anchor: str
    title: str
    of_axis: Callable[[AxisView], list[Block]] | None = None
    of_all: Callable[[Subject], list[Block]] | None = None


SECTIONS = (
    PagePart("answer", "Answer", answer.cards),
    PagePart("found", "What each effect explains", effects.found),
    PagePart("law-shape", "The shape of a law", effects.law_shapes),
    PagePart("regions", "Where the error is", residual.regions),
    PagePart("ranking", "Candidates, ranked", effects.ranking),
    PagePart("growth", "The error, effect by effect", of_all=effects.growth),
    PagePart("equations", "The laws of the named effects", effects.equations),
    PagePart("parameters", "Parameters", effects.parameters),
    PagePart("logs", "Errors log by log", residual.logs),
    PagePart("worth", "What it gains as feedforward", loop.worth),
    PagePart("frequency", "The frequency response", loop.responses),
    PagePart("tests", "Is the residual noise?", residual.whiteness, residual.reasons),
    PagePart("notes", "Notes", of_all=answer.notes),
)


def write_report(path: Path, subject: Subject) -> None:
    """Write the report of a comparison, and of a diagnosis or additions where there are any.

    One HTML file without outside references: styles, scripts and signals are inside. It appears
    whole or not at all. Raises InputError where the folder does not exist.
    """
    require_writable(path)
    first = (("Assumed", ASSUMES), ("Fault", ": error: "))
    warnings = [(what, line) for what, mark in first for line in subject.findings if mark in line]
    shown, signals = sections(subject), explored(subject)
    text = whole_page(subject.title, facts(subject), shown, signals, origin(subject), warnings)
    write_atomically(path, text.encode("utf-8"))


def sections(subject: Subject, parts: Sequence[PagePart] = SECTIONS) -> list[Section]:
    """The sections that have something to show: of each axis, then of all."""
    made = []
    for part in parts:
        blocks: list[Block] = []
        for view in subject.views:
            own = part.of_axis(view) if part.of_axis else []
            if own and len(subject.views) > 1 and not isinstance(own[0], AnswerBlock | Heading):
                blocks.append(Heading(f"Axis {view.name}"))
            blocks += own
        if part.of_all:
            blocks += part.of_all(subject)
        if blocks:
            made.append(Section(part.anchor, part.title, blocks))
    return made


def tables(result: Comparison | Diagnosis) -> str:
    """What a notebook shows: the answer and the tables of a report, without its plots."""
    shown = ("answer", "found", "regions", "parameters", "logs")
    blocks: list[Block] = []
    for section in sections(Subject("", result), [p for p in SECTIONS if p.anchor in shown]):
        blocks += [Heading(section.title)] if section.anchor != "answer" else []
        blocks += [block for block in section.blocks if not isinstance(block, Chart)]
    return fragment(blocks)


def facts(subject: Subject) -> list[tuple[str, str]]:
    """The line under the title: model, logs by role, test functions."""
    axes = subject.comparison.axes.values()
    lengths = dict.fromkeys(quantity(a.logs[0].test_function.length, "s") for a in axes)
    shown = [("Model", subject.comparison.model.name)]
    for role, logs in subject.logs.items():
        compared = role is Role.TRAINING and subject.diagnosis is None
        title = "Logs" if compared else f"{role.value.capitalize()} logs"
        shown += [(title, ", ".join(logs))] if logs else []
    return [*shown, ("Test functions", ", ".join(lengths))]


def origin(subject: Subject) -> list[tuple[str, str]]:
    """The footer: by what, when and of which files the page was made."""
    file = subject.source.folder / subject.source.model
    model = subject.comparison.model  # as it was given, which the file itself confirms
    given = file.read_bytes() if file.is_file() else format_model(model).encode()
    shown = [("Date", date.today().isoformat())]
    if subject.source.command:
        shown.append(("Command", subject.source.command))
    shown.append(("Model, sha256", hashlib.sha256(given).hexdigest()))
    every = [name for names in subject.logs.values() for name in names]
    return shown + [(f"{n}, sha256", _digest(subject.source.folder / n)) for n in every]


def _digest(path: Path) -> str:
    """That of a file; a log that was given from memory has none."""
    if not path.is_file():
        return "given in memory, not as a file"
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
