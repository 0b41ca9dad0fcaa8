"""Findings in words: what each explains, the shape found, and what to do about it."""

from __future__ import annotations

import json
from collections.abc import Sequence

import numpy as np

from identify.dataset.given_logs import Role
from identify.output.words.numbers import PLAIN, Numbers, with_unit
from identify.selection.bends import Bend
from identify.selection.diagnosis import AxisDiagnosis
from identify.selection.findings import Finding, FindingKind
from identify.selection.found_shape import FoundShape
from twin.effects import load_catalogue

ERROR = {
    Role.TEST: "test error",
    Role.SELECTION: "error on the selection logs",
    Role.TRAINING: "error on the training logs",
}


def finding_in_words(finding: Finding, numbers: Numbers = PLAIN) -> tuple[str, ...]:
    """Sentences, e.g. "cogging explains 93 % of the squared error above the noise floor: ..."."""
    removed, values = _removed(finding), _values(finding, numbers)
    return (_explained(finding, numbers), *removed, *values, _sure(finding))


def _explained(finding: Finding, numbers: Numbers) -> str:
    unit = finding.unit
    error, tested = ERROR[finding.tested.on], finding.tested
    before, after = (numbers.amount(e, unit) for e in (tested.before, tested.after))
    what, without, with_it = finding.effect, "without it", "with it"
    if finding.kind is FindingKind.RESEMBLES:
        what = f"what is missing resembles {finding.effect}, {_in_which_shape(finding)}"
    if finding.kind is FindingKind.WRONG_SHAPE:
        what = f"{finding.effect} has another shape: a free curve beside its law"
        without, with_it = "with the law", "with the curve"
    if finding.bend and finding.kind is FindingKind.WRONG_SHAPE:
        with_it, without = (f"with {value}" for value in _bends_in_words(finding.bend))
        what = f"{finding.effect} has another shape, which its law {with_it} has: that"
    errors = f"{without} the {error} is {before}, {with_it} {after}"
    if finding.contradicted:
        return f"{what} is not confirmed by the test logs: {errors}"
    return (
        f"{what} explains {100.0 * finding.explains:.0f} % of the squared error above the noise "
        f"floor: {errors}"
    )


def _in_which_shape(finding: Finding) -> str:
    """What of a law it is that explains: itself, or it with what bends its curve."""
    if finding.bend is None:
        return "in another shape; that law"
    found, held = _bends_in_words(finding.bend)
    return f"with {found} in place of {held}; that law"


def _bends_in_words(bend: Bend) -> list[str]:
    """What bends a law as it was found, and as it was held, e.g. "n = 3"."""
    return [
        f"{bend.parameter} = {with_unit(f'{value:.3g}', bend.unit)}"
        for value in (bend.found, bend.held)
    ]


def _removed(finding: Finding) -> list[str]:
    """What it takes in the acceptance test, beside what its controls take."""
    part, control = (100.0 * max(p, 0.0) for p in (finding.score.part, finding.score.control))
    return [
        f"On the logs that decided it removes {part:.0f} % of what is left above the noise floor",
        "The same force shifted in time, which cannot be real, removes at most "
        f"{control:.0f} % (19 of 20 times)",
    ]


def _values(finding: Finding, numbers: Numbers) -> list[str]:
    """The values that a missing effect was found with."""
    if finding.kind is FindingKind.WRONG_SHAPE or not finding.parameters:
        return []
    known = finding.parameters.items()
    units = finding.parameter_units
    return [
        "Found: " + ", ".join(f"{n} = {numbers.amount(v, units.get(n, '1'))}" for n, v in known)
    ]


def _sure(finding: Finding) -> str:
    """How often such an answer was right, and of what kind it is; none where tests contradict."""
    if finding.confidence is None:
        return "No confidence is stated, as the test logs do not confirm it"
    sure = (
        f"{100.0 * finding.confidence:.0f} % of such answers were right on machines with a known "
        f"truth: {_over(finding.left)} times the noise floor is left on the "
        f"{finding.chosen.on.value} logs"
    )
    if finding.chosen.on is not Role.TRAINING:
        sure += f", {_over(finding.left_fitted)} times on the training logs"
    return sure


def _over(left: float) -> str:
    """Error over noise floor: noise is part of what is left, and so never more."""
    return f"{max(left, 1.0):.2f}"


def shares_in_words(found: AxisDiagnosis) -> list[str]:
    """That the shares of several findings are no parts of one whole; nothing of a single one."""
    if len(found.findings) < 2:
        return []
    return [
        "each share is of that effect taken out alone, the others refitted, so the shares need not "
        "sum to 100 %"
    ]


def together_in_words(found: AxisDiagnosis) -> list[str]:
    """Of named effects that need each other: that they do, and how both are added."""
    said = []
    for i, finding in enumerate(found.findings):
        for other in finding.together:
            if other in [f.effect for f in found.findings[i + 1 :]]:
                said.append(_pair_in_words(found, finding.effect, other))
    return said


def _pair_in_words(found: AxisDiagnosis, first: str, second: str) -> str:
    take = ""
    above = found.tested.before**2 - found.base.floor**2
    if len(found.findings) == 2 and above > 0.0:
        taken = min((found.tested.before**2 - found.tested.after**2) / above, 1.0)
        take = f"; together they take {100.0 * taken:.0f} % of the squared error above the floor"
    return (
        f"{first} and {second} are needed together, so the logs prove neither alone{take}: "
        f"twin add {first} MODEL LOG... -o first.toml, then twin add {second} first.toml LOG... "
        "-o both.toml; judge after the second (the first ends with exit code 1)"
    )


def also_seen_in_words(found: AxisDiagnosis) -> list[str]:
    """Effects that are real and too small to matter, in one line; nothing where there are none."""
    if not found.small:
        return []
    return [f"also seen, too small to matter: {', '.join(found.small)}"]


def shape_in_words(effect: str, shape: FoundShape, numbers: Numbers = PLAIN) -> str:
    """Where a law surely differs most from the curve found, and what that does at standstill."""
    sure = {name: np.abs(c.found - c.assumed) - c.band for name, c in shape.curves.items()}
    direction = max(sure, key=lambda name: np.nanmax(sure[name]))
    if not shape.differs:
        return (
            f"At no single {shape.over.value} does the curve for {effect} differ from its law by "
            "more than its 90 % band."
        )
    curve, at = shape.curves[direction], int(np.nanargmax(sure[direction]))
    unit, band = shape.force_unit, numbers.amount(float(curve.band[at]), shape.force_unit)
    assumed, found = numbers.change(float(curve.assumed[at]), float(curve.found[at]), unit)
    place = numbers.amount(float(shape.coordinate[at]), shape.unit)
    within = "" if shape.period is None else " of its period"
    rest = " The force is gone at standstill." if shape.lets_go else ""
    return (
        f"The law of {effect} is off most at {shape.over.value} {place}{within}, {direction}: it "
        f"assumes {assumed}, the logs show {found} ± {band}.{rest}"
    )


def _held_beside(effect: str, bend: Bend) -> str:
    """The parameters that stay held where what bends a law is free, as TOML."""
    held = (p.name for p in load_catalogue()[effect].parameters if p.fixed)
    return json.dumps([name for name in held if name != bend.parameter])


def advice(findings: Sequence[Finding] = ()) -> str:
    """What lowers the error where no physical effect explains it, or a law has the wrong shape."""
    for f in findings:
        if f.bend is not None:
            first = f"after `twin add {f.effect}`, " if f.kind is FindingKind.RESEMBLES else ""
            return (
                f"{first}fixed = {_held_beside(f.effect, f.bend)} for {f.effect} in the model file "
                f"lets `twin fit` find its {f.bend.parameter}, which gives the model the shape "
                "that the logs show"
            )
        if f.shape is not None:
            first = f"twin add {f.effect}, then " if f.kind is FindingKind.RESEMBLES else ""
            shaped = f"{first}twin add --shape {f.effect}"
            return f"{shaped} gives the model the shape that the logs show"
    every = load_catalogue().values()
    known = [e.name for e in every if e.is_nonparametric and not e.free_shape]
    return f"twin add {' or '.join(known)} lowers the error by fitted curves, without explaining it"


def next_command(found: AxisDiagnosis) -> list[str]:
    """The command that adds what is named first, where that stands by itself and is confirmed."""
    if not found.missing:
        return []
    first = found.missing[0]
    if first.together or first.tied or first.contradicted:
        return []
    return [f"next: twin add {found.named[0]} MODEL LOG... -o better.toml"]
