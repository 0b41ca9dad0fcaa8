"""The law of each named effect: its equation, its source, its fingerprint in the residual."""

from __future__ import annotations

from identify.output.report.blocks import Block, Facts, Heading, Section
from identify.output.report.ranking import values_of
from identify.output.report.subject import Subject
from identify.output.report.units import title_case
from twin.effect import Effect
from twin.model.machine import AxisModel


def section(subject: Subject) -> Section | None:
    """The named effects of each axis, and those that the data cannot separate from them."""
    blocks: list[Block] = []
    for axis in subject.axes:
        if (found := subject.diagnosed(axis.axis)) is None:
            continue
        for name in found.named:
            model = found.final.axis if name in found.final.axis.names else None
            tried = {c.effect.name: c for c in found.ranking}
            if model is not None:
                blocks += _law(model[name].effect, model, axis.axis)
            for other in found.answers[found.named.index(name)][1:]:
                if other in tried:
                    blocks += _law(tried[other].effect, tried[other].fit.axis, axis.axis)
    return Section("equations", "The laws of the named effects", blocks) if blocks else None


def _law(effect: Effect, model: AxisModel, axis: str) -> list[Block]:
    """An effect and the values that a model has for it."""
    pairs = (
        ("What it is", effect.summary),
        ("Fingerprint", effect.fingerprint),
        ("Excited by", effect.excited_by),
        ("Fitted", values_of(effect, model)),
        ("Source", effect.source),
    )
    return [Heading(f"{title_case(effect.name)} on {axis}"), Facts(effect.equation, pairs)]
