"""Remarks beside the answer of a diagnosis, one sentence each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from identify.estimation.decision import RULE
from identify.estimation.fit import Outcome
from identify.output.words.estimation import outcome_in_words, prepared_in_words
from identify.output.words.numbers import PLAIN, Numbers
from identify.output.words.selection import (
    also_chose_in_words,
    moved_in_words,
    refit_in_words,
    repeat_in_words,
)
from identify.selection.acceptance import Judged
from identify.selection.confounded import Refit, moved_parameters
from identify.selection.diagnosis import AxisDiagnosis, Verdict

if TYPE_CHECKING:  # results print themselves, with these sentences
    from identify.output.results import Diagnosis


def remarks_on(result: Diagnosis, axis: str, numbers: Numbers = PLAIN) -> tuple[str, ...]:
    """What a reader should know beside the answer for one axis."""
    return remarks(
        result.axes[axis],
        result.refits.get(axis),
        result.not_tried,
        result.not_planned.get(axis),
        numbers,
    )


def remarks(
    found: AxisDiagnosis,
    refit: Refit | None,
    not_tried: Sequence[str] = (),
    not_planned: str | None = None,
    numbers: Numbers = PLAIN,
) -> tuple[str, ...]:
    """Channel delays, fits that did not converge, changed parameters, weak evidence.

    not_tried: effects that depend on the other axis, on a machine with more than two axes.
    not_planned: why no experiment is proposed for an ambiguous answer.
    """
    words = found.base.axis.units.words
    out = []
    if refit and (changed := refit_in_words(refit, numbers)):
        out.append(changed)
    out += prepared_in_words(found.dataset)
    if found.base.ended is not Outcome.CONVERGED:
        out.append(words(outcome_in_words(found.base.ended)))
    if found.best is not None:
        name = found.best.effect.name
        if found.best.fit.ended is not Outcome.CONVERGED:
            out.append(f"with {name}: {words(outcome_in_words(found.best.fit.ended))}")
        moved = moved_parameters(found.base, found.best.fit)
        out += [f"with {name}, {words(moved_in_words(m, numbers))}" for m in moved]
    if found.repeat is not None:
        out.append(repeat_in_words(found.repeat))
    if not found.dataset.holdout:
        out.append(
            "no log was held out, so candidates were judged by cross-validation on blocks of the "
            "training logs, which is a weaker test. Give --holdout a log of another experiment."
        )
    if found.verdict is Verdict.NOTHING_MISSING and (beyond := _beyond_in_words(found)):
        out.append(words(beyond))
    if found.findings and (also := also_chose_in_words(found.dataset.tested_on)):
        out.append(also)
    if not_planned is not None:
        out.append(f"no experiment that would tell them apart is proposed: {not_planned}")
    if not_tried:
        out.append(
            f"not tried: {', '.join(not_tried)}, because each depends on the other axis, and with "
            "more than two axes it is not known which that is; diagnose a model of two axes alone"
        )
    return tuple(out)


def _beyond_in_words(found: AxisDiagnosis) -> str | None:
    """That the held-out logs show what the fit logs do not; None where they do not."""
    judged = Judged(found.base, found.dataset)
    ratio = judged.other_error / judged.other_floor
    if not found.dataset.holdout or ratio < RULE.at_floor:
        return None
    return (
        "what was said holds for the training logs: on the selection logs the force error is "
        f"{ratio:.1f} times its noise floor. Give such a log as a training log too, so that what "
        "it shows is looked for"
    )
