"""What a reader of a diagnosis should know beside the answer, one sentence each."""

from __future__ import annotations

from identify.alignment import shift_in_words
from identify.diagnose import AxisDiagnosis
from identify.fit import Outcome
from identify.given import Refit
from identify.workflow import moved_parameters


def remarks(found: AxisDiagnosis, refit: Refit | None) -> tuple[str, ...]:
    """Shifted channels, fits that did not end well, parameters that moved, what is weak."""
    out = []
    if refit and (changed := refit.in_words()):
        out.append(changed)
    if shifted := shift_in_words(found.study):
        out.append(shifted)
    if found.base.outcome is not Outcome.CONVERGED:
        out.append(found.base.outcome.value)
    if found.best is not None:
        name = found.best.effect.name
        if found.best.fit.outcome is not Outcome.CONVERGED:
            out.append(f"with {name}: {found.best.fit.outcome.value}")
        out += [f"with {name}, {m}" for m in moved_parameters(found.base, found.best.fit)]
    if found.repeat is not None:
        out.append(found.repeat.in_words())
    if not found.study.holdout:
        out.append(
            "no log was held out; candidates were judged on blocks left out of the fit, which is "
            "weaker. Give --holdout a log of another run."
        )
    return tuple(out)
