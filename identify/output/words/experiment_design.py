"""Sentences about a planned experiment: the motion that is missing, and what cannot be run."""

from __future__ import annotations

from identify.experiment_design.candidate_experiments import NotRun
from identify.experiment_design.missing_excitation import Gap
from twin.experiments.file import in_short


def gap_in_words(gap: Gap) -> str:
    """Which motion the logs lack."""
    where = f"{gap.feature} {gap.low:.3g} to {gap.high:.3g} {gap.unit}"
    if gap.share is None:
        return f"the explanations differ most at {where}"
    held = f"{100.0 * gap.share:.1f} % of the data is there"
    if gap.missing:
        return f"missing motion: {where}; {held}"
    return f"no motion is missing, but more of it is needed at {where}; {held}"


def not_run_in_words(not_run: NotRun) -> str:
    """Which experiment cannot be run, and why."""
    truth = f" (with {not_run.truth})" if not_run.truth else ""
    return f"{in_short(not_run.experiment, not_run.units)}: {not_run.reason}{truth}"
