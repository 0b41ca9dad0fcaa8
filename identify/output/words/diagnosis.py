"""Sentences about a diagnosis and its findings: ``said_of`` has all that is said of one axis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from identify.dataset.dataset import Role
from identify.estimation.fit import Outcome
from identify.estimation.found_shape import FoundShape, FreeExponent
from identify.estimation.offered import NotTried, RestsTooOften
from identify.output.numbers import (
    DisplayUnit,
    capitalised,
    change,
    each_with_unit,
    listed,
    number,
    percent,
    quantity,
    spaced,
)
from identify.output.words.fit import (
    OUTCOMES,
    dependence_in_words,
    moved_in_words,
    noise_in_words,
    prepared_in_words,
    refit_in_words,
    repeat_in_words,
    worst_in_words,
)
from identify.output.words.next_step import also_chose_in_words, fitted_curves, next_commands
from identify.results.results import AxisSummary, Diagnosis
from identify.rules import RULE
from identify.selection.candidates import Candidate
from identify.selection.changes import Added, Freed
from identify.selection.changes import Change as ModelChange
from identify.selection.diagnosis import AxisDiagnosis, Verdict
from identify.selection.findings import Confirmation, Finding, FindingKind
from identify.selection.roles import RoleDependent
from twin.model.machine import Hindrance
from twin.model.units import AxisUnits, units_of


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
    scale = DisplayUnit.of(shape.force_unit, values)
    assumed, found, band = (number(v / scale.size) for v in values)
    place = quantity(float(shape.coordinate[at]), shape.unit)
    within = "" if shape.period is None else " of its period"
    rest = " The force is gone at standstill." if shape.lets_go else ""
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


# --- what to do next --------------------------------------------------------------------------


def advice(findings: Sequence[Finding] = ()) -> str:
    """What lowers the error where no physical effect explains it, or a law has the wrong shape."""
    shaped = [f.effect for f in findings if f.shape is not None]
    if shaped:
        return f"the model that --model writes has {listed(shaped)} in the shape that the logs show"
    curves = " or ".join(fitted_curves())
    return f"twin add {curves} lowers the error by fitted curves, without explaining it"


# --- all about one axis ---------------------------------------------------------------------------


@dataclass(frozen=True)
class Said:
    """All sentences about the diagnosis of one axis.

    headline: the answer in a few words, with spaces in names. verdict: in a sentence. findings:
    several sentences each. beside: on all findings together. shapes: of laws. left: what remains
    and on what it depends. advice: where no law explains it. commands: what to run next, of MODEL
    and LOG... steps: the way to the answer. notes: what else to know.
    """

    headline: str
    verdict: str
    findings: tuple[tuple[str, ...], ...]
    beside: tuple[str, ...]
    shapes: tuple[str, ...]
    left: tuple[str, ...]
    advice: tuple[str, ...]
    commands: tuple[str, ...]
    steps: tuple[str, ...]
    notes: tuple[str, ...]


def role_in_words(law: RoleDependent) -> str:
    """That a law is proved or not by which log chooses."""
    other = f"it takes {percent(max(law.part, 0.0))} of what is left, t = {law.t:.1f}"
    proved = "with the training and the selection logs exchanged it is"
    says = f"{proved} not proved: {other}" if law.named else f"as they are not ({other}), {proved}"
    return f"whether {law.effect} is proved depends on which log chooses: {says}"


def said_of(result: Diagnosis, axis: str) -> Said:
    """The sentences about one axis of a diagnosis."""
    found, region = result.axes[axis], result.left_over.get(axis)
    words = found.base.axis.units.words
    left = left_in_words(found, result.summaries[axis].floor)
    if found.verdict is Verdict.NOTHING_MISSING:
        left += _beyond_in_words(result.summaries[axis], words("force error"))
    if found.unexplained:
        left.append(dependence_in_words(found.unexplained))
        left += [words(worst_in_words(region))] if region else []
    beside = all_in_words(found)
    if found.small:
        beside.append(f"also seen, too small to matter: {', '.join(found.small)}")
    beside += [role_in_words(law) for law in found.by_roles]
    corrected, verdict = "", words(verdict_in_words(found))
    if result.body and axis in result.body.axes:
        corrected = f"with body {result.body.body} as it was found, "
        verdict = capitalised(f"{corrected}{verdict[0].lower()}{verdict[1:]}")
    plan = result.next_experiments.get(axis)
    advised = found.unexplained or any(f.shape for f in found.findings)
    return Said(
        headline=f"{corrected}{headline_in_words(found)}",
        verdict=verdict,
        findings=tuple(finding_in_words(f) for f in (*found.findings, *found.contradicted)),
        beside=tuple(beside),
        shapes=tuple(shape_in_words(f.effect, f.shape) for f in found.findings if f.shape),
        left=tuple(left),
        advice=(advice(found.findings),) if advised else (),
        commands=() if corrected else tuple(next_commands(found, plan)),
        steps=tuple(step_lines(found)),
        notes=remarks_on(result, axis),
    )


# --- the answer -------------------------------------------------------------------------------

WORTH = 0.01  # of the squared test error, below which a finding is told behind the others
VERDICTS = {
    Verdict.NOTHING_MISSING: "Nothing is missing: the force error is at its noise floor.",
    Verdict.WRONG_SHAPE: (
        "The model has the effect, but its law has another shape than the force of the machine."
    ),
    Verdict.UNEXPLAINED: (
        "The error is above the noise floor, and no effect of the catalogue explains it."
    ),
}


def verdict_in_words(found: AxisDiagnosis) -> str:
    """The answer of a diagnosis, what the logs cannot separate, and what test logs contradict."""
    said = [VERDICTS.get(found.verdict) or _proved(found)]
    if found.verdict is Verdict.NOTHING_MISSING and not found.final.at_floor:
        said = [
            "The selection logs show nothing that is missing: there the force error is at its "
            f"noise floor. That of the training logs is {found.final.ratio:.1f} times theirs: "
            "noise of another size, or something that only they excite. Record a selection log "
            "like them."
        ]
    elif found.verdict is Verdict.NOTHING_MISSING and found.dataset.force_noise:
        times = found.final.error / found.final.noise.known
        said = [
            "Nothing that is missing shows. The force error is "
            f"{times:.1f} times what is known to make noise: nothing that was measured predicts "
            "what is left, and its origin is not known."
        ]
    if reshaped := _reshaped(found):
        said.append(f"The law of {listed(reshaped)} has another shape too.")
    said += [f"The logs cannot tell {ties}."] if (ties := _ties(found)) else []
    if against := [f.effect for f in found.contradicted]:
        ask = "The training logs ask" if not found.dataset.selection else "The logs that chose ask"
        more = " too" if found.findings else ""
        said.append(
            f"{ask} for {listed(against)}{more}, but the test logs contradict "
            f"{'them' if against[1:] else 'it'}: their error rises, so the model is without."
        )
    return " ".join(said)


def _proved(found: AxisDiagnosis) -> str:
    several = len(found.named) > 1
    lacks, them = ("several effects", "them") if several else ("an effect", "it")
    proof = f"the training logs prove {them}, block by block; there is no selection log"
    if found.dataset.selection:
        proof = f"the training logs and the selection logs prove {them}"
    if len(_other_values(found)) == len(found.named):
        values = "Values of the machine's file are" if several else "A value of the file is"
        return f"{values} not the machine's: {proof}."
    return f"The model lacks {lacks}: {proof}."


def _other_values(found: AxisDiagnosis) -> list[str]:
    """The effects of which the file of the machine states another value than the logs show."""
    return [f.effect for f in found.findings if f.kind is FindingKind.WRONG_VALUE]


def _reshaped(found: AxisDiagnosis) -> list[str]:
    """The effects whose law has another shape, beside those that are missing."""
    reshaped = [f.effect for f in found.findings if f.kind is FindingKind.WRONG_SHAPE]
    return reshaped if found.missing else []


def _ties(found: AxisDiagnosis) -> str:
    """E.g. "cogging from wear, or lugre from gms", each pair once."""
    ties = {f.effect: f.tied for f in found.findings}
    said: list[str] = []
    for name, alike in ties.items():
        if {*alike} - {other for other in said if name in ties[other]}:
            said.append(name)
    return ", or ".join(f"{name} from {' or '.join(tied_in_words(name, found))}" for name in said)


def tied_in_words(name: str, found: AxisDiagnosis) -> list[str]:
    """What the logs cannot tell from a finding; a law of the model is so by another shape."""
    tied = next(f.tied for f in found.findings if f.effect == name)
    given = found.base.axis.names
    return [f"another shape of {other}" if other in given else other for other in tied]


def headline_in_words(found: AxisDiagnosis) -> str:
    """E.g. "cogging or quadratic drag, and lugre are missing"."""
    match found.verdict:
        case Verdict.MISSING_EFFECTS:
            are = "are" if len(found.named) > 1 else "is"
            what = "missing"
            if len(_other_values(found)) == len(found.named):
                what = "not as the file says"
            answer = f"{named_in_words(found)} {are} {what}"
            if reshaped := _reshaped(found):
                answer += f", and {listed(reshaped)} has another shape"
        case Verdict.WRONG_SHAPE:
            answer = f"{found.findings[0].effect} has another shape"
        case Verdict.UNEXPLAINED:
            answer = "something outside the catalogue is missing"
        case Verdict.NOTHING_MISSING:
            answer = "nothing is missing"
    against = ", ".join(f.effect for f in found.contradicted)
    return spaced(f"{answer} (contradicted by the test logs: {against})" if against else answer)


def named_in_words(found: AxisDiagnosis) -> str:
    """Every effect that is named, e.g. "cogging or wear, and lugre"; empty where none is.

    What explains next to nothing beside the others is told as such.
    """
    large = [f for f in found.missing if f.explains >= WORTH] or found.missing
    said = _each_in_words(found, large)
    if small := [f for f in found.missing if f not in large]:
        said += f", and for less than {percent(WORTH)} of the squared error "
        said += _each_in_words(found, small)
    return said


def _each_in_words(found: AxisDiagnosis, some: Sequence[Finding]) -> str:
    """Some of the missing effects, each with those that explain as much."""
    each = [
        " or ".join((
            f"something like {f.effect}" if f.kind is FindingKind.RESEMBLES else f.effect,
            *tied_in_words(f.effect, found),
        ))
        for f in some
    ]  # fmt: skip
    return ", and ".join(each) if any(f.tied for f in some) or not each else listed(each)


def all_found(found: AxisDiagnosis) -> str:
    """A label for what was found: the effect where it is one; "" where nothing was."""
    if found.final is found.base:
        return ""
    if len(found.findings) != 1:
        return "all that was found"
    (only,) = found.findings
    reshaped = only.kind is FindingKind.WRONG_SHAPE
    return spaced(f"another shape of {only.effect}" if reshaped else only.effect)


def tested_on(found: AxisDiagnosis) -> str:
    """What the error is called by which a candidate was judged."""
    kind = "selection error" if found.dataset.selection else "cross-validated error"
    return f"{kind} of the beginnings, which were searched" if found.in_part else kind


# --- the way to the answer --------------------------------------------------------------------


def model_change_in_words(change: ModelChange) -> str:
    """E.g. "cogging", "quadratic_drag with free n", "a free curve for cogging"."""
    if isinstance(change, Added):
        return change.name
    if isinstance(change, Freed):
        return f"{change.name} with free {change.parameter}"
    return f"a free curve for {change.name}"


def step_lines(found: AxisDiagnosis) -> list[str]:
    """What each accepted change did to the error, and why it is not named where it is not.

    Nothing of a single one that is named: its line among the candidates says it.
    """
    if len(found.steps) == 1 and found.steps[0].tried.candidate is found.best:
        return []
    lines = []
    for i, step in enumerate(found.steps):
        candidate, what = step.tried.candidate, model_change_in_words(step.change)
        if candidate.is_noise:
            lines.append(f"step {i + 1}: {what} explains the remaining error as noise")
            continue
        gain, unit = candidate.gain, candidate.fit.axis.units.force
        dropped = f"; no longer needed: {', '.join(step.dropped)}" if step.dropped else ""
        why = not_named_in_words(found, i)
        before, after = change(gain.before, gain.after, unit)
        lines.append(
            f"step {i + 1}: with {what} the {tested_on(found)} falls from {before} to "
            f"{after}{dropped}{f'; not named: {why}' if why else ''}"
        )
    return lines


def not_named_in_words(found: AxisDiagnosis, index: int) -> str | None:
    """Why the change of that step is not named at the end; None where it is."""
    name = found.steps[index].change.name
    if name in [f.effect for f in found.findings]:
        return None
    if name in [f.effect for f in found.contradicted]:
        return "contradicted by the test logs"
    if leader := _level_with(name, found):
        return f"level with {leader}"
    if name in found.doubted:
        return f"at the end, {found.doubted[name]}"
    for step in found.steps[index:]:
        if name in step.dropped:
            return f"no longer needed beside {model_change_in_words(step.change)}"
    return "no longer needed beside what was found after it"


def _level_with(name: str, found: AxisDiagnosis) -> str | None:
    """The finding that an effect is as good as beside all else; None where there is none."""
    return next((f.effect for f in found.findings if name in f.tied), None)


def why_not(found: AxisDiagnosis, candidate: Candidate) -> str:
    """Why a candidate is not named, or not proved by itself; nothing where it is."""
    name = candidate.effect.name
    if candidate.supported:
        beside = found.named and not any(name in answer for answer in found.answers)
        return f"not needed beside {listed(found.named)}" if beside else ""
    pairs = (f.together[0] for f in found.findings if f.effect == name and f.together)
    if other := next(pairs, None):
        return f"proved only together with {other}"
    if leader := _level_with(name, found):
        return f"level with {leader} beside all that was found"
    return candidate.refused or ""


# --- notes beside the answer ------------------------------------------------------------------

NO_SELECTION_LOG = (
    "there is no selection log, so candidates were judged on blocks of the training logs that were "
    "left out of the fit, which is a weaker test. Give --holdout a log of another experiment"
)


def remarks_on(result: Diagnosis, axis: str) -> tuple[str, ...]:
    """Channel delays, fits that did not converge, changed parameters, weak proof of one axis."""
    found, summary = result.axes[axis], result.summaries[axis]
    refit, units = result.refits.get(axis), found.base.axis.units
    every = [
        refit and refit_in_words(refit),
        *prepared_in_words(found.dataset),
        *_about_the_fits(found, summary),
        found.repeat and repeat_in_words(found.repeat),
        None if found.dataset.selection else NO_SELECTION_LOG,
        summary.noise and noise_in_words(summary.noise, units),
        also_chose_in_words(found.dataset.tested_on) if found.findings else None,
    ]
    if why := result.not_planned.get(axis):
        every.append(f"no experiment that would tell them apart is proposed: {why}")
    every += not_tried_in_words(result.not_tried.get(axis, {}), units)
    return tuple(note for note in every if note)


def not_tried_in_words(found: Mapping[str, NotTried], units: AxisUnits) -> list[str]:
    """Which effects were not tried, a sentence for each reason."""
    imposed = f"{units.mass_name} = 0 {units.mass} says that the motion is imposed"
    said = {
        Hindrance.OTHER_AXIS: "as each depends on the other axis, and of more than two it is not "
        "known which; diagnose a model of two axes alone",
        Hindrance.IMPOSED: f"as each acts through the motor or what it moves, and {imposed}; give "
        f"the {units.mass_name}",
        Hindrance.NO_ROTOR: "as what the drive of a joint does is asked beside its rotor's "
        "inertia; add rotor_inertia",
        RestsTooOften(): "as the axis comes to rest within nearly every test function, and at rest "
        "such friction is unknown; give a log in which it moves for longer at a time",
    }
    names = {why: [name for name, own in found.items() if own == why] for why in said}
    return [
        f"not tried: {', '.join(names[why])}, {text}" for why, text in said.items() if names[why]
    ]


def _about_the_fits(found: AxisDiagnosis, summary: AxisSummary) -> list[str]:
    """That a fit did not converge, and which parameters what was found has moved."""
    words, base, final = found.base.axis.units.words, found.base, found.final
    said = [words(OUTCOMES[base.ended])] if base.ended is not Outcome.CONVERGED else []
    if final is base:
        return said
    with_it = f"with {listed([f.effect for f in found.findings])}"
    if final.ended is not Outcome.CONVERGED:
        said.append(f"{with_it}: {words(OUTCOMES[final.ended])}")
    return said + [f"{with_it}, {words(moved_in_words(m))}" for m in summary.moved]


def _beyond_in_words(summary: AxisSummary, error: str) -> list[str]:
    """That other logs show what the training logs do not; nothing where they do not."""
    above = {role: ratio for role, ratio in summary.beyond.items() if ratio > RULE.at_floor}
    if not above:
        return []
    times = (
        f"{x:.1f} times what noise makes on the {role.value} logs" for role, x in above.items()
    )
    return [
        f"This holds for the training logs alone: the {error} is {' and '.join(times)}. Give such "
        "a log as a training log too."
    ]
