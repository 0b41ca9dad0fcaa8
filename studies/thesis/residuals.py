"""Chapter "residuals": LuGre fitted to a machine whose friction remembers every reversal.

As in the thesis the tests of the residual say that LuGre does not hold all of it. The diagnosis
then says which effect is missing; with it the error must fall to the noise floor. The machine is
stepped ten times finer than the logs' samples. One log is kept apart, on which nothing is decided.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identify.dataset.prepared_log import PreparedLog, moving, sticks
from identify.estimation.alignment import fit_aligned, realigned
from identify.estimation.errors import error_on
from identify.estimation.evidence import rms
from identify.estimation.fit import Fit
from identify.output.blocks import Block, Heading
from identify.output.numbers import spaced
from identify.output.shown.residual import residual_test_blocks
from identify.selection.diagnosis import diagnose_axis
from identify.validation.whiteness import ResidualTests, loop_of, residual_tests
from studies.thesis import shared
from studies.thesis.shared import CATALOGUE, Found, Numbers, friction_of
from twin.effects import Catalogue
from twin.model.machine import AxisModel, Fitted
from twin.model.units import LINEAR

TITLE = "Residual analysis"


def run(small: bool, rng: np.random.Generator) -> Found:
    """Fit the stage's friction to a machine with another, and diagnose it.

    In small frictions alone are tried.
    """
    machine, name, axis = shared.machine("memory")
    _, _, stage = shared.machine("proton_xy")
    planted, first = friction_of(axis), friction_of(stage)
    model = machine.with_axis(name, axis.with_effect(first))
    given, test = shared.four_logs(machine, 8.0 if small else 20.0, rng, model)
    dataset, base = fit_aligned(model.axes[name], given)
    found = diagnose_axis(base, dataset, Catalogue(shared.frictions()) if small else CATALOGUE)
    before = left_by(base, realigned(test, dataset.channel_delay).training)
    after = left_by(found.final, realigned(test, found.dataset.channel_delay).training)
    tests = {"before": before[1], "after": after[1]}
    numbers = {
        "fitted": first.effect.name, "planted": planted.effect.name, "named": found.named,
        "verdict": found.verdict.name.lower(),
        "ranking": [
            {"effect": c.effect.name, "delta_bic": c.delta_bic,
             "error_over_noise_floor": c.fit.ratio}
            for c in found.ranking
        ],
        "test_error_before": before[0], "test_error_after": after[0],
        "noise_floor": found.final.floor, "unit": "N",
        "white": {name: one.passed for name, one in tests.items()},
        "outside_90_bounds": {
            name: {c.signal: c.share_outside for c in one.correlations}
            for name, one in tests.items()
        },
        "parameters": beside_planted(planted, found.final.axis),
    }  # fmt: skip
    pictures: list[Block] = []
    for names, one in zip(([first.effect.name], found.named), tests.values(), strict=True):
        heading = Heading(f"With {', '.join(map(spaced, names)) or 'nothing more'}")
        pictures += [heading, *residual_test_blocks(one, LINEAR)]
    return Found(numbers, words(numbers), pictures)


def left_by(fit: Fit, logs: Sequence[PreparedLog]) -> tuple[float, ResidualTests]:
    """What a fit leaves of some logs: N RMS, and the tests of it."""
    kept, left = moving(logs, sticks(fit.axis)), error_on(fit.axis, logs)
    force = np.full(len(kept), np.nan)
    force[kept] = left
    return rms(left), residual_tests(logs, force, kept, fit.floor, loop_of(logs))


def beside_planted(planted: Fitted, found: AxisModel) -> dict[str, Numbers]:
    """The free parameters of the machine's friction beside those found; none where it was not."""
    if planted.effect.name not in found.names:
        return {}
    values = found[planted.effect.name].values
    return {
        p.name: shared.recovered(planted.values[p.name], [values[p.name]], p.unit)
        for p in planted.effect.parameters
        if p.name not in planted.fixed and not p.fixed
    }


def words(n: Numbers) -> list[str]:
    """What the tests say of the first friction, what the diagnosis names, and what is left."""
    before, after, floor = (
        n[key] for key in ("test_error_before", "test_error_after", "noise_floor")
    )
    white = {when: "white" if passes else "not white" for when, passes in n["white"].items()}
    return [
        f"with {n['fitted']} fitted to a machine with {n['planted']} the test error is "
        f"{before:.3g} N, {before / floor:.1f} times the noise floor, and its residual is "
        f"{white['before']}",
        f"the diagnosis names {', '.join(n['named']) or 'nothing'} "
        f"({n['verdict'].replace('_', ' ')})",
        f"with it the test error is {after:.3g} N, {after / floor:.2f} times the noise floor, and "
        f"the residual is {white['after']}",
    ]
