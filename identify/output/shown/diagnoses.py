"""What is shown of a diagnosis in short, and of the experiment that it asks for."""

from __future__ import annotations

from collections.abc import Iterator

from identify.dataset.dataset import Role
from identify.experiment_design.plan import Plan
from identify.output.blocks import Block, Sentence, blocks_of, sentences
from identify.output.candidates import line_of, row_of
from identify.output.numbers import arrow, listed, quantity
from identify.output.words.diagnosis import said_of, tested_on
from identify.output.words.fit import over_floor
from identify.output.words.next_step import (
    UNKNOWN,
    Source,
    all_not_run_in_words,
    body_in_words,
    disputed_in_words,
    experiment_in_words,
    gap_in_words,
    in_order,
    model_in_words,
    names_of,
    next_step_in_words,
    question_in_words,
    supposed_in_words,
)
from identify.output.words.recording import read_otherwise_in_words
from identify.output.words.verdict import all_found, named_in_words, other_values
from identify.results.results import Diagnosis
from identify.selection.diagnosis import AxisDiagnosis
from twin.experiments.file import in_short

SHOWN = 4  # candidates of a diagnosis, and experiments of a plan, that are printed


@blocks_of.register
def diagnosis_blocks(result: Diagnosis, source: Source = UNKNOWN) -> list[Block]:
    """The answer for each axis, its best candidates, and what else is said.

    source: what stands for MODEL in the next command.
    """
    first = (*read_otherwise_in_words(result.recording), *disputed_in_words(result.disputed))
    blocks = sentences(first)
    if body := body_in_words(result, source):
        blocks.append(Sentence.over(body[0], body[1:]))
    blocks += (_of_axis(result, axis, source) for axis in result.axes)
    last = [f"{source.written}: {model_in_words(result)}"] if source.written else []
    still = (axis for axis in result.fitted.axes if axis not in result.axes)
    last += [f"axis {axis}: not diagnosed, as it moves in no log" for axis in still]
    return blocks + sentences(last)


def _of_axis(result: Diagnosis, axis: str, source: Source) -> Sentence:
    """The answer for an axis over all that is said of it."""
    d, said = result.axes[axis], said_of(result, axis)
    units, tested, plan = d.base.axis.units, d.tested, result.next_experiments.get(axis)
    named = f" Missing: {missing}." if (missing := named_in_words(d)) else ""
    named += f" Of another value: {listed(others)}." if (others := other_values(d)) else ""
    fits = [d.base.error] if d.final is d.base else [d.base.error, d.final.error]
    floor = over_floor(units.force, result.summaries[axis].floor, *fits)
    errors = [f"{_errors(d, Role.TRAINING, fits[0], fits[-1])}, {floor}"]
    if tested.on is not Role.TRAINING:
        errors.append(_errors(d, tested.on, tested.before, tested.after))
    below = (
        *(f"{units.words('force error')} {error}" for error in errors),
        *(Sentence.over(finding, others) for finding, *others in said.findings),
        *(*said.beside, *said.shapes, *said.left, *said.advice),
        *([next_step_in_words(plan)] if plan else ()),
        *(f"next: {text}" for text in source.still_to_do(said.commands, names_of(d.dataset))),
        *_candidates(d),
        *said.steps,
        *(f"note: {note}" for note in said.notes),
    )
    return Sentence.over(f"axis {axis}: {said.verdict}{named}", below)


def _errors(found: AxisDiagnosis, on: Role, before: float, after: float) -> str:
    """Errors on the logs of a role without and with what was found."""
    unit = found.base.axis.units.force
    errors = quantity(before, unit)
    if found.final is not found.base:
        errors = f"{arrow(before, after, unit)} with {all_found(found)}"
    return f"on the {on.value} logs {errors}"


def _candidates(found: AxisDiagnosis) -> Iterator[str]:
    """The best candidates, a line each."""
    shown = found.ranking[:SHOWN]
    if any(c.score for c in shown):
        yield f"candidates with their evidence (difference of BIC) and the {tested_on(found)}"
    yield from (line_of(row_of(c, found)) for c in shown)


@blocks_of.register
def plan_blocks(result: Plan) -> list[Block]:
    """The question, the chosen experiment and what it is expected to show, and the next best."""
    favoured, chosen = result.favoured_by_the_logs, result.chosen
    lines = (
        in_short(chosen.experiment, chosen.units),
        gap_in_words(result.gap),
        *(f"{name} is excited by {motion}" for name, motion in result.excited_by.items()),
        favoured and f"the existing logs already favour {favoured}",
        supposed_in_words(result),
        *(experiment_in_words(t, result) for t in in_order(result)[:SHOWN]),
        *(f"not run: {why}" for why in all_not_run_in_words(result.not_run)),
    )
    first = f"axis {result.axis}: {question_in_words(result)}"
    return [Sentence.over(first, (line for line in lines if line))]
