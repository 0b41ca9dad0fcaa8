"""Sentences about the way to an answer: what each step did, and why its effect is not named."""

from __future__ import annotations

from identify.estimation.decision import RULE
from identify.output.words.selection import tested_on
from identify.selection.diagnosis import AxisDiagnosis
from identify.selection.findings import FindingKind


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
