"""Sentences about what a diagnosis found, and what to do about it."""

from __future__ import annotations

import json
from collections.abc import Sequence

import numpy as np

from identify.dataset.dataset import Role
from identify.output.numbers import (
    Scale,
    number,
    percent,
    quantity,
)
from identify.rules import RULE
from identify.selection.diagnosis import AxisDiagnosis
from identify.selection.findings import Finding, FindingKind
from identify.selection.found_shape import FoundShape
from identify.selection.free_exponent import FreeExponent
from twin.effects import load_catalogue
from twin.model.units import units_of


def finding_in_words(finding: Finding) -> tuple[str, ...]:
    """Sentences, e.g. "cogging explains 93 % of the squared error above the noise floor: ..."."""
    words = units_of(finding.unit).words
    removes, control = (percent(max(p, 0.0)) for p in (finding.score.part, finding.score.control))
    said = [
        _explained(finding),
        f"On the logs that decided it removes {removes} of what is left above the noise floor",
        f"The same force shifted in time, which cannot be real, removes at most {control} (19 of "
        "20 times)",
    ]
    if finding.kind is not FindingKind.WRONG_SHAPE and finding.parameters:
        units, known = finding.parameter_units, finding.parameters.items()
        values = ", ".join(f"{n} = {quantity(v, units.get(n, '1'))}" for n, v in known)
        said.append(f"Found: {values}")
    return tuple(words(text) for text in (*said, _sure(finding)))


def _explained(finding: Finding) -> str:
    tested = finding.tested
    error = "test error" if tested.on is Role.TEST else f"error on the {tested.on.value} logs"
    before, after = (quantity(e, finding.unit) for e in (tested.before, tested.after))
    what, without, with_it = finding.effect, "without it", "with it"
    if finding.kind is FindingKind.RESEMBLES:
        shape = "in another shape; that law"
        if finding.bend:
            shape = "with {} in place of {}; that law".format(*_exponents_in_words(finding.bend))
        what = f"what is missing resembles {finding.effect}, {shape}"
    if finding.kind is FindingKind.WRONG_SHAPE:
        what = f"{finding.effect} has another shape: a free curve beside its law"
        without, with_it = "with the law", "with the curve"
        if finding.bend:
            with_it, without = (f"with {value}" for value in _exponents_in_words(finding.bend))
            what = f"{finding.effect} has another shape, which its law {with_it} has: that"
    errors = f"{without} the {error} is {before}, {with_it} {after}"
    if finding.contradicted:
        return f"{what} is not confirmed by the test logs: {errors}"
    return (
        f"{what} explains {percent(finding.explains)} of the squared error above the noise "
        f"floor: {errors}"
    )


def _exponents_in_words(bend: FreeExponent) -> list[str]:
    """What bends a law as it was found, and as it was held, e.g. "n = 3"."""
    values = (f"{value:.3g} {bend.unit.removesuffix('1')}" for value in (bend.found, bend.held))
    return [f"{bend.parameter} = {value.strip()}" for value in values]


def _sure(finding: Finding) -> str:
    """How often such an answer was right, and how much is left; none where tests contradict."""
    if finding.confidence is None:
        return "No confidence is stated, as the test logs do not confirm it"
    # Noise is part of what is left, and so never more.
    left, fitted = max(finding.left, 1.0), max(finding.left_fitted, 1.0)
    sure = (
        f"{percent(finding.confidence)} of such answers were right in the self-test. What is left "
        f"is {left:.2f} times the noise floor on the {finding.chosen.on.value} logs"
    )
    if finding.chosen.on is not Role.TRAINING:
        sure += f", {fitted:.2f} times on the training logs"
    more = max(left, fitted) >= RULE.at_floor
    return sure + (", so something else is missing too" if more else "")


SHARES = (
    "each share is of that effect taken out alone, the others refitted, so the shares need not sum "
    "to 100 %"
)


def together_in_words(found: AxisDiagnosis) -> list[str]:
    """Of named effects that need each other: that they do, and how both are added."""
    names = [f.effect for f in found.findings]
    above = found.tested.before**2 - found.base.floor**2
    take = ""
    if len(names) == 2 and above > 0.0:
        taken = min((found.tested.before**2 - found.tested.after**2) / above, 1.0)
        take = (
            f"; together they explain {percent(taken)} of the squared error above the noise floor"
        )
    return [
        f"{first} and {second} are needed together, so the logs prove neither alone{take}: "
        f"twin add {first} MODEL LOG... -o first.toml, then twin add {second} first.toml LOG... "
        "-o both.toml; judge after the second (the first ends with exit code 1)"
        for i, first in enumerate(names)
        for second in found.findings[i].together
        if second in names[i + 1 :]
    ]


def shape_in_words(effect: str, shape: FoundShape) -> str:
    """Where a law surely differs most from the curve found, and what that does at standstill."""
    words = units_of(shape.force_unit).words
    sure = {name: np.abs(c.found - c.assumed) - c.band for name, c in shape.curves.items()}
    direction = max(sure, key=lambda name: np.nanmax(sure[name]))
    if not shape.differs:
        return words(
            f"At no single {shape.over.value} does the curve for {effect} differ from its law by "
            "more than its 90 % band."
        )
    curve, at = shape.curves[direction], int(np.nanargmax(sure[direction]))
    values = [float(v[at]) for v in (curve.assumed, curve.found, curve.band)]
    scale = Scale.of(shape.force_unit, values)
    assumed, found, band = (number(v / scale.size) for v in values)
    place = quantity(float(shape.coordinate[at]), shape.unit)
    within = "" if shape.period is None else " of its period"
    rest = " The force is gone at standstill." if shape.lets_go else ""
    return words(
        f"The law of {effect} is off most at {shape.over.value} {place}{within}, {direction}: it "
        f"assumes {assumed}, the logs show {found} ± {band} {scale.unit}.{rest}"
    )


def remainder_in_words(found: AxisDiagnosis) -> str | None:
    """How large the error is that remains beside what was named, or None where it is noise."""
    if not found.findings or found.unexplained is None:
        return None
    fit = found.with_named
    beside = " beside the named effects" if found.named else ""
    return (
        f"what remains{beside} is {quantity(fit.error, fit.axis.units.force)} on the training "
        f"logs, {fit.ratio:.1f} times the noise floor"
    )


# --- what to do next --------------------------------------------------------------------------


def advice(findings: Sequence[Finding] = ()) -> str:
    """What lowers the error where no physical effect explains it, or a law has the wrong shape."""
    catalogue = load_catalogue()
    for f in findings:
        resembles = f.kind is FindingKind.RESEMBLES
        if f.bend is not None:
            held = [p.name for p in catalogue[f.effect].parameters if p.fixed]
            fixed = json.dumps([name for name in held if name != f.bend.parameter])
            first = f"after `twin add {f.effect}`, " if resembles else ""
            return (
                f"{first}fixed = {fixed} for {f.effect} in the model file lets `twin fit` find its "
                f"{f.bend.parameter}, which gives the model the shape that the logs show"
            )
        if f.shape is not None:
            first = f"twin add {f.effect}, then " if resembles else ""
            shaped = f"{first}twin add --shape {f.effect}"
            return f"{shaped} gives the model the shape that the logs show"
    known = [e.name for e in catalogue.values() if e.is_nonparametric and not e.free_shape]
    return f"twin add {' or '.join(known)} lowers the error by fitted curves, without explaining it"


def next_command(found: AxisDiagnosis) -> list[str]:
    """The command that adds what is named first, where that stands by itself and is confirmed."""
    first = found.missing[0] if found.missing else None
    if first is None or first.together or first.tied or first.contradicted:
        return []
    return [f"next: twin add {found.named[0]} MODEL LOG... -o better.toml"]
