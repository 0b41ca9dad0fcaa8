"""Logs of a second simulator, which shares no law with the product: the right name, or none."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.foreign import CATALOGUE, STAGE, diagnosed, model_for
from benchmarks.second_simulator.effects import INSIDE, OUTSIDE
from benchmarks.second_simulator.kernel import AHEAD, BEHIND, FORCE, SLIP_ELEMENTS
from benchmarks.second_simulator.machine import PLACE, drawn, gaussian, logs_of, run
from identify import workflow
from identify.selection.diagnosis import Verdict
from twin.curve import Coordinate
from twin.effects import Catalogue
from twin.model.machine import Fitted

SEED = 5
RATE = 4e3  # Hz
RIVALS = Catalogue(
    CATALOGUE[name]
    for name in (
        "actuator_delay", "asymmetric_friction", "base_vibration", "cable_hysteresis", "cogging",
        "load_dependent_friction", "periodic_disturbance", "quadratic_drag", "thermal_drift",
        "wear",
    )
)  # fmt: skip
FEW = Catalogue([CATALOGUE[n] for n in ("asymmetric_friction", "cogging", "quadratic_drag")])
QUICK = (6.0, FEW)  # s of each log, and the effects tried
FULL = (10.0, CATALOGUE)


def found(planted, size, terms, seed=SEED):
    """The diagnosis of a machine with that effect."""
    base = drawn(np.random.default_rng(seed), RATE)
    machine = planted.make(base, size, np.random.default_rng(seed))
    return diagnosed(model_for(planted), machine, seed, *terms)


NAMED = [("cogging", 0.01)]
SLOWLY_NAMED = [
    *NAMED, ("thermal_drift", 0.2),
    ("quadratic_drag", 0.05), ("position_dependent_friction (slope)", 0.2),
    ("asymmetric_friction", 0.1), ("cable_hysteresis", 0.1), ("force_constant_ripple", 0.01),
    ("roller_spikes", 0.05),
]  # fmt: skip
OTHER = [("saturating drag", 0.1), ("random walk", 0.03), ("chirp", 0.03), ("growing mass", 0.03)]


def cases(quick, slow):
    """Quick cases, and the slow ones, which meet the whole catalogue."""
    return [
        *(pytest.param(*case, QUICK) for case in quick),
        *(pytest.param(*case, FULL, marks=pytest.mark.slow) for case in slow),
    ]


@pytest.mark.parametrize(("effect", "size", "terms"), cases(NAMED, SLOWLY_NAMED))
def test_an_effect_of_the_catalogue_is_named_whatever_its_form(effect, size, terms):
    answer = found(INSIDE[effect], size, terms)
    assert answer.best is not None
    assert answer.best.effect.name in INSIDE[effect].right


@pytest.mark.parametrize(("effect", "size", "terms"), cases([], OTHER))
def test_an_effect_of_no_catalogue_is_not_given_a_name(effect, size, terms):
    answer = found(OUTSIDE[effect], size, terms)
    assert answer.best is None
    # What nothing measured foretells, as a random walk, is told as noise of that size; a drag that
    # levels off is another curve of the friction over speed.
    if answer.findings:
        (finding,) = answer.findings
        assert (effect, finding.effect) == ("saturating drag", "lugre")
        assert finding.shape is not None
        assert finding.shape.over is Coordinate.SPEED
    else:
        assert answer.verdict is Verdict.UNEXPLAINED or answer.dataset.force_noise > 0.0


@pytest.mark.parametrize(
    ("seed", "rate", "terms"),
    cases([(1, RATE)], [(s, r) for s in (2, 3, 4) for r in (1e3, 4e3, 10e3)]),
)
def test_nothing_is_named_where_nothing_is_planted(seed, rate, terms):
    machine = drawn(np.random.default_rng(seed), rate)
    assert diagnosed(STAGE, machine, seed, *terms).verdict is Verdict.NOTHING_MISSING


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_bumps_of_another_form_are_no_reason_to_name_another_effect(seed):
    machine = drawn(np.random.default_rng(seed), bump=gaussian)
    assert diagnosed(STAGE, machine, seed).best is None


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_bumps_that_let_go_at_rest_are_told_as_bumps_of_another_shape(seed):
    machine = drawn(np.random.default_rng(seed), RATE, bump=gaussian).having(turn=0.0)
    answer = diagnosed(STAGE, machine, seed)
    assert answer.best is None
    if not answer.base.at_floor:
        assert answer.verdict is Verdict.WRONG_SHAPE
        assert [f.effect for f in answer.findings] == ["roller_spikes"]


@pytest.mark.slow
@pytest.mark.parametrize("seed", [200, 203])  # 204 is unexplained
def test_friction_that_varies_along_the_track_differently_each_way_is_told(seed):
    """And with those curves the error on a log that chose nothing falls.

    The mean of both directions is a force of position, which a cable slab can be as well.
    """
    rng = np.random.default_rng(seed)
    machine = drawn(rng, 2e3)
    for row, place in zip((AHEAD, BEHIND), rng.uniform(-0.1, 0.1, 2), strict=True):
        machine = machine.plus(row, 0.03 * gaussian(PLACE - place, 0.05))
    answer = diagnosed(STAGE, machine, seed)
    assert answer.verdict is Verdict.WRONG_SHAPE
    assert {f.effect for f in answer.findings} == {"lugre", "cable_slab"}
    (friction,) = (f for f in answer.findings if f.effect == "lugre")
    assert friction.shape is not None
    assert set(friction.shape.curves) == {"forwards", "backwards"}

    logs, held = logs_of(machine, seed, 10.0)
    better = workflow.fit(STAGE, logs).model
    without = better
    for finding in answer.findings:
        better = workflow.add_shape(CATALOGUE[finding.effect], better, logs, held).model
    before, after = (
        workflow.compare(m, {"test": run(machine, 77_000 + seed, 10.0)}).axes["x"].total_error
        for m in (without, better)
    )
    assert after < 0.6 * before


@pytest.mark.slow
def test_a_hysteresis_that_leaves_no_dry_friction_may_be_one():
    """Slip elements of the friction are to the motion what those of a cable would be."""
    machine = drawn(np.random.default_rng(1), 2e3)
    machine.tables[[FORCE, AHEAD, BEHIND]] = 0.0
    machine = machine.having(kind=SLIP_ELEMENTS, Fc=1.1, Fs=1.1, s2=1.1)
    axis = STAGE.axes["x"]
    friction = Fitted.at_start(CATALOGUE["coulomb_viscous"])
    model = STAGE.with_axis("x", replace(axis, effects=(friction,)))
    tried = Catalogue([*RIVALS.values(), CATALOGUE["gms"], CATALOGUE["stribeck"]])
    answer = diagnosed(model, machine, 1, 8.0, tried)
    assert "gms" in answer.answers[0]
