"""Chapter "residuals": LuGre fitted to a machine whose friction remembers every reversal.

As in the thesis the tests of the residual say that LuGre does not hold all of it. The diagnosis
then says which effect is missing; with it the error must fall to the noise floor. The machine is
stepped ten times finer than the logs' samples. One log is kept apart, on which nothing is decided.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identify.dataset.dataset import datasets
from identify.dataset.prepared_log import PreparedLog, moving, sticks
from identify.estimation.channel_delay import fit_aligned, realigned
from identify.estimation.evidence import rms
from identify.estimation.fit import Fit, error_on
from identify.selection.diagnosis import Verdict, diagnose_axis
from identify.thesis.chapter import Chapter, Recovered
from identify.validation.whiteness import ResidualTests, loop_of, residual_tests
from twin.effect import Kind
from twin.effects import Catalogue
from twin.experiments.named import simulate
from twin.log import Log
from twin.model.machine import AxisModel, Fitted, MachineModel
from twin.progress import Progress
from twin.simulator import FineSimulator


@dataclass(frozen=True)
class Size:
    """duration: s of each log. everything: whether all effects are tried, or frictions alone."""

    duration: float
    everything: bool


FULL = Size(20.0, True)
SMALL = Size(8.0, False)


@dataclass(frozen=True, eq=False)
class Candidate:
    """An effect beside the first model, or in place of its friction, and the error with it."""

    name: str
    delta_bic: float
    over_floor: float


@dataclass(frozen=True, eq=False)
class ResidualResult:
    """The chapter's results.

    first: the friction that was fitted; planted: the machine's. named: effects that the diagnosis
    names. before, after: tests of the residual. error_before, error_after, floor: N RMS on the log
    that was kept apart. delay: s, channel delay that the misfit of the first friction feigned.
    values: of the machine's friction, where it was named.
    """

    first: str
    planted: str
    verdict: Verdict
    named: tuple[str, ...]
    ranking: Sequence[Candidate]
    before: ResidualTests
    after: ResidualTests
    error_before: float
    error_after: float
    floor: float
    delay: float
    values: dict[str, Recovered]


def run(
    models: Sequence[MachineModel],
    catalogue: Catalogue,
    size: Size,
    rng: np.random.Generator,
    progress: Progress,
) -> ResidualResult:
    """Fit the second model's friction to the first axis of the first, and diagnose it."""
    machine, stage = models
    name, axis = next(iter(machine.axes.items()))
    planted, first = (friction_of(a) for a in (axis, next(iter(stage.axes.values()))))
    model = machine.with_axis(name, axis.with_effect(first))
    seeds = [int(seed) for seed in rng.integers(2**31, size=4)]
    logs = {}
    for i, seed in enumerate(seeds):
        progress("logs of the machine", i, len(seeds))
        logs[f"log {i + 1}"] = _recorded(machine, seed, size)
    apart = {"log 4": logs.pop("log 4")}
    held = {"log 3": logs.pop("log 3")}
    dataset, base = fit_aligned(model.axes[name], datasets(model, logs, held)[name])
    whole = datasets(model, apart, {}, dataset.test_function_length)[name]
    known = catalogue if size.everything else frictions(catalogue)
    found = diagnose_axis(base, dataset, known, progress)
    tests = [realigned(whole, d.channel_delay).fit for d in (dataset, found.dataset)]
    return ResidualResult(
        first=first.effect.name,
        planted=planted.effect.name,
        verdict=found.verdict,
        named=found.named,
        ranking=[Candidate(c.effect.name, c.delta_bic, c.fit.ratio) for c in found.ranking],
        before=_tests(base, tests[0]),
        after=_tests(found.final, tests[1]),
        error_before=rms(error_on(base.axis, tests[0])),
        error_after=rms(error_on(found.final.axis, tests[1])),
        delay=dataset.channel_delay,
        floor=found.final.floor,
        values=_values(planted, found.final.axis),
    )


def _recorded(machine: MachineModel, seed: int, size: Size) -> Log:
    return simulate(machine, "tracking", seed=seed, duration=size.duration, simulator=FineSimulator)


def friction_of(axis: AxisModel) -> Fitted:
    """The friction of an axis that has one."""
    return next(f for f in axis.effects if f.effect.kind is Kind.FRICTION)


def frictions(catalogue: Catalogue) -> Catalogue:
    """The frictions of a catalogue alone."""
    return Catalogue([e for e in catalogue.values() if e.kind is Kind.FRICTION])


def _tests(fit: Fit, logs: Sequence[PreparedLog]) -> ResidualTests:
    kept = moving(logs, sticks(fit.axis))
    force = np.full(len(kept), np.nan)
    force[kept] = error_on(fit.axis, logs)
    return residual_tests(logs, force, kept, fit.floor, loop_of(logs))


def _values(planted: Fitted, found: AxisModel) -> dict[str, Recovered]:
    """The free parameters of the machine's friction beside those found; none where it was not."""
    if planted.effect.name not in found.names:
        return {}
    values = found[planted.effect.name].values
    return {
        p.name: Recovered(planted.values[p.name], np.array([values[p.name]]), p.unit)
        for p in planted.effect.parameters
        if p.name not in planted.fixed and not p.fixed
    }


CHAPTER = Chapter(("thesis_memory", "proton_xy"), FULL, SMALL, run)
