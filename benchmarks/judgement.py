"""What is right to say of a machine, and how a diagnosis of it is judged; rows of JSON."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from identify.dataset.dataset import Dataset, Role
from identify.dataset.preparation import datasets
from identify.estimation.alignment import fit_aligned
from identify.estimation.errors import error_if_any
from identify.estimation.fit import Fit
from identify.output.words.refusal import refusal_in_words
from identify.selection.candidates import Candidate
from identify.selection.diagnosis import AxisDiagnosis
from identify.selection.findings import Finding, FindingKind
from twin.engine import engine, outcomes
from twin.logs import Log
from twin.model.machine import MachineModel

Row = dict[str, Any]
Logs = dict[str, Log]
STATED = 0.9  # confidence from which a wrong name counts as stated
NUMBER = re.compile(r"_\d+$")  # of one of several, such as cogging_2
RIGHT, EQUIVALENT, KNOWN, WRONG, SILENT = "right", "equivalent", "known", "wrong", "silent"
HEAD = (
    "| case | expected | mark | verdict | findings | errors | floors | s |\n"
    "|---|---|---|---|---|---|---|---|"
)


@dataclass(frozen=True)
class Expected:
    """What is right to say of a machine; it is decided before any diagnosis.

    right: effects that say what the model lacks. equivalent: those whose force these logs cannot
    tell from it, or whose law is near enough to be of use. shapes: laws of the model of which
    another shape says it. known: effects, and known_shapes: laws of another shape, that the machine
    has besides. Where nothing is right, nothing is to be said.
    """

    right: tuple[str, ...] = ()
    equivalent: tuple[str, ...] = ()
    shapes: tuple[str, ...] = ()
    known: tuple[str, ...] = ()
    known_shapes: tuple[str, ...] = ()

    @property
    def nothing(self) -> bool:
        """Whether there is nothing to be found."""
        return not (self.right or self.equivalent or self.shapes)

    def mark(self, finding: Finding) -> str:
        """Whether a finding is right, equivalent, known, or wrong."""
        first, *tied = (NUMBER.sub("", name) for name in (finding.effect, *finding.tied))
        shaped = finding.kind is FindingKind.WRONG_SHAPE
        if first in (self.shapes if shaped else self.right):
            return RIGHT
        if not {*tied}.isdisjoint((*self.right, *self.equivalent)):
            return EQUIVALENT
        if not shaped and first in self.equivalent:
            return EQUIVALENT
        known = first in (self.known_shapes if shaped else self.known)
        return KNOWN if known or not {*tied}.isdisjoint(self.known) else WRONG


def fitted(
    model: MachineModel, axis: str, logs: Logs, selection: Logs | None = None,
    test: Logs | None = None,
) -> tuple[Dataset, Fit]:  # fmt: skip
    """The dataset of an axis and the fit of the model that a diagnosis starts from."""
    dataset = datasets(model, logs, selection or {}, None, test)[axis]
    return fit_aligned(model.axes[axis], dataset)


def row_of(case: str, expected: Expected, found: AxisDiagnosis, seconds: float) -> Row:
    """The answer of a diagnosis, judged. Errors (before, after) in ``unit``, seconds of CPU."""
    findings = [_finding(f, expected.mark(f)) for f in found.findings]
    marks = {f["mark"] for f in findings}
    best = next((m for m in (RIGHT, EQUIVALENT) if m in marks), SILENT)
    beside = RIGHT if expected.nothing and best == SILENT else best
    return {
        "case": case,
        "expected": asdict(expected),
        "verdict": found.verdict.name.lower(),
        "mark": WRONG if WRONG in marks else beside,
        "named": best != SILENT,
        "findings": findings,
        "small": list(found.also_seen),
        "contradicted": [f.effect for f in found.contradicted],
        "doubted": {name: refusal_in_words(why) for name, why in found.doubted.items()},
        "unit": found.dataset.units.force,
        "floor": found.base.floor,
        "errors": {
            r.value: [error_if_any(r, f, found.dataset) for f in (found.base, found.final)]
            for r in Role
        },
        "ratio": found.base.ratio,
        "left": found.final.ratio,
        "ranking": [_candidate(c) for c in found.ranking],
        "seconds": seconds,
    }


def _finding(finding: Finding, mark: str) -> Row:
    score = finding.score
    return {
        "effect": finding.effect,
        "tied": list(finding.tied),
        "kind": finding.kind.value,
        "over": finding.shape.over.value if finding.shape else None,
        "mark": mark,
        "right": mark != WRONG,
        "confidence": finding.confidence,
        "state": finding.state.value,
        "explains": finding.explains,
        "together": list(finding.together),
        "part": score.part,
        "t": score.t,
        "control": score.control,
        "training": asdict(score.training),
        "other": asdict(score.other),
        "left": finding.left,
        "left_fitted": finding.left_fitted,
    }


def _candidate(candidate: Candidate) -> Row:
    """An absent effect beside the base; promise: of its linear step, where that is all."""
    gain, score = candidate.gain, candidate.score
    return {
        "effect": candidate.effect.name,
        "refused": candidate.refused and refusal_in_words(candidate.refused),
        "promise": None if score else 1.0 - (gain.after / gain.before) ** 2,
        "part": score.part if score else None,
        "t": score.t if score else None,
        "control": score.control if score else None,
    }


def stated_wrong(rows: Iterable[Row]) -> list[str]:
    """Wrong names that are stated at STATED or more, by case."""
    return [
        f"{r['case']}: {f['effect']}"
        for r in rows
        for f in r["findings"]
        if f["mark"] == WRONG and (f["confidence"] or 0.0) >= STATED
    ]


def in_line(row: Row) -> str:
    """A row of a table in Markdown."""
    told = "<br>".join(map(_finding_cell, row["findings"])) or "-"
    errors = "<br>".join(
        f"{role} {before:.3g} > {after:.3g}"
        for role, (before, after) in row["errors"].items()
        if before is not None
    )
    asked = ", ".join((*row["expected"]["right"], *row["expected"]["shapes"])) or "nothing"
    return (
        f"| {row['case']} | {asked} | {row['mark']} | {row['verdict']} | {told} "
        f"| {errors} {row['unit']} | {row['ratio']:.2f} > {row['left']:.2f} "
        f"| {row['seconds']:.0f} |"
    )


def _finding_cell(f: Row) -> str:
    names = "/".join((f["effect"], *f["tied"]))
    over = f" over {f['over']}" if f["over"] else ""
    stated = "-" if f["confidence"] is None else f"{f['confidence']:.0%}"
    return (
        f"{f['mark']}: {f['kind']} {names}{over}, part {f['part']:.2f} t {f['t']:.1f} "
        f"control {f['control']:.2f}, {stated}"
    )


def judged(
    jobs: Mapping[str, Callable[[], Row]], out: Path | None, workers: int | None = None
) -> list[Row]:
    """The rows of the cases, in their order; those that fail are told and left out.

    They run on so many processes, one a core where None, and each is told as it is done. out: file
    for the rows as JSON, a line each.
    """
    rows: dict[str, Row] = {}
    print(HEAD, flush=True)
    with engine(workers=workers) as (executor, count):
        for case, row in outcomes(executor, count, _row, jobs.items()):
            if isinstance(row, str):
                print(f"| {case} | FAILED: {row} |", flush=True)
                continue
            rows[case] = row
            print(in_line(row), flush=True)
            if out:
                lines = (json.dumps(rows[c]) + "\n" for c in jobs if c in rows)
                out.write_text("".join(lines), encoding="utf-8")
    return [rows[case] for case in jobs if case in rows]


def _row(job: tuple[str, Callable[[], Row]]) -> tuple[str, Row | str]:
    """The row of a case, or why there is none: the other machines are to be judged all the same."""
    case, make = job
    try:
        return case, make()
    except Exception as error:
        return case, f"{type(error).__name__}: {error}"
