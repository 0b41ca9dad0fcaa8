"""Remarks beside the answer of a diagnosis, one sentence each."""

from __future__ import annotations

from identify.estimation.decision import RULE
from identify.estimation.fit import Outcome
from identify.output.words.estimation import (
    aliasing_in_words,
    outcome_in_words,
    prepared_in_words,
)
from identify.output.words.numbers import PLAIN, Numbers, listed
from identify.output.words.selection import (
    also_chose_in_words,
    moved_in_words,
    refit_in_words,
    repeat_in_words,
)
from identify.results.results import Diagnosis
from identify.results.told import Told
from identify.selection.diagnosis import Verdict


def remarks_on(result: Diagnosis, axis: str, numbers: Numbers = PLAIN) -> tuple[str, ...]:
    """Channel delays, fits that did not converge, changed parameters, weak evidence of one axis."""
    found, told = result.axes[axis], result.told[axis]
    refit, not_planned = result.refits.get(axis), result.not_planned.get(axis)
    words = found.base.axis.units.words
    out = []
    if refit and (changed := refit_in_words(refit, numbers)):
        out.append(changed)
    out += prepared_in_words(found.dataset)
    if found.base.ended is not Outcome.CONVERGED:
        out.append(words(outcome_in_words(found.base.ended)))
    if found.final is not found.base:
        with_it = f"with {listed([f.effect for f in found.findings])}"
        if found.final.ended is not Outcome.CONVERGED:
            out.append(f"{with_it}: {words(outcome_in_words(found.final.ended))}")
        out += [f"{with_it}, {words(moved_in_words(m, numbers))}" for m in told.moved]
    if found.repeat is not None:
        out.append(repeat_in_words(found.repeat))
    if not found.dataset.holdout:
        out.append(
            "no log was held out, so candidates were judged by cross-validation on blocks of the "
            "training logs, which is a weaker test. Give --holdout a log of another experiment."
        )
    if aliased := told.noise and aliasing_in_words(told.noise, found.base.axis.units, numbers):
        out.append(aliased)
    if found.verdict is Verdict.NOTHING_MISSING and (beyond := _beyond_in_words(told)):
        out.append(words(beyond))
    if found.findings and (also := also_chose_in_words(found.dataset.tested_on)):
        out.append(also)
    if not_planned is not None:
        out.append(f"no experiment that would tell them apart is proposed: {not_planned}")
    if result.not_tried:
        out.append(
            f"not tried: {', '.join(result.not_tried)}, because each depends on the other axis, "
            "and with more than two axes it is not known which that is; diagnose a model of two "
            "axes alone"
        )
    return tuple(out)


def _beyond_in_words(told: Told) -> str | None:
    """That the selection logs show what the training logs do not; None where they do not."""
    if told.selection_ratio is None or told.selection_ratio < RULE.at_floor:
        return None
    return (
        "what was said holds for the training logs: on the selection logs the force error is "
        f"{told.selection_ratio:.1f} times its noise floor. Give such a log as a training log too, "
        "so that what it shows is looked for"
    )
