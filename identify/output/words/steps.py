"""Sentences about the way to an answer: the steps, and why a candidate is not the answer."""

from __future__ import annotations

from identify.output.words.selection import tested_on
from identify.selection.candidates import Candidate
from identify.selection.changes import Added, Change, Freed
from identify.selection.diagnosis import AxisDiagnosis


def change_in_words(change: Change) -> str:
    """E.g. "cogging", "quadratic_drag with free n", "a free curve for cogging"."""
    if isinstance(change, Added):
        return change.name
    if isinstance(change, Freed):
        return f"{change.name} with free {change.parameter}"
    return f"a free curve for {change.name}"


def step_lines(found: AxisDiagnosis) -> list[str]:
    """What each accepted change did to the error, and why it is not named where it is not."""
    lines = []
    for i, step in enumerate(found.steps):
        candidate, what = step.tried.candidate, change_in_words(step.change)
        if candidate.is_noise:
            lines.append(f"step {i + 1}: {what} explains the remaining error as noise")
            continue
        gain, unit = candidate.gain, candidate.fit.axis.units.force
        dropped = f"; no longer needed: {', '.join(step.dropped)}" if step.dropped else ""
        why = not_named_in_words(found, i)
        lines.append(
            f"step {i + 1}: with {what} the {tested_on(found)} error falls from {gain.before:.4g} "
            f"to {gain.after:.4g} {unit}{dropped}{f'; not named: {why}' if why else ''}"
        )
    return lines


def not_named_in_words(found: AxisDiagnosis, index: int) -> str | None:
    """Why the change of that step is not named at the end; None where it is."""
    name = found.steps[index].change.name
    if name in [f.effect for f in found.findings]:
        return None
    for step in found.steps[index:]:
        if name in step.dropped:
            return f"no longer needed beside {change_in_words(step.change)}"
    return "no longer needed beside what was found after it"


def partner(found: AxisDiagnosis, effect: str) -> str | None:
    """The named effect without which this named one is not proved."""
    return next((f.together[0] for f in found.findings if f.effect == effect and f.together), None)


def why_not(found: AxisDiagnosis, candidate: Candidate) -> str:
    """Why a candidate is not proved by itself; nothing where it is."""
    if candidate.supported:
        return ""
    other = partner(found, candidate.effect.name)
    return f"proved only together with {other}" if other else candidate.refused or ""
