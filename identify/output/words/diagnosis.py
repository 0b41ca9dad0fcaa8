"""Sentences about a diagnosis: ``said_of`` has all that is said of one axis."""

from __future__ import annotations

from dataclasses import dataclass

from identify.estimation.fit import Outcome
from identify.output.numbers import arrow, capitalised, change, listed, quantity, spaced
from identify.output.words.addition import also_chose_in_words
from identify.output.words.commands import next_commands
from identify.output.words.findings import (
    advice,
    all_in_words,
    finding_in_words,
    left_in_words,
    shape_in_words,
)
from identify.output.words.fit import (
    OUTCOMES,
    aliasing_in_words,
    moved_in_words,
    prepared_in_words,
    refit_in_words,
)
from identify.output.words.residual import dependence_in_words, repeat_in_words, worst_in_words
from identify.results.results import AxisSummary, Diagnosis
from identify.rules import RULE
from identify.selection.candidates import Candidate
from identify.selection.changes import Added, Freed
from identify.selection.changes import Change as ModelChange
from identify.selection.diagnosis import AxisDiagnosis, Verdict
from identify.selection.findings import FindingKind
from twin.model.units import units_of


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
    corrected, verdict = "", words(verdict_in_words(found))
    if result.body and axis in result.body.axes:
        corrected = f"with body {result.body.body} as it was found, "
        verdict = capitalised(f"{corrected}{verdict[0].lower()}{verdict[1:]}")
    advised = found.unexplained or any(f.shape for f in found.findings)
    return Said(
        headline=f"{corrected}{headline_in_words(found)}",
        verdict=verdict,
        findings=tuple(finding_in_words(f) for f in found.findings),
        beside=tuple(beside),
        shapes=tuple(shape_in_words(f.effect, f.shape) for f in found.findings if f.shape),
        left=tuple(left),
        advice=(advice(found.findings),) if advised else (),
        commands=() if corrected else tuple(next_commands(found)),
        steps=tuple(step_lines(found)),
        notes=remarks_on(result, axis),
    )


# --- the answer -------------------------------------------------------------------------------

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
    if reshaped := _reshaped(found):
        said.append(f"The law of {listed(reshaped)} has another shape too.")
    said += [f"The logs cannot tell {ties}."] if (ties := _ties(found)) else []
    said += [capitalised(against)] if (against := not_confirmed_in_words(found)) else []
    return " ".join(said)


def _proved(found: AxisDiagnosis) -> str:
    lacks, them = ("several effects", "them") if len(found.named) > 1 else ("an effect", "it")
    proof = f"the training logs prove {them}, block by block; there is no selection log"
    if found.dataset.holdout:
        proof = f"the training logs and the selection logs prove {them}"
    return f"The model lacks {lacks}: {proof}."


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
            answer = f"{named_in_words(found)} {are} missing"
            if reshaped := _reshaped(found):
                answer += f", and {listed(reshaped)} has another shape"
        case Verdict.WRONG_SHAPE:
            answer = f"{found.findings[0].effect} has another shape"
        case Verdict.UNEXPLAINED:
            answer = "something outside the catalogue is missing"
        case Verdict.NOTHING_MISSING:
            answer = "nothing is missing"
    against = not_confirmed_in_words(found)
    return spaced(f"{answer} ({against})" if against else answer)


def not_confirmed_in_words(found: AxisDiagnosis) -> str | None:
    """Which findings the test logs contradict; None where they contradict none."""
    against = [f.effect for f in found.findings if f.contradicted]
    return f"not confirmed by the test logs: {', '.join(against)}" if against else None


def named_in_words(found: AxisDiagnosis) -> str:
    """Every effect that is named, e.g. "cogging or wear, and lugre"; empty where none is."""
    alike = {f.effect for f in found.findings if f.kind is FindingKind.RESEMBLES}
    each = [
        " or ".join(
            (f"something like {name}" if name in alike else name, *tied_in_words(name, found))
        )
        for name in found.named
    ]
    ambiguous = any(tied for _, *tied in found.answers)
    return ", and ".join(each) if ambiguous or not each else listed(each)


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
    kind = "selection error" if found.dataset.holdout else "cross-validated error"
    return f"{kind} of the beginnings, which were searched" if found.in_part else kind


def named_errors_in_words(found: AxisDiagnosis) -> str:
    """The force error on the test logs, or on those that also chose, without and with the named."""
    tested, unit = found.tested, found.base.axis.units.force
    what = f"{units_of(unit).words('force error')} on the {tested.on.value} logs"
    if found.final is found.base:
        return f"{what} {quantity(tested.before, unit)}"
    return f"{what} {arrow(tested.before, tested.after, unit)} with {all_found(found)}"


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
    for step in found.steps[index:]:
        if name in step.dropped:
            return f"no longer needed beside {model_change_in_words(step.change)}"
    return "no longer needed beside what was found after it"


def why_not(found: AxisDiagnosis, candidate: Candidate) -> str:
    """Why a candidate is not named, or not proved by itself; nothing where it is."""
    name = candidate.effect.name
    if candidate.supported:
        beside = found.named and not any(name in answer for answer in found.answers)
        return f"not needed beside {listed(found.named)}" if beside else ""
    pairs = (f.together[0] for f in found.findings if f.effect == name and f.together)
    other = next(pairs, None)
    return f"proved only together with {other}" if other else candidate.refused or ""


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
        None if found.dataset.holdout else NO_SELECTION_LOG,
        summary.noise and aliasing_in_words(summary.noise, units),
        also_chose_in_words(found.dataset.tested_on) if found.findings else None,
    ]
    if why := result.not_planned.get(axis):
        every.append(f"no experiment that would tell them apart is proposed: {why}")
    if result.not_tried:
        every.append(
            f"not tried: {', '.join(result.not_tried)}, as each depends on the other axis, and of "
            "more than two it is not known which; diagnose a model of two axes alone"
        )
    return tuple(note for note in every if note)


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
    """That the selection logs show what the training logs do not; nothing where they do not."""
    ratio = summary.selection_ratio
    if ratio is None or ratio < RULE.at_floor:
        return []
    return [
        f"This holds for the training logs alone: on the selection logs the {error} is {ratio:.1f} "
        "times its noise floor. Give such a log as a training log too."
    ]
