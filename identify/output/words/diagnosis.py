"""Sentences about a diagnosis and about what is added to a model.

``said_of`` has all that is said of one axis, each sentence written once; text, page and JSON show
it in their own order.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identify.dataset.given_logs import Role
from identify.estimation.decision import RULE
from identify.estimation.fit import Outcome
from identify.estimation.repeating_force import Repeat
from identify.estimation.residual_dependence import Dependence
from identify.output.numbers import (
    arrow,
    capitalised,
    change,
    listed,
    percent,
    quantity,
    spaced,
)
from identify.output.words.fit import (
    aliasing_in_words,
    outcome_in_words,
    prepared_in_words,
    region_in_words,
)
from identify.results.addition import Addition
from identify.results.results import Diagnosis
from identify.results.told import Told
from identify.selection.bends import Bend
from identify.selection.candidates import Candidate
from identify.selection.changes import Added, Freed
from identify.selection.changes import Change as ModelChange
from identify.selection.confounded import Change, MovedParameter, Refit
from identify.selection.diagnosis import AxisDiagnosis, Verdict
from identify.selection.findings import Finding, FindingKind
from identify.selection.found_shape import FoundShape
from identify.selection.nonparametric import followed
from twin.effects import load_catalogue
from twin.model.history import HistoryStep
from twin.model.machine import Fitted
from twin.model.units import units_of


@dataclass(frozen=True)
class Said:
    """All sentences about the diagnosis of one axis.

    headline: the answer in a few words, with spaces in names. verdict: in a sentence. ties: what
    the data cannot separate. findings: several sentences each. beside: on all findings together.
    shapes: of laws. left: what remains and on what it depends. advice: where no law explains it.
    following: the next command. steps: the way to the answer. notes: what else to know.
    """

    headline: str
    verdict: str
    ties: tuple[str, ...]
    findings: tuple[tuple[str, ...], ...]
    beside: tuple[str, ...]
    shapes: tuple[str, ...]
    left: tuple[str, ...]
    advice: tuple[str, ...]
    following: tuple[str, ...]
    steps: tuple[str, ...]
    notes: tuple[str, ...]


def said_of(result: Diagnosis, axis: str) -> Said:
    """The sentences about one axis of a diagnosis."""
    found = result.axes[axis]
    words, region = found.base.axis.units.words, result.left_over.get(axis)
    left = []
    if remains := remainder_in_words(found):
        left.append(capitalised(remains))
    if found.unexplained:
        left.append(dependence_in_words(found.unexplained))
        if region:
            left.append(f"It is largest at {words(region_in_words(region))}.")
    advised = found.unexplained or any(f.shape for f in found.findings)
    return Said(
        headline=headline_in_words(found),
        verdict=words(verdict_in_words(found)),
        ties=tuple(ties_in_words(found)),
        findings=tuple(finding_in_words(f) for f in found.findings),
        beside=(
            *shares_in_words(found), *together_in_words(found), *also_seen_in_words(found),
        ),
        shapes=tuple(shape_in_words(f.effect, f.shape) for f in found.findings if f.shape),
        left=tuple(left),
        advice=(advice(found.findings),) if advised else (),
        following=tuple(next_command(found)),
        steps=tuple(step_lines(found)),
        notes=remarks_on(result, axis),
    )  # fmt: skip


# --- the answer ------------------------------------------------------------------------------

VERDICTS = {
    Verdict.NOTHING_MISSING: "Nothing is missing: the force error is at its noise floor.",
    Verdict.WRONG_SHAPE: (
        "The model has the effect, but its law has another shape than the force of the machine."
    ),
    Verdict.UNEXPLAINED: (
        "The error is above the noise floor, and no effect of the catalogue explains it."
    ),
}
SEVERAL = "Several effects explain the error equally well; these data cannot separate them."


def verdict_in_words(found: AxisDiagnosis) -> str:
    """The answer of a diagnosis."""
    against = f" {capitalised(but)}" if (but := not_confirmed_in_words(found)) else ""
    if any(f.tied for f in found.findings):
        return f"{SEVERAL}{against}"
    if found.verdict is not Verdict.MISSING_EFFECTS:
        return f"{VERDICTS[found.verdict]}{against}"
    lacks, them = ("several effects", "them") if len(found.named) > 1 else ("an effect", "it")
    if found.dataset.holdout:
        proved = f"the training logs and the selection logs prove {them}"
    else:
        proved = f"the training logs prove {them}, block by block; there is no selection log"
    return f"The model lacks {lacks}: {proved}.{against}"


def headline_in_words(found: AxisDiagnosis) -> str:
    """E.g. "cogging or quadratic drag, and lugre are missing"."""
    answer = {
        Verdict.MISSING_EFFECTS: f"{named_in_words(found)} {'are' * (len(found.named) > 1) or 'is'}"
        " missing",
        Verdict.WRONG_SHAPE: f"{found.findings[0].effect if found.findings else ''} has another "
        "shape",
        Verdict.UNEXPLAINED: "something outside the catalogue is missing",
        Verdict.NOTHING_MISSING: "nothing is missing",
    }[found.verdict]
    against = not_confirmed_in_words(found)
    return spaced(f"{answer} ({against})" if against else answer)


def not_confirmed_in_words(found: AxisDiagnosis) -> str | None:
    """Which findings the test logs contradict; None where they contradict none."""
    against = [f.effect for f in found.findings if f.contradicted]
    return f"not confirmed by the test logs: {', '.join(against)}" if against else None


def tested_on(found: AxisDiagnosis) -> str:
    """What the error is called by which a candidate was judged."""
    return "selection" if found.dataset.holdout else "cross-validated"


def named_in_words(found: AxisDiagnosis) -> str:
    """Every effect that is named, e.g. "cogging or wear, and lugre"; empty where none is."""
    alike = {f.effect for f in found.findings if f.kind is FindingKind.RESEMBLES}
    each = [
        " or ".join((f"something like {name}" if name in alike else name, *tied))
        for name, *tied in found.answers
    ]
    if any(tied for _, *tied in found.answers):
        return ", and ".join(each)
    return listed(each) if each else ""


def all_found(found: AxisDiagnosis) -> str:
    """A label for what was found: the effect where it is one; "" where nothing was."""
    if found.final is found.base:
        return ""
    names = dict.fromkeys(f.effect for f in found.findings)
    return spaced(next(iter(names))) if len(names) == 1 else "all that was found"


def ties_in_words(found: AxisDiagnosis) -> list[str]:
    """What these data cannot separate, one sentence a named effect, each pair once."""
    ties = {f.effect: f.tied for f in found.findings}
    said: list[str] = []
    for name, alike in ties.items():
        if {*alike} - {other for other in said if name in ties[other]}:
            said.append(name)
    return [f"these data cannot separate {name} from: {', '.join(ties[name])}" for name in said]


def named_errors_in_words(found: AxisDiagnosis) -> str:
    """The force error on the test logs, or on those that also chose, without and with the named."""
    tested, unit = found.tested, found.base.axis.units.force
    what = f"{units_of(unit).words('force error')} on the {tested.on.value} logs"
    if found.final is found.base:
        return f"{what} {quantity(tested.before, unit)}"
    return f"{what} {arrow(tested.before, tested.after, unit)} with {all_found(found)}"


def also_chose_in_words(on: Role) -> str | None:
    """That the logs whose errors are told decided as well; None of test logs."""
    if on is Role.TEST:
        return None
    return (
        f"the errors told are of the {on.value} logs and optimistic, because these logs helped to "
        "choose; give --test a log of another run, on which nothing is decided"
    )


# --- findings --------------------------------------------------------------------------------


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
            shape = "with {} in place of {}; that law".format(*_bends_in_words(finding.bend))
        what = f"what is missing resembles {finding.effect}, {shape}"
    if finding.kind is FindingKind.WRONG_SHAPE:
        what = f"{finding.effect} has another shape: a free curve beside its law"
        without, with_it = "with the law", "with the curve"
        if finding.bend:
            with_it, without = (f"with {value}" for value in _bends_in_words(finding.bend))
            what = f"{finding.effect} has another shape, which its law {with_it} has: that"
    errors = f"{without} the {error} is {before}, {with_it} {after}"
    if finding.contradicted:
        return f"{what} is not confirmed by the test logs: {errors}"
    return (
        f"{what} explains {percent(finding.explains)} of the squared error above the noise "
        f"floor: {errors}"
    )


def _bends_in_words(bend: Bend) -> list[str]:
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
    names = [f.effect for f in found.findings]
    return [
        _pair_in_words(found, finding.effect, other)
        for i, finding in enumerate(found.findings)
        for other in finding.together
        if other in names[i + 1 :]
    ]


def _pair_in_words(found: AxisDiagnosis, first: str, second: str) -> str:
    take = ""
    above = found.tested.before**2 - found.base.floor**2
    if len(found.findings) == 2 and above > 0.0:
        taken = min((found.tested.before**2 - found.tested.after**2) / above, 1.0)
        take = (
            f"; together they explain {percent(taken)} of the squared error above the noise floor"
        )
    return (
        f"{first} and {second} are needed together, so the logs prove neither alone{take}: "
        f"twin add {first} MODEL LOG... -o first.toml, then twin add {second} first.toml LOG... "
        "-o both.toml; judge after the second (the first ends with exit code 1)"
    )


def also_seen_in_words(found: AxisDiagnosis) -> list[str]:
    """Effects that are real and too small to matter, in one line; nothing where there are none."""
    return [f"also seen, too small to matter: {', '.join(found.small)}"] if found.small else []


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
    unit, band = shape.force_unit, quantity(float(curve.band[at]), shape.force_unit)
    assumed, found = change(float(curve.assumed[at]), float(curve.found[at]), unit)
    place = quantity(float(shape.coordinate[at]), shape.unit)
    within = "" if shape.period is None else " of its period"
    rest = " The force is gone at standstill." if shape.lets_go else ""
    return words(
        f"The law of {effect} is off most at {shape.over.value} {place}{within}, {direction}: it "
        f"assumes {assumed}, the logs show {found} ± {band}.{rest}"
    )


# --- what to do next -------------------------------------------------------------------------


def advice(findings: Sequence[Finding] = ()) -> str:
    """What lowers the error where no physical effect explains it, or a law has the wrong shape."""
    for f in findings:
        resembles = f.kind is FindingKind.RESEMBLES
        if f.bend is not None:
            first = f"after `twin add {f.effect}`, " if resembles else ""
            return (
                f"{first}fixed = {_held_beside(f.effect, f.bend)} for {f.effect} in the model file "
                f"lets `twin fit` find its {f.bend.parameter}, which gives the model the shape "
                "that the logs show"
            )
        if f.shape is not None:
            first = f"twin add {f.effect}, then " if resembles else ""
            shaped = f"{first}twin add --shape {f.effect}"
            return f"{shaped} gives the model the shape that the logs show"
    every = load_catalogue().values()
    known = [e.name for e in every if e.is_nonparametric and not e.free_shape]
    return f"twin add {' or '.join(known)} lowers the error by fitted curves, without explaining it"


def _held_beside(effect: str, bend: Bend) -> str:
    """The parameters that stay held where what bends a law is free, as TOML."""
    held = (p.name for p in load_catalogue()[effect].parameters if p.fixed)
    return json.dumps([name for name in held if name != bend.parameter])


def next_command(found: AxisDiagnosis) -> list[str]:
    """The command that adds what is named first, where that stands by itself and is confirmed."""
    first = found.missing[0] if found.missing else None
    if first is None or first.together or first.tied or first.contradicted:
        return []
    return [f"next: twin add {found.named[0]} MODEL LOG... -o better.toml"]


# --- the way to the answer -------------------------------------------------------------------


def model_change_in_words(change: ModelChange) -> str:
    """E.g. "cogging", "quadratic_drag with free n", "a free curve for cogging"."""
    if isinstance(change, Added):
        return change.name
    if isinstance(change, Freed):
        return f"{change.name} with free {change.parameter}"
    return f"a free curve for {change.name}"


def step_lines(found: AxisDiagnosis) -> list[str]:
    """What each accepted change did to the error, and why it is not named where it is not."""
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
            f"step {i + 1}: with {what} the {tested_on(found)} error falls from {before} to "
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
    """Why a candidate is not proved by itself; nothing where it is."""
    if candidate.supported:
        return ""
    name = candidate.effect.name
    pairs = (f.together[0] for f in found.findings if f.effect == name and f.together)
    other = next(pairs, None)
    return f"proved only together with {other}" if other else candidate.refused or ""


# --- what remains, and what a fit changed ----------------------------------------------------


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


def dependence_in_words(dependence: Dependence) -> str:
    """On which coordinate an unexplained error depends, and its period where it has one."""
    period = ""
    if dependence.period is not None:
        period = f", with a period of {quantity(dependence.period, dependence.unit)}"
    on = units_of(dependence.unit).words(spaced(dependence.depends_on))
    return (
        f"The error depends most on {on}, which accounts for "
        f"{percent(dependence.share_of_error)} of the squared error{period}."
    )


def repeat_in_words(repeat: Repeat) -> str:
    """E.g. "a force repeats every 2.5 mm: 1.0 N in run, 0.9 N in pulses; ..."."""
    units, words = repeat.units, repeat.units.words
    sizes = ", ".join(f"{quantity(a, units.force)} in {n}" for n, a in repeat.amplitude.items())
    turns = np.degrees(np.ptp(np.unwrap(list(repeat.phase.values()))))
    return (
        f"a {words('force')} repeats every {quantity(repeat.period, units.position)} of travel "
        f"({sizes}), but its phase differs between the logs by {turns:.0f} degrees: it is present "
        f"in each log, but no function of {words('position')} holds for all of them, so no effect "
        "is named"
    )


def change_in_words(change: Change) -> str:
    """E.g. "mass 15 -> 15.6 kg changes the force by 0.57 N (payload_mass gives the same force)"."""
    force = units_of(change.force_unit).words("force")
    same = ""
    if change.alike:
        verb = "give" if len(change.alike) > 1 else "gives"
        same = f" ({' and '.join(change.alike)} {verb} the same {force})"
    return (
        f"{change.label} {arrow(change.before, change.after, change.unit)} changes the {force} by "
        f"{quantity(change.force, change.force_unit)}{same}"
    )


def refit_in_words(refit: Refit) -> str | None:
    """What fitting changed of the given model, or None where its values were good."""
    if not refit.changes:
        return None
    error = units_of(refit.unit).words("force error")
    return (
        f"with the given values the {error} is {quantity(refit.given, refit.unit)}, after the fit "
        f"{quantity(refit.refitted, refit.unit)}: {', '.join(map(change_in_words, refit.changes))}"
    )


def moved_in_words(moved: MovedParameter) -> str:
    """How a parameter of the base changed when an effect was added."""
    values = f"from {' to '.join(change(moved.before, moved.after, moved.unit))}"
    if moved.collapsed:
        return f"{moved.label} collapsed {values}: it had taken over the missing effect's force"
    return f"{moved.label} moved {values}: more than its uncertainty"


# --- notes beside the answer -----------------------------------------------------------------

NO_SELECTION_LOG = (
    "there is no selection log, so candidates were judged by cross-validation on blocks of the "
    "training logs, which is a weaker test. Give --holdout a log of another experiment."
)


def remarks_on(result: Diagnosis, axis: str) -> tuple[str, ...]:
    """Channel delays, fits that did not converge, changed parameters, weak proof of one axis."""
    found, told = result.axes[axis], result.told[axis]
    refit, units = result.refits.get(axis), found.base.axis.units
    quiet = found.verdict is Verdict.NOTHING_MISSING
    every = [
        refit and refit_in_words(refit),
        *prepared_in_words(found.dataset),
        *_about_the_fits(found, told),
        found.repeat and repeat_in_words(found.repeat),
        None if found.dataset.holdout else NO_SELECTION_LOG,
        told.noise and aliasing_in_words(told.noise, units),
        _beyond_in_words(told, units.words("force error")) if quiet else None,
        also_chose_in_words(found.dataset.tested_on) if found.findings else None,
    ]
    if axis in result.not_planned:
        why = result.not_planned[axis]
        every.append(f"no experiment that would tell them apart is proposed: {why}")
    if result.not_tried:
        every.append(
            f"not tried: {', '.join(result.not_tried)}, because each depends on the other axis, "
            "and with more than two axes it is not known which that is; diagnose a model of two "
            "axes alone"
        )
    return tuple(note for note in every if note)


def _about_the_fits(found: AxisDiagnosis, told: Told) -> list[str]:
    """That a fit did not converge, and which parameters what was found has moved."""
    words, converged, said = found.base.axis.units.words, Outcome.CONVERGED, []
    if found.base.ended is not converged:
        said.append(words(outcome_in_words(found.base.ended)))
    if found.final is found.base:
        return said
    with_it = f"with {listed([f.effect for f in found.findings])}"
    if found.final.ended is not converged:
        said.append(f"{with_it}: {words(outcome_in_words(found.final.ended))}")
    return said + [f"{with_it}, {words(moved_in_words(m))}" for m in told.moved]


def _beyond_in_words(told: Told, error: str) -> str | None:
    """That the selection logs show what the training logs do not; None where they do not."""
    if told.selection_ratio is None or told.selection_ratio < RULE.at_floor:
        return None
    return (
        f"what was said holds for the training logs: on the selection logs the {error} is "
        f"{told.selection_ratio:.1f} times its noise floor. Give such a log as a training log too, "
        "so that what it shows is looked for"
    )


# --- what was added to a model ---------------------------------------------------------------


def nonparametric_in_words(fitted: Fitted) -> str:
    """What a nonparametric effect depends on, and that it is no physical law."""
    used = followed(fitted)
    what = f"depends on {', '.join(used)}" if used else "found nothing to depend on"
    return (
        f"{fitted.effect.name} is a fitted curve, not a physical law: it {what}, and is valid only "
        "within the motion of the training logs"
    )


def axis_in_words(
    effect: str, axis: str, tried: Sequence[str], having: Sequence[str]
) -> str | None:
    """Why an effect was added to an axis that nobody named, or None where there is no other.

    tried: axes that it was tried on. having: axes that have it already.
    """
    if having:
        return f"axis {', '.join(having)} has {effect} already, so it went to axis {axis}"
    if len(tried) > 1:
        return f"of axes {', '.join(tried)}, axis {axis} has the most evidence for it"
    return None


def step_in_words(step: HistoryStep) -> str:
    """What was done to a model: "added cogging to axis x"."""
    if step.action == "shape":
        return f"gave {step.effect} of axis {step.axis} the shape that the logs show"
    return f"added {step.effect} to axis {step.axis}"


def errors_of_step(step: HistoryStep) -> dict[Role, tuple[float, float]]:
    """Errors before and after a step, on the logs of each role that there were."""
    pairs = {
        Role.TRAINING: (step.fit_error_before, step.fit_error_after),
        Role.SELECTION: (step.holdout_error_before, step.holdout_error_after),
        Role.TEST: (step.test_error_before, step.test_error_after),
    }
    return {
        role: (before, after)
        for role, (before, after) in pairs.items()
        if before is not None and after is not None
    }


def proved_in_words(made: Addition) -> str:
    """Whether the logs prove what was added."""
    if made.kept:
        return "The logs prove the effect."
    return (
        f"The logs do not prove it: {made.candidate.refused}. The model has it nevertheless, as "
        "asked for; go on with the model before, or, if a diagnosis says that it needs another "
        "beside it, add that to the new model and judge then."
    )


def notes_in_words(made: Addition) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """What a reader should know of an added effect, one sentence each: for the model, and all."""
    added, reshaped, set_aside = made.candidate, made.reshaped, made.set_aside
    notes = [moved_in_words(m) for m in made.moved]
    if added.effect.is_nonparametric:
        notes.insert(0, nonparametric_in_words(added.fit.axis[added.effect.name]))
    if reshaped:
        where = "beside" if reshaped in added.fit.axis.names else "in the place of"
        notes.insert(0, f"{added.effect.name} is {where} the law of {reshaped}")
    elif set_aside:
        notes.append(
            f"{', '.join(set_aside)} was removed before {added.effect.name} was added; add it "
            "again for the error that is left"
        )
    beside = also_chose_in_words(made.told_on)
    return tuple(notes), tuple(notes) if beside is None else (*notes, beside)
