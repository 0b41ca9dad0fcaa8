"""Sentences about a diagnosis and its findings: ``said_of`` has all that is said of one axis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from identify.estimation.fit import Outcome
from identify.estimation.offered import NotTried, RestsTooOften
from identify.output.numbers import capitalised, change, listed
from identify.output.words.findings import (
    all_in_words,
    finding_in_words,
    left_in_words,
    role_in_words,
    shape_in_words,
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
from identify.output.words.refusal import refusal_in_words
from identify.output.words.verdict import headline_in_words, verdict_in_words
from identify.results.results import AxisSummary, Diagnosis
from identify.rules import RULE
from identify.selection.candidates import Candidate
from identify.selection.changes import Added, Freed
from identify.selection.changes import Change as ModelChange
from identify.selection.diagnosis import AxisDiagnosis, Verdict
from identify.selection.findings import Finding
from twin.model.machine import Hindrance
from twin.model.units import AxisUnits

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
    if found.also_seen:
        beside.append(f"also seen, too small to matter: {', '.join(found.also_seen)}")
    beside += [role_in_words(law) for law in found.depends_on_roles]
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
        # It is told at the channel delay of the answer, where a law that imitated one may be worse.
        how = "falls" if gain.after <= gain.before else "rises at the channel delay found later"
        lines.append(
            f"step {i + 1}: with {what} the {tested_on(found)} {how} from {before} to "
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
        return f"at the end, {refusal_in_words(found.doubted[name])}"
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
    return refusal_in_words(candidate.refused) if candidate.refused else ""


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
        refit_in_words(refit) if refit else None,
        *prepared_in_words(found.dataset),
        *_about_the_fits(found, summary),
        repeat_in_words(found.repeat) if found.repeat else None,
        None if found.dataset.selection else NO_SELECTION_LOG,
        noise_in_words(summary.noise, units) if summary.noise else None,
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
