"""Sentences about findings: what each explains, the shape of its law, and what is left."""

from __future__ import annotations

import numpy as np

from identify.dataset.dataset import Role
from identify.estimation.found_shape import FoundShape, FreeExponent
from identify.output.numbers import DisplayUnit, each_with_unit, number, percent, quantity
from identify.rules import RULE
from identify.selection.diagnosis import AxisDiagnosis
from identify.selection.findings import Confirmation, Finding, FindingKind
from identify.selection.roles import RoleDependent
from twin.model.units import units_of


def finding_in_words(finding: Finding) -> tuple[str, ...]:
    """Sentences, e.g. "cogging explains 93 % of the squared error above the noise floor: ..."."""
    words = units_of(finding.unit).words
    removes, control = (percent(max(p, 0.0)) for p in (finding.score.part, finding.score.control))
    said = [
        _explained(finding),
        f"It removes {removes} of what the other effects leave above the noise floor, on the logs "
        "that chose it; the same force shifted in time, which cannot be real, removes at most "
        f"{control} (19 of 20 times)",
    ]
    if finding.kind is not FindingKind.WRONG_SHAPE and finding.parameters:
        units, known = finding.parameter_units, finding.parameters.items()
        values = ", ".join(f"{n} = {quantity(v, units.get(n, '1'))}" for n, v in known)
        law = f", in {' '.join(finding.equation.split())}" if finding.equation else ""
        said.append(f"Found: {values}{law}")
    if finding.confidence is None:
        said.append("No confidence is stated, as the test logs contradict it")
    else:
        right = f"{percent(finding.confidence)} of answers as well supported as this were right"
        said.append(f"{right}, on machines whose missing effect is known")
    return tuple(words(text) for text in said)


def _explained(finding: Finding) -> str:
    tested = finding.tested
    error = "test error" if tested.on is Role.TEST else f"error on the {tested.on.value} logs"
    before, after = each_with_unit(tested.before, tested.after, finding.unit)
    what, without, with_it = finding.effect, "without it", "with it"
    if finding.kind is FindingKind.RESEMBLES:
        shape = "in another shape; that law"
        if finding.bend:
            shape = "with {} in place of {}; that law".format(*_exponents_in_words(finding.bend))
        what = f"what is missing resembles {finding.effect}, {shape}"
        if finding.imitated and not finding.shape:
            here = f"as {finding.effect} is here; that law"
            what = f"what is missing is {finding.imitated.value}, {here}"
    if finding.kind is FindingKind.WRONG_SHAPE:
        what = f"{finding.effect} has another shape: a free curve beside its law"
        without, with_it = "with the law", "with the curve"
        if finding.bend:
            with_it, without = (f"with {value}" for value in _exponents_in_words(finding.bend))
            what = f"{finding.effect} has another shape, which its law {with_it} has: that"
    if finding.kind is FindingKind.WRONG_VALUE and finding.bend:
        logs, file = _exponents_in_words(finding.bend)
        what = f"of {finding.effect} the file says {file}, the logs {logs}: that"
        with_it, without = "with the value of the logs", "with that of the file"
    how = {
        Confirmation.CONTRADICTED: "is contradicted by the test logs",
        Confirmation.WITHIN_NOISE: "is not contradicted by the test logs, whose error is noise",
        Confirmation.UNTESTED: "is not tested by the test logs, whose error hardly changes",
    }.get(finding.state)
    if how is None or tested.on is not Role.TEST:
        share = percent(finding.explains)
        how = f"explains {share} of the squared error above the noise floor"
    return f"{what} {how}: {without} the {error} is {before}, {with_it} {after}"


def _exponents_in_words(bend: FreeExponent) -> list[str]:
    """What bends a law as it was found, and as it was held, e.g. "n = 3"."""
    values = (f"{value:.3g} {bend.unit.removesuffix('1')}" for value in (bend.found, bend.held))
    return [f"{bend.parameter} = {value.strip()}" for value in values]


def all_in_words(found: AxisDiagnosis) -> list[str]:
    """Of several findings: what they explain together, and which need each other."""
    if len(found.findings) < 2:
        return []
    said = (
        f"together they explain {percent(found.explained)} of the squared error above the noise "
        "floor; each share above is lost when that effect alone is taken out and the others are "
        "refitted"
    )
    return [said, *pairs_in_words(found)]


def pairs_in_words(found: AxisDiagnosis) -> list[str]:
    """Of named effects that need each other, that they do."""
    names = [f.effect for f in found.findings]
    return [
        f"{first} and {second} are needed together, so the logs prove neither alone: the model "
        "that --model writes has both"
        for i, first in enumerate(names)
        for second in found.findings[i].together
        if second in names[i + 1 :]
    ]


def shape_in_words(effect: str, shape: FoundShape) -> str:
    """Where a law surely differs most from the curve found, and what that does at standstill."""
    words = units_of(shape.unit).words
    sure = {name: np.abs(c.found - c.assumed) - c.band_90 for name, c in shape.curves.items()}
    direction = max(sure, key=lambda name: np.nanmax(sure[name]))
    if not shape.differs:
        return words(
            f"At no single {shape.over.value} does the curve for {effect} differ from its law by "
            "more than its 90 % band."
        )
    curve, at = shape.curves[direction], int(np.nanargmax(sure[direction]))
    values = [float(v[at]) for v in (curve.assumed, curve.found, curve.band_90)]
    scale = DisplayUnit.of(shape.unit, values)
    assumed, found, band = (number(v / scale.size) for v in values)
    place = quantity(float(shape.coordinate[at]), shape.coordinate_unit)
    within = "" if shape.period is None else " of its period"
    rest = " The force is gone at standstill." if shape.lets_go_at_standstill else ""
    return words(
        f"The law of {effect} is off most at {shape.over.value} {place}{within}, {direction}: it "
        f"assumes {assumed}, the logs show {found} ± {band} {scale.unit}.{rest}"
    )


def left_in_words(found: AxisDiagnosis, floor: float) -> list[str]:
    """How much is left beside what was found, and whether something else is missing too.

    floor: of the training logs, N RMS.
    """
    if not found.findings:
        return []
    one = found.findings[0]  # noise is part of what is left, and so never more
    chosen, fitted = max(one.left, 1.0), max(found.final.error / floor, 1.0)
    own = quantity(floor, one.unit)
    said = f"What is left is {fitted:.2f} times the noise floor of {own} on the training logs"
    if one.chosen.on is not Role.TRAINING:
        other = quantity(one.chosen.after / one.left, one.unit)
        said += f" and {chosen:.2f} times that of {other} on the {one.chosen.on.value} logs"
    what = "something else is missing too"
    if max(chosen, fitted) < RULE.at_floor:
        what = "noise"
    elif found.dataset.force_noise:
        what = "nothing that was measured predicts it, and its origin is not known"
    return [f"{said}: {what}."]


def role_in_words(law: RoleDependent) -> str:
    """That a law is proved or not by which log chooses."""
    chance = f" ({percent(law.control)} by chance)" if law.control >= law.part > 0.0 else ""
    other = f"it takes {percent(max(law.part, 0.0))} of what is left{chance}, t = {law.t:.1f}"
    proved = "with other logs choosing it is"
    says = (
        f"{proved} not surely proved: {other}"
        if law.named
        else f"as they are not ({other}), {proved}"
    )
    return f"whether {law.effect} is proved depends on which log chooses: {says}"
