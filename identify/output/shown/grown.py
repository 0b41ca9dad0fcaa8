"""What is shown of a model with one effect more or less, or with another body."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from identify.output.blocks import Block, Sentence, blocks_of, sentences
from identify.output.numbers import DisplayUnit, arrow, listed
from identify.output.words.next_step import errors_of_step, wrong_body_in_words
from identify.output.words.refusal import refusal_in_words
from identify.results.grown import Addition, AllAdded, CorrectedBody, Removal
from twin.model.machine import HistoryStep


@blocks_of.register
def addition_blocks(result: Addition) -> list[Block]:
    """The errors before and after adding the effect."""
    step, words = result.step, result.units.words
    first = f"added {step.effect} to axis {step.axis}"
    if result.reshaped:
        first = f"gave {step.effect} of axis {step.axis} the shape that the logs show"
    below = [*_errors_of(step, words)]
    if result.position_error is not None and result.position_error_in_mujoco is not None:
        unit = result.units.position
        scale = DisplayUnit.of(unit, result.position_error)
        below.append(
            f"{words('free-running position error'):33s} {arrow(*result.position_error, unit)} "
            f"on {result.position_error_on} (MuJoCo: {scale.text(result.position_error_in_mujoco)})"
        )
    below += result.notes
    if (refused := result.candidate.refused) is not None:
        below.append(
            f"The logs do not prove it: {refusal_in_words(refused)}. The model has it "
            "nevertheless, as asked for; go on with the model before, or, if a diagnosis says that "
            "it needs another beside it, add that to the new model and judge then."
        )
    return [Sentence.over(first, below)]


@blocks_of.register
def all_added_blocks(result: AllAdded) -> list[Block]:
    """What was added to each axis, and the errors before and after all of it."""
    blocks: list[Block] = []
    axes = [*dict.fromkeys(step.axis for step in result.steps)]
    for axis in axes:
        steps = [step for step in result.steps if step.axis == axis]
        laws = [step.effect for step in steps if step.action != "body"]
        bodies = [step.effect for step in steps if step.action == "body"]
        said = [f"added {listed(laws)} to axis {axis}"] if laws else []
        if bodies:
            said.append(f"corrected body {listed(bodies)}, which moves with axis {axis}")
        below = [*_errors_of(steps[0], result.model.axes[axis].units.words)]
        if not result.kept and axis == axes[-1]:
            below.append(
                "These logs do not prove all of it: go on with the model before, or diagnose it "
                "with them."
            )
        blocks += [*sentences(said[:-1]), Sentence.over(said[-1], below)]
    return blocks


@blocks_of.register
def removal_blocks(result: Removal) -> list[Block]:
    """What was taken out, the errors with it and without, and whether the logs ask for it."""
    step = result.step
    asked = "ask for it: go on with the model before" if result.needed else "do not ask for it"
    errors = _errors_of(step, result.model.axes[step.axis].units.words)
    below = (*errors, f"The logs {asked}.")
    return [Sentence.over(f"took {step.effect} off axis {step.axis}", below)]


def _errors_of(step: HistoryStep, words: Callable[[str], str]) -> Iterator[str]:
    """The errors before and after a step on the logs of each role, a line each."""
    for role, (before, after) in errors_of_step(step).items():
        what = words(f"force error on the {role.value} logs")
        yield f"{what:33s} {arrow(before, after, step.unit)}"


@blocks_of.register
def corrected_blocks(result: CorrectedBody) -> list[Block]:
    """What was written into the MuJoCo file, and the errors before and after."""
    file, given = result.model.mjcf_name, result.given.mjcf_name
    return [
        Sentence.over(
            f"Body {body.body} of {file} has {body.written}; {given} is as it was.",
            wrong_body_in_words(body, result.given),
        )
        for body in result.bodies
    ]
