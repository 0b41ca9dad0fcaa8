"""Sentences about a diagnosis: its verdict, what a fit changed, what repeats, what is described."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identify.dataset.given_logs import Role
from identify.estimation.repeating_force import Repeat
from identify.estimation.residual_dependence import Dependence
from identify.output.words.numbers import PLAIN, Numbers, capitalised, listed
from identify.results.addition import Addition
from identify.selection.confounded import Change, MovedParameter, Refit
from identify.selection.diagnosis import AxisDiagnosis, Verdict
from identify.selection.findings import FindingKind
from identify.selection.nonparametric import followed
from twin.model.history import HistoryStep
from twin.model.machine import Fitted
from twin.model.units import units_of

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
    against = f" {capitalised(but)}." if (but := not_confirmed_in_words(found)) else ""
    if any(f.tied for f in found.findings):
        return f"{SEVERAL}{against}"
    if found.verdict is not Verdict.MISSING_EFFECTS:
        return f"{VERDICTS[found.verdict]}{against}"
    lacks, them = ("several effects", "them") if len(found.named) > 1 else ("an effect", "it")
    if found.dataset.holdout:
        proved = f"the training logs and the selection logs prove {them}"
    else:
        proved = f"the training logs prove {them}, block by block; no log was held out"
    return f"The model lacks {lacks}: {proved}.{against}"


def not_confirmed_in_words(found: AxisDiagnosis) -> str | None:
    """Which findings the test logs contradict; None where they contradict none."""
    against = [f.effect for f in found.findings if f.contradicted]
    return f"not confirmed by the test logs: {', '.join(against)}" if against else None


def tested_on(found: AxisDiagnosis) -> str:
    """On what data a candidate was judged."""
    return "held-out" if found.dataset.holdout else "cross-validated"


def effect_in_words(found: AxisDiagnosis, effect: str) -> str:
    """A named effect: "cogging", or "something like cogging" where the missing one resembles it."""
    alike = {f.effect for f in found.findings if f.kind is FindingKind.RESEMBLES}
    return f"something like {effect}" if effect in alike else effect


def named_in_words(found: AxisDiagnosis) -> str:
    """Every effect that is named, e.g. "cogging or wear, and lugre"; empty where none is."""
    each = [" or ".join((effect_in_words(found, name), *alike)) for name, *alike in found.answers]
    if any(alike for _, *alike in found.answers):
        return ", and ".join(each)
    return listed(each) if each else ""


def ties_in_words(found: AxisDiagnosis) -> list[str]:
    """What these data cannot separate, one sentence a named effect, each pair once."""
    ties = {f.effect: f.tied for f in found.findings}
    said: list[str] = []
    for name, alike in ties.items():
        if {*alike} - {other for other in said if name in ties[other]}:
            said.append(name)
    return [f"these data cannot separate {name} from: {', '.join(ties[name])}" for name in said]


def named_errors_in_words(found: AxisDiagnosis, numbers: Numbers = PLAIN) -> str:
    """The force error on the test logs, or on those that also chose, without and with the named."""
    tested, units = found.tested, found.base.axis.units
    before, after = (numbers.amount(e, units.force) for e in (tested.before, tested.after))
    named = "" if found.final is found.base else f", with what was found {after}"
    return f"{units.words('force error')} on the {tested.on.value} logs {before}{named}"


def also_chose_in_words(on: Role) -> str | None:
    """That the logs whose errors are told decided as well; None of test logs."""
    if on is Role.TEST:
        return None
    return (
        f"the errors told are of the {on.value} logs, which took part in the choice, and so "
        "flatter it; give --test a log of another run, on which nothing is decided"
    )


def remainder_in_words(found: AxisDiagnosis, numbers: Numbers = PLAIN) -> str | None:
    """How large the error is that remains beside what was named, or None where it is noise."""
    if not found.findings or found.unexplained is None:
        return None
    fit = found.with_named
    error = numbers.amount(fit.error, fit.axis.units.force)
    beside = " beside the named effects" if found.named else ""
    ratio = f"{fit.ratio:.1f} times the noise floor"
    return f"what remains{beside} is {error} on the fit logs, {ratio}"


def change_in_words(change: Change, numbers: Numbers = PLAIN) -> str:
    """E.g. "mass 15 -> 15.6 kg changes the force by 0.57 N (payload_mass gives the same force)"."""
    force = units_of(change.force_unit).words("force")
    same = ""
    if change.alike:
        verb = "give" if len(change.alike) > 1 else "gives"
        same = f" ({' and '.join(change.alike)} {verb} the same {force})"
    values = " -> ".join(numbers.change(change.before, change.after, change.unit))
    by = numbers.amount(change.force, change.force_unit)
    return f"{change.label} {values} changes the {force} by {by}{same}"


def refit_in_words(refit: Refit, numbers: Numbers = PLAIN) -> str | None:
    """What fitting changed of the given model, or None where its values were good."""
    if not refit.changes:
        return None
    changes = ", ".join(change_in_words(c, numbers) for c in refit.changes)
    error = units_of(refit.unit).words("force error")
    given, refitted = (numbers.amount(e, refit.unit) for e in (refit.given, refit.refitted))
    return f"with the given values the {error} is {given}, after the fit {refitted}: {changes}"


def moved_in_words(moved: MovedParameter, numbers: Numbers = PLAIN) -> str:
    """How a parameter of the base changed when an effect was added."""
    values = f"from {' to '.join(numbers.change(moved.before, moved.after, moved.unit))}"
    if moved.collapsed:
        return f"{moved.label} collapsed {values}: it had taken over the missing effect's force"
    return f"{moved.label} moved {values}: more than it scatters between blocks of the logs"


def repeat_in_words(repeat: Repeat) -> str:
    """E.g. "a force repeats every 2.5 mm: 1.0 N in run, 0.9 N in pulses; ..."."""
    units = repeat.units
    sizes = ", ".join(f"{a:.3g} {units.force} in {n}" for n, a in repeat.amplitude.items())
    turns = np.degrees(np.ptp(np.unwrap(list(repeat.phase.values()))))
    words = units.words
    return (
        f"a {words('force')} repeats every {1e3 * repeat.period:.4g} m{units.position} of travel "
        f"({sizes}), but its phase differs between the logs by {turns:.0f} degrees: it is present "
        f"in each log, but no function of {words('position')} holds for all of them, so no effect "
        "is named"
    )


def dependence_in_words(dependence: Dependence, numbers: Numbers = PLAIN) -> str:
    """On which coordinate an unexplained error depends, and its period where it has one."""
    period = ""
    if dependence.period is not None:
        period = f", with a period of {numbers.amount(dependence.period, dependence.unit)}"
    on = units_of(dependence.unit).words(dependence.depends_on.replace("_", " "))
    return (
        f"The error depends most on {on}, which accounts for "
        f"{100 * dependence.share_of_error:.0f} % of the squared error{period}."
    )


def nonparametric_in_words(fitted: Fitted) -> str:
    """What a nonparametric effect depends on, and that it is no physical law."""
    used = followed(fitted)
    what = f"depends on {', '.join(used)}" if used else "found nothing to depend on"
    return (
        f"{fitted.effect.name} is a fitted curve, not a physical law: it {what}, and is valid only "
        "within the motion of the fit logs"
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
