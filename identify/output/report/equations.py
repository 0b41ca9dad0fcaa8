"""The law of each named effect: its equation, its source, its fingerprint in the residual."""

from __future__ import annotations

from identify.output.report.blocks import Block, Facts, Heading, Section
from identify.output.report.ranking import values_of
from identify.output.report.subject import Subject
from identify.output.report.units import title_case


def section(subject: Subject) -> Section | None:
    """The named effect of each axis, and those that the data cannot separate from it."""
    blocks: list[Block] = []
    for axis in subject.axes:
        found = subject.diagnosed(axis.axis)
        if found is None or found.best is None:
            continue
        names = {found.best.effect.name, *found.ambiguous_with}
        for candidate in (c for c in found.ranking if c.effect.name in names):
            effect = candidate.effect
            blocks.append(Heading(f"{title_case(effect.name)} on {axis.axis}"))
            pairs = (
                ("What it is", effect.summary),
                ("Fingerprint", effect.fingerprint),
                ("Excited by", effect.excited_by),
                ("Fitted", values_of(candidate)),
                ("Source", effect.source),
            )
            blocks.append(Facts(effect.equation, pairs))
    return Section("equations", "The law of the named effect", blocks) if blocks else None
