"""Sentences about the way to an answer: the steps, and which candidates are needed together."""

from __future__ import annotations

from identify.estimation.decision import RULE
from identify.output.words.selection import tested_on
from identify.selection.diagnosis import AxisDiagnosis
from identify.selection.findings import FindingKind
from identify.selection.scoring import Candidate


def step_lines(found: AxisDiagnosis) -> list[str]:
    """What each added effect did to the error, and why it is not named where it is not."""
    lines = []
    for i, step in enumerate(found.steps):
        effect, gain = step.candidate.effect.name, step.candidate.gain
        said = f"step {i + 1}: with {effect}{f' beside {step.beside}' if step.beside else ''}"
        if step.candidate.is_noise:
            lines.append(f"step {i + 1}: {effect} explains the remaining error as noise")
            continue
        unit = step.candidate.fit.axis.units.force
        dropped = f"; no longer needed: {', '.join(step.dropped)}" if step.dropped else ""
        why = not_named_in_words(found, i)
        lines.append(
            f"{said} the {tested_on(found)} error falls from {gain.before:.4g} to "
            f"{gain.after:.4g} {unit}{dropped}{f'; not named: {why}' if why else ''}"
        )
    return lines


def not_named_in_words(found: AxisDiagnosis, index: int) -> str | None:
    """Why the effect of that step is not named at the end; None where it is."""
    effect = found.steps[index].candidate.effect.name
    shapes = [f.effect for f in found.findings if f.kind is FindingKind.WRONG_SHAPE]
    if effect in found.named:
        replaced = found.findings and effect not in [f.effect for f in found.findings]
        return f"a free curve of {' or '.join(shapes)} takes its place" if replaced else None
    if effect in shapes:
        return "it is part of the other shape of that law"
    for later, step in enumerate(found.steps[index:], start=index):
        if effect in step.dropped:
            if found.curves or later == index:
                return "no longer needed beside what was found after it"
            return f"no longer needed beside {step.candidate.effect.name}"
    return (
        "not proved beside the others, or less than "
        f"{100.0 * RULE.least_finding:.0f} % of the squared error"
    )


def partner(found: AxisDiagnosis, effect: str) -> str | None:
    """The named effect without which this named one has no evidence."""
    beside = {s.candidate.effect.name: s.beside for s in found.steps}
    other = beside.get(effect)
    return other if other in found.named and effect in found.named else None


def support_in_words(found: AxisDiagnosis, candidate: Candidate) -> str:
    """Whether the data support a candidate alone, or together with another only."""
    if candidate.supported:
        return "supported"
    other = partner(found, candidate.effect.name)
    return f"only together with {other}" if other else "not supported"


def together_in_words(found: AxisDiagnosis) -> list[str]:
    """Of named effects that need each other: that they do, and how both are added."""
    said = []
    for i, first in enumerate(found.named):
        second = partner(found, first)
        if second in found.named[i + 1 :]:
            said.append(
                f"{first} and {second} are needed together, so the data support neither alone: "
                f"twin add {first} MODEL LOG... -o first.toml, then "
                f"twin add {second} first.toml LOG... -o both.toml; judge after the second "
                "(the first ends with exit code 1)"
            )
    return said
