"""Sentences about what is added to a model, or corrected in the file of its mechanism."""

from __future__ import annotations

from collections.abc import Sequence

from identify.dataset.dataset import Role
from identify.links import INERTIAL, LINK_MASS, WrongBody
from identify.output.numbers import arrow, listed, percent, with_band
from identify.output.words.fit import moved_in_words, nonparametric_in_words
from identify.output.words.plan import UNKNOWN, Source, names_of
from identify.results.results import Addition, CorrectedBody, Diagnosis
from twin.model.machine import HistoryStep, MachineModel
from twin.mujoco.written import inertial


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


# --- a body whose inertia is not that of its file -------------------------------------------------


def body_in_words(result: Diagnosis, source: Source = UNKNOWN) -> list[str]:
    """What is said of the body, and the next command; nothing where there is none."""
    found = result.body
    if found is None:
        return []
    said, file = wrong_body_in_words(found, result.model), result.model.mjcf_name
    if found.element is None:
        return [*said, f"Next: change the body in {file}, then fit again."]
    command = f"twin add {LINK_MASS} MODEL LOG... -o corrected.toml"
    filled = source.filled(command, names_of(next(iter(result.axes.values())).dataset))
    written = inertial(*found.element)
    return [*said, f"Next: {filled} writes {written} into the body, in a copy of {file}."]


def corrected_in_words(result: CorrectedBody) -> list[str]:
    """What was written, why, and what it did to the errors."""
    found, written, given = result.body, result.model.mjcf_name, result.given.mjcf_name
    said = f"Body {found.body} of {written} has {result.element}; {given} is as it was."
    return [said, *wrong_body_in_words(found, result.given)]


def wrong_body_in_words(found: WrongBody, model: MachineModel) -> list[str]:
    """That a body is not as its file has it, by how much, and the errors without and with it."""
    file, name = model.mjcf_name, " or ".join((found.body, *found.level))
    score = found.score
    more = (f"{part} {with_band(*told, INERTIAL[part])}" for part, told in found.told.items())
    said = [
        f"The inertia of body {name} is not as {file} has it (confidence "
        f"{percent(found.confidence)}): it removes {percent(score.part)} of what all joints leave "
        "above their noise floors; the same torques shifted in time, which cannot be real, at most "
        f"{percent(score.control)} (19 of 20 times).",
        f"More than in the file, about its own frame: {', '.join(more)}.",
    ]
    if found.untold:
        said.append(f"These joints do not tell its {listed(found.untold)}.")
    errors = [
        f"{axis} {arrow(e.before, e.after, model.axes[axis].units.force)}"
        for axis, e in found.errors.items()
        if axis in found.axes
    ]
    on = found.errors[found.axes[0]].on.value
    said.append(f"Error on the {on} logs without and with it: {', '.join(errors)}.")
    return said
