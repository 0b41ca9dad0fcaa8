"""What a reader of a diagnosis should know beside the answer, one sentence each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from identify.estimation.channel_delay import shift_in_words
from identify.estimation.fit import Outcome
from identify.selection.confounded import Refit, moved_parameters
from identify.selection.forward_selection import AxisDiagnosis

if TYPE_CHECKING:  # results print themselves, with these sentences
    from identify.output.results import Diagnosis


def remarks_on(result: Diagnosis, axis: str) -> tuple[str, ...]:
    """What a reader should know beside the answer for one axis."""
    return remarks(
        result.axes[axis], result.refits.get(axis), result.not_tried, result.not_planned.get(axis)
    )


def remarks(
    found: AxisDiagnosis,
    refit: Refit | None,
    not_tried: Sequence[str] = (),
    not_planned: str | None = None,
) -> tuple[str, ...]:
    """Shifted channels, fits that did not end well, parameters that moved, what is weak.

    not_tried: effects that depend on the other axis, where there are several. not_planned: why no
    experiment is proposed that would tell an ambiguous answer apart.
    """
    words = found.base.axis.units.words
    out = []
    if refit and (changed := refit.in_words()):
        out.append(changed)
    if shifted := shift_in_words(found.dataset):
        out.append(shifted)
    if found.base.ended is not Outcome.CONVERGED:
        out.append(words(found.base.ended.value))
    if found.best is not None:
        name = found.best.effect.name
        if found.best.fit.ended is not Outcome.CONVERGED:
            out.append(f"with {name}: {words(found.best.fit.ended.value)}")
        out += [f"with {name}, {m}" for m in moved_parameters(found.base, found.best.fit)]
    if found.repeat is not None:
        out.append(found.repeat.in_words())
    if not found.dataset.holdout:
        out.append(
            "no log was held out; candidates were judged on blocks left out of the fit, which is "
            "weaker. Give --holdout a log of another run."
        )
    if not_planned is not None:
        out.append(f"no experiment that would tell them apart is proposed: {not_planned}")
    if not_tried:
        out.append(
            f"not tried: {', '.join(not_tried)}, because with more than two axes it is not known "
            "which is the other axis; a model of two axes alone tries them"
        )
    return tuple(out)
