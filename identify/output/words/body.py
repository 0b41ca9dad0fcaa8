"""Sentences about a body of a mechanism whose inertia is not that of its file."""

from __future__ import annotations

from identify.links import INERTIAL, LINK_MASS, WrongBody
from identify.output.numbers import arrow, listed, percent, with_band
from identify.output.words.commands import UNKNOWN, Source, names_of
from identify.results.addition import CorrectedBody
from identify.results.results import Diagnosis
from twin.model.machine import MachineModel
from twin.mujoco.written import inertial


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
