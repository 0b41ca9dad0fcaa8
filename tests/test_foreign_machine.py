"""Logs of a second simulator, which shares no law with the product: the right name, or none."""

import numpy as np
import pytest
from foreign_effects import INSIDE, OUTSIDE
from foreign_machine import drawn, gaussian
from foreign_study import STAGE, diagnosed, model_for

from identify.diagnose import Verdict

SLOW = pytest.mark.slow
SEED = 5


def found(planted, size, seed=SEED):
    """The diagnosis of a machine with that effect."""
    base = drawn(np.random.default_rng(seed))
    return diagnosed(
        model_for(planted), planted.make(base, size, np.random.default_rng(seed)), seed
    )


NAMED = [("cogging", 0.01), ("thermal_drift", 0.2)]
SLOWLY_NAMED = [
    ("quadratic_drag", 0.05), ("position_dependent_friction (slope)", 0.2),
    ("asymmetric_friction", 0.1), ("cable_hysteresis", 0.1), ("force_constant_ripple", 0.01),
    ("roller_spikes", 0.05),
]  # fmt: skip
OTHER = [("saturating drag", 0.1)]
SLOWLY_OTHER = [("random walk", 0.03), ("force step in time", 0.05), ("one bump", 0.05)]


def cases(quick, slow):
    return [*quick, *(pytest.param(*case, marks=SLOW) for case in slow)]


@pytest.mark.parametrize(("effect", "size"), cases(NAMED, SLOWLY_NAMED))
def test_an_effect_of_the_catalogue_is_named_whatever_its_form(effect, size):
    answer = found(INSIDE[effect], size)
    assert answer.best is not None
    assert answer.best.effect.name in INSIDE[effect].right


@pytest.mark.parametrize(("effect", "size"), cases(OTHER, SLOWLY_OTHER))
def test_an_effect_of_no_catalogue_is_not_given_a_name(effect, size):
    assert found(OUTSIDE[effect], size).verdict is Verdict.UNEXPLAINED


@pytest.mark.parametrize("seed", [1, *(pytest.param(s, marks=SLOW) for s in range(2, 8))])
@pytest.mark.parametrize("rate", [10e3, *(pytest.param(r, marks=SLOW) for r in (4e3, 1e3))])
def test_nothing_is_named_where_nothing_is_planted(seed, rate):
    machine = drawn(np.random.default_rng(seed), rate)
    assert diagnosed(STAGE, machine, seed).verdict is Verdict.NOTHING_MISSING


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_bumps_of_another_form_are_no_reason_to_name_another_effect(seed):
    machine = drawn(np.random.default_rng(seed), bump=gaussian)
    assert diagnosed(STAGE, machine, seed).best is None
