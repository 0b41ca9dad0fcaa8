"""Sentences about a body of a mechanism whose inertia is not that of its file."""

from __future__ import annotations

from identify.links import INERTIAL, WrongBody
from identify.output.numbers import arrow, listed, percent, with_band
from identify.results.results import Diagnosis


def body_in_words(result: Diagnosis) -> list[str]:
    """What is said of the body; nothing where there is none."""
    found = result.body
    if found is None:
        return []
    file, name = result.model.mjcf_name, " or ".join((found.body, *found.level))
    score = found.score
    said = [
        f"The inertia of body {name} is not as {file} has it (confidence "
        f"{percent(found.confidence)}): it removes {percent(score.part)} of what all joints leave "
        "above their noise floors; the same torques shifted in time, which cannot be real, at most "
        f"{percent(score.control)} (19 of 20 times).",
        f"More than in the file, about its own frame: {_parameters(found)}.",
    ]
    if found.untold:
        said.append(f"These joints do not tell its {listed(found.untold)}.")
    errors = [
        f"{axis} {arrow(e.before, e.after, result.model.axes[axis].units.force)}"
        for axis, e in found.errors.items()
        if axis in found.axes
    ]
    on = found.errors[found.axes[0]].on.value
    said.append(f"Error on the {on} logs without and with it: {', '.join(errors)}.")
    said.append(f"Next: change the body in {file}{_element(found)}, then fit again.")
    return said


def _element(found: WrongBody) -> str:
    """E.g. ": <inertial mass=... />"; nothing where no body can have what was found."""
    if found.element is None:
        return ""
    mass, centre, inertia = found.element
    full = [*inertia.diagonal(), *inertia[[0, 0, 1], [1, 2, 2]]]
    pos, fullinertia = (" ".join(f"{v:.5g}" for v in values) for values in (centre, full))
    return f': <inertial mass="{mass:.5g}" pos="{pos}" fullinertia="{fullinertia}"/>'


def _parameters(found: WrongBody) -> str:
    return ", ".join(
        f"{name} {with_band(value, band, INERTIAL[name])}"
        for name, (value, band) in found.told.items()
    )
