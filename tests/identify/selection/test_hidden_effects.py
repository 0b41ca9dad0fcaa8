"""An effect that the analysis is not told of is named; nothing is named where nothing is hidden."""

from dataclasses import replace

import numpy as np
import pytest
from check_cases import with_axis
from machines import DURATION, machine, one_axis

from identify.selection.diagnosis import Verdict
from identify.workflow import add, diagnose
from twin.effects import Catalogue, load_catalogue
from twin.model.file import load_model

CATALOGUE = load_catalogue()
STAGE = one_axis(load_model("proton_xy", CATALOGUE))
FLOOR = 1e-3  # N, about the noise floor of these logs

SLOW = pytest.mark.slow
HIDDEN = (
    "cogging",
    "asymmetric_friction",
    "position_dependent_friction",
    "quadratic_drag",
    "actuator_delay",
)


WEAK, STRONG = 5.0 * FLOOR, 40.0 * FLOOR
LATER = [pytest.param(seed, 8.0, marks=SLOW) for seed in (15, 16, 17)]


@SLOW  # the README's loop in small and the self-test in small show it too
def test_a_hidden_effect_is_named_among_a_few():
    few = Catalogue([CATALOGUE[n] for n in ("cogging", "quadratic_drag")])
    assert_named("cogging", STRONG, few, 5.0, replace(STAGE, sample_rate=2500.0))


@SLOW
@pytest.mark.parametrize("force", [WEAK, STRONG])
@pytest.mark.parametrize("effect", HIDDEN)
def test_a_hidden_effect_is_named_first_and_adding_it_reaches_the_noise_floor(effect, force):
    assert_named(effect, force, CATALOGUE, DURATION, STAGE)


def assert_named(effect, force, catalogue, duration, stage):
    seed = 1 + HIDDEN.index(effect)
    hidden = machine(stage, CATALOGUE, effect, force, seed, duration)
    found = diagnose(stage, hidden.logs, hidden.holdout, catalogue=catalogue)
    # A weak delay and a weak lag look alike in this motion; then both are named.
    assert found.leading.verdict is Verdict.MISSING_EFFECTS
    assert found.effect is not None
    assert effect in (found.effect.name, *found.leading.ambiguous_with)
    if found.leading.verdict is Verdict.MISSING_EFFECTS:
        assert found.effect.name == effect
    added = add(found.effect, found.model, hidden.logs, hidden.holdout)
    assert added.kept
    assert added.step.holdout_error_after < 1.5 * added.candidate.fit.floor
    if force == STRONG:  # below, the drift of half a second hardly shows the force
        assert added.position_error[1] < 0.5 * added.position_error[0]


@SLOW  # the self-test in small has one such machine
@pytest.mark.parametrize("seed", [11, 12, 13])
def test_nothing_is_named_where_nothing_is_hidden(seed):
    honest = machine(STAGE, CATALOGUE, None, 0.0, seed)
    found = diagnose(STAGE, honest.logs, honest.holdout, catalogue=CATALOGUE)
    assert found.leading.verdict is Verdict.NOTHING_MISSING
    assert found.effect is None


@pytest.mark.parametrize(
    ("seed", "duration"),
    [pytest.param(14, 6.0, marks=SLOW), pytest.param(14, 12.0, marks=SLOW), *LATER],
)
def test_a_force_channel_of_another_machine_is_not_a_weak_motor(seed, duration):
    """With a motor that gives nothing all forces are zero, and so is the error.

    In the first case a dead zone is wider than all that the held-out log asks for.
    """
    honest = machine(STAGE, CATALOGUE, None, 0.0, seed, duration=duration)
    mixed = {name: _backwards(log) for name, log in honest.logs.items()}
    held = {name: _backwards(log) for name, log in honest.holdout.items()}
    few = Catalogue([CATALOGUE[n] for n in ("actuator_deadband", "actuator_saturation")])
    found = diagnose(STAGE, mixed, held, catalogue=few).leading
    assert found.verdict is Verdict.UNEXPLAINED
    for candidate in found.ranking:  # the evidence is of errors over what the motor still gives
        fit, base = candidate.fit, found.base
        wanted = 2.0 * np.log(base.error / base.lessened / (fit.error / fit.lessened))
        assert candidate.evidence.log_gain == pytest.approx(wanted, abs=0.1)


def _backwards(log):
    """The log with its force in reverse order."""
    return with_axis(log, "x", lambda c: {**c, "force": c["force"][::-1].copy()})
