"""Sentences about a planned experiment: the motion that is missing, and what cannot be run."""

from __future__ import annotations

from identify.experiment_design.candidate_experiments import NotRun
from identify.experiment_design.discrimination import SimulatedExperiment
from identify.experiment_design.missing_excitation import Gap
from identify.experiment_design.plan import Plan
from identify.experiment_design.rival_hypotheses import STRENGTH
from twin.experiments.file import in_short


def in_order(plan: Plan) -> list[SimulatedExperiment]:
    """The chosen experiment, then those that can be run, by falling evidence."""
    chosen, *others = plan.ranking
    runnable = (t for t in others if t.not_run is None)
    return [chosen, *sorted(runnable, key=lambda t: -t.gain)]


def experiment_in_words(t: SimulatedExperiment, plan: Plan) -> str:
    """Which experiment it is, how long it takes, and what it is expected to show.

    Only the leading ones are refitted, and the best of these is chosen: one with more evidence than
    the chosen has it from one linear step.
    """
    tail = f"{t.gain:.1f} nats on the parameters"
    if len(plan.between) > 1:
        linear = ", by one linear step" if t.gain > plan.chosen.gain else ""
        tail = (
            f"evidence {t.gain:.1f}{linear}, {t.difference:.3g} {t.units.force} unexplained by the "
            f"rival ({t.difference / t.floor:.1f} x noise floor)"
        )
    return f"{in_short(t.experiment, t.units)}; {t.duration:.1f} s: {tail}"


def supposed_in_words(plan: Plan) -> str | None:
    """What is assumed of the explanations where there are no logs; None where there are some."""
    if not plan.supposed or len(plan.between) < 2:
        return None
    if any(name in plan.excited_by for name in plan.between):
        return (
            "no logs given: each effect that the model lacks is assumed at "
            f"{STRENGTH:g} times the noise floor"
        )
    return "no logs given: the models are compared with the values in their files"


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
