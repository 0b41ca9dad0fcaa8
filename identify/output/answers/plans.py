"""The JSON of planned experiments."""

from __future__ import annotations

from typing import Any

from identify.experiment_design.discrimination import SimulatedExperiment
from identify.experiment_design.plan import Plan
from identify.output.answers import Answer, Entry, File, answer_of, read
from identify.output.words.next_step import gap_in_words, in_order, not_run_in_words
from twin.experiments.file import parameters
from twin.experiments.kinds import kind_of
from twin.record import Number


class SimulatedEntry(Entry):
    """An experiment as it was simulated, and what it is expected to show."""

    experiment: dict[str, Any]
    """Its kind and its parameters, as in the TOML file."""
    duration: Number
    duration_unit: str = "s"
    expected_difference: Number = read("difference")
    noise_floor: Number = read("floor")
    unit: str = read("units.force")
    delta_bic: Number
    """Expected evidence between two explanations; null of one."""
    information: Number
    """On the parameters of one model, nats; null of two explanations."""


class PlanAnswer(Answer, SimulatedEntry):
    """What `twin plan` prints: the chosen experiment, and those it was chosen from."""

    axis: str
    between: list[str]
    decides: bool
    excited_by: dict[str, str]
    favoured_by_the_logs: str | None
    refitted_on_logs: bool
    missing_motion: str
    ranking: list[SimulatedEntry]
    not_run: list[str]
    file: File | None = None
    setpoints: File | None = None


@answer_of.register
def _(result: Plan, **more: Any) -> PlanAnswer:
    several = len(result.between) > 1
    return PlanAnswer.of(
        result,
        result.chosen,
        **_experiment(result.chosen, several),
        refitted_on_logs=not result.supposed,
        missing_motion=gap_in_words(result.gap),
        ranking=[SimulatedEntry.of(t, **_experiment(t, several)) for t in in_order(result)],
        not_run=[not_run_in_words(n) for n in result.not_run],
        **more,
    )


def _experiment(t: SimulatedExperiment, several: bool) -> dict[str, Any]:
    return {
        "experiment": {"kind": kind_of(t.experiment), **parameters(t.experiment)},
        "delta_bic": t.gain if several else None,
        "information": None if several else t.gain,
    }
