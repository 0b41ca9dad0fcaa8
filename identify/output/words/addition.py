"""Sentences about what is added to a model."""

from __future__ import annotations

from collections.abc import Sequence

from identify.dataset.dataset import Role
from identify.output.words.fit import moved_in_words, nonparametric_in_words
from identify.results.addition import Addition
from twin.model.machine import HistoryStep


def step_in_words(step: HistoryStep) -> str:
    """What was done to a model: "added cogging to axis x"."""
    if step.action == "shape":
        return f"gave {step.effect} of axis {step.axis} the shape that the logs show"
    return f"added {step.effect} to axis {step.axis}"


def errors_of_step(step: HistoryStep) -> dict[Role, tuple[float, float]]:
    """Errors before and after a step, on the logs of each role that there were."""
    pairs = {
        Role.TRAINING: (step.fit_error_before, step.fit_error_after),
        Role.SELECTION: (step.holdout_error_before, step.holdout_error_after),
        Role.TEST: (step.test_error_before, step.test_error_after),
    }
    return {
        role: (before, after)
        for role, (before, after) in pairs.items()
        if before is not None and after is not None
    }


def proved_in_words(made: Addition) -> str:
    """Whether the logs prove what was added."""
    if made.kept:
        return "The logs prove the effect."
    return (
        f"The logs do not prove it: {made.candidate.refused}. The model has it nevertheless, as "
        "asked for; go on with the model before, or, if a diagnosis says that it needs another "
        "beside it, add that to the new model and judge then."
    )


def axis_in_words(
    effect: str, axis: str, tried: Sequence[str], having: Sequence[str]
) -> str | None:
    """Why an effect was added to an axis that nobody named, or None where there is no other.

    tried: axes that it was tried on. having: axes that have it already.
    """
    if having:
        return f"axis {', '.join(having)} has {effect} already, so it went to axis {axis}"
    if len(tried) > 1:
        return f"of axes {', '.join(tried)}, axis {axis} has the most evidence for it"
    return None


def notes_in_words(made: Addition) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """What a reader should know of an added effect, one sentence each: for the model, and all."""
    added, reshaped, set_aside = made.candidate, made.reshaped, made.set_aside
    notes = [moved_in_words(m) for m in made.moved]
    if added.effect.is_nonparametric:
        notes.insert(0, nonparametric_in_words(added.fit.axis[added.effect.name]))
    if reshaped:
        beside = reshaped in added.fit.axis.names
        where = "beside" if beside else "in the place of"
        both = "; the force is that of both, so do not read the law's values alone"
        notes.insert(0, f"{added.effect.name} is {where} the law of {reshaped}{both * beside}")
    elif set_aside:
        notes.append(
            f"{', '.join(set_aside)} was removed before {added.effect.name} was added; add it "
            "again for the error that is left"
        )
    chose = also_chose_in_words(made.told_on)
    return tuple(notes), tuple(notes) if chose is None else (*notes, chose)


def also_chose_in_words(on: Role) -> str | None:
    """That the logs whose errors are told decided as well; None of test logs."""
    if on is Role.TEST:
        return None
    return (
        f"the errors told are of the {on.value} logs and optimistic, because these logs helped to "
        "choose; give --test a log of another run, on which nothing is decided"
    )
