"""Machines of the self-test: which are drawn, what is planted in them, and how they are logged."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from built_fits import HARDWARE, PLAIN, fitted
from machines import CATALOGUE

from benchmarks.selftest.design import (
    DEVELOPMENT,
    FIRST_RELEASE,
    FULL,
    QUICK,
    STRONG,
    WEAK,
    Design,
    plantable,
    release_seed,
)
from benchmarks.selftest.laws import OUTSIDE
from benchmarks.selftest.machines import (
    STAGE as STANDARD,
)
from benchmarks.selftest.machines import (
    Case,
    NotShown,
    Setting,
    machine,
    own_error,
    parse_case,
    plain_friction,
    prepared,
)
from benchmarks.selftest.trial import run
from benchmarks.selftest.variations import VARIATIONS
from identify.estimation.fit import fit_axis
from twin.effect import Kind
from twin.effects import Catalogue
from twin.errors import InputError
from twin.logs import Log
from twin.model.file import load_model
from twin.model.machine import AxisModel, MachineModel

LUGRE = fitted("lugre", Fc=0.27, Fs=0.35, sigma2=0.021)
STAGE = MachineModel("s", {"x": AxisModel(5.3, HARDWARE, (LUGRE,)), "y": PLAIN}, 1000.0)


def built(*names: str, strength: float = 5.0, variation: str = "plain", seed: int = 3):
    effects = [CATALOGUE[name] for name in names]
    return machine(STAGE, effects, strength, variation, np.random.default_rng(seed), 3.0)


def test_the_plain_friction_is_the_simplest_at_the_level_of_the_stages_own():
    found = plain_friction(STAGE, CATALOGUE["gms"])
    assert found.effect.name == "coulomb_viscous"
    assert (found.values["Fc"], found.values["sigma2"]) == (0.27, 0.021)
    assert found.values["Fs"] == CATALOGUE["coulomb_viscous"].parameter("Fs").start  # held
    with pytest.raises(NotShown):
        plain_friction(STAGE, CATALOGUE["coulomb_viscous"])


def same(one: Log, other: Log) -> bool:
    return np.array_equal(one.axes["x"].position, other.axes["x"].position)


def test_a_machine_is_logged_for_training_selection_and_test():
    found, again, empty = built("cogging"), built("cogging"), built()
    assert [list(found.logs), list(found.holdout), list(found.test)] == [
        ["log 1", "log 2"], ["log 3"], ["log 4"],
    ]  # fmt: skip
    every = {**found.logs, **found.holdout, **found.test}
    runs = [log.metadata["experiment"].split()[0] for log in every.values()]
    assert runs == ["tracking", "moves", "tracking", "moves"]
    assert not same(every["log 1"], every["log 3"])
    assert all(same(log, again.logs[name]) for name, log in found.logs.items())
    assert list(found.model.axes) == ["x"]
    assert found.true.axes["y"] != STAGE.axes["y"]  # drawn
    assert (empty.planted, empty.model.axes["x"]) == ((), STAGE.axes["x"])
    assert 0.0 < abs(empty.true.axes["x"].mass / STAGE.axes["x"].mass - 1.0) < 0.1


@pytest.mark.slow
@pytest.mark.parametrize("strength", [2.0, 6.0])
def test_an_effect_has_the_strength_that_was_asked_beyond_what_the_model_takes_over(strength):
    """In noise floors, which are what the machine's own laws leave."""
    found = built("cogging", strength=strength)
    dataset = prepared(found, strength)
    own = own_error(found.true.axes["x"], dataset.training)
    assert found.true.axes["x"].names == ("lugre", "cogging")
    left = fit_axis(found.model.axes["x"], dataset.training).error
    assert np.sqrt(left**2 - own**2) / own == pytest.approx(strength, rel=0.2)
    with pytest.raises(NotShown, match="cogging"):
        prepared(found, 4.0 * strength)


@pytest.mark.slow
def test_a_mass_that_would_hide_an_effect_was_weighed():
    found = built("payload_mass")
    assert found.model.axes["x"].mass_fixed
    assert found.model.axes["x"].mass == found.true.axes["x"].mass
    with pytest.raises(NotShown, match="actuator_saturation"):
        built("actuator_saturation", strength=1e6)


@pytest.mark.slow
def test_a_friction_is_planted_first_and_scaled_until_the_model_falls_short():
    found = built("cogging", "gms")
    assert [f.effect.name for f in found.planted] == ["gms", "cogging"]
    assert found.true.axes["x"].names == ("gms", "cogging")
    assert found.model.axes["x"].names == ("coulomb_viscous",)
    level = found.planted[0].values["Fc"] / LUGRE.values["Fc"]
    assert 0.1 * 0.8 <= level <= 10.0 * 1.2  # of the machine's own, which is drawn
    dataset = prepared(found, 5.0)
    true = found.true.axes["x"]
    own = own_error(true, dataset.training)
    simple = fit_axis(true.with_effect(plain_friction(STAGE, true["gms"].effect)), dataset.training)
    assert np.sqrt(simple.error**2 - own**2) > 0.5 * 5.0 * own


# --- trials ----------------------------------------------------------------------------------


def in_small(*rivals: str) -> Setting:
    """Logs of 4 s at a low rate, and these effects beside the stage's own."""
    stage = load_model(STANDARD, CATALOGUE)
    own = {n for axis in stage.axes.values() for n in axis.names}
    few = Catalogue([e for n, e in CATALOGUE.items() if n in own.union(rivals)])
    return Setting(replace(stage, sample_rate=2500.0), few, 4.0)


@pytest.mark.slow
def test_trials_in_small_name_what_is_planted_and_nothing_else():
    # Twenty times the floor: far above what a log of 4 s needs, so any seed will do.
    case = Case(("quadratic_drag",), 20.0, 1)
    hidden = run(case, in_small("cogging", "quadratic_drag", "coulomb_viscous", "wear"))
    assert hidden.right
    assert hidden.left < 1.3 < 5.0 < hidden.ratio
    assert hidden.tested > 0.8  # noise is left on any log
    assert hidden.held
    unknown = run(replace(case, known=False), in_small("quadratic_drag"))
    assert unknown.shown
    assert not unknown.named


# --- which machines --------------------------------------------------------------------------


def test_a_design_makes_the_same_cases_from_the_same_seed_only():
    drawn = Design(empty=9, strong=90, weak=60, outside=11, pairs=6, left_out=5)
    made = drawn.cases(5)
    assert made == drawn.cases(5)
    assert not set(made) & set(drawn.cases(6))
    assert len(set(made)) == len(made) == 9 + 90 + 60 + 11 + 6 + 5
    names = set(plantable(CATALOGUE))
    assert "lugre" not in names
    assert not any(CATALOGUE[n].is_nonparametric for n in names)
    empty = [c for c in made if not c.effects]
    assert [(c.strength, c.known) for c in empty] == [(0.0, True)] * 9
    assert {c.variation for c in empty} == set(VARIATIONS)  # in turn
    inside = [c for c in made if len(c.effects) == 1 and c.known and c.effects[0] in names]
    for strength, count in ((STRONG, 90), (WEAK, 60)):
        own = [c.effects[0] for c in inside if c.strength == strength]
        assert len(own) == count
        assert set(own) == names  # in turn
    outside = [c.effects[0] for c in made if c.effects and c.effects[0] in OUTSIDE]
    assert (len(outside), set(outside)) == (11, set(OUTSIDE))
    assert sum(len(c.effects) == 2 for c in made) == 6
    assert sum(not c.known for c in made) == 5


def test_a_quick_design_and_the_full_one():
    quick, full = QUICK.cases(1), FULL.cases(1)
    assert len(quick) == 10  # two minutes of one core at twelve seconds each
    assert 200 < len(full) <= 300  # half an hour of two cores
    assert {c.variation for c in full} == set(VARIATIONS)


def test_development_and_release_are_drawn_apart():
    assert release_seed() != DEVELOPMENT
    assert release_seed() >= FIRST_RELEASE > DEVELOPMENT
    assert not set(FULL.cases(release_seed())) & set(FULL.cases(DEVELOPMENT))


def test_two_frictions_are_never_planted_together():
    frictions = [n for n in plantable(CATALOGUE) if CATALOGUE[n].kind is Kind.FRICTION]
    assert len(frictions) > 2
    alone = Design(pairs=3).cases(1, frictions)
    assert not any(len(c.effects) == 2 for c in alone)
    mixed = Design(pairs=40).cases(1, [*frictions, "wear"])
    pairs = [c.effects for c in mixed if len(c.effects) == 2]
    assert len(pairs) == 40
    assert all("wear" in pair for pair in pairs)


def test_a_design_plants_every_physical_effect_the_stage_lacks():
    catalogue, axis = CATALOGUE, load_model(STANDARD, CATALOGUE).axes["x"]
    described = [n for n, e in catalogue.items() if e.is_nonparametric]
    # A second name of what the stage has or is offered: spring, hysteresis, viscous; and gravity.
    # What reads a channel no simulation has.
    unfit = [
        n for n, e in catalogue.items()
        if n not in axis.names and (e.channels or not axis.can_have(e))
    ]  # fmt: skip
    assert sorted([*plantable(catalogue), *axis.names, *described, *unfit]) == list(catalogue)
    assert not {"spring", "presliding_hysteresis"} & set(plantable(catalogue))
    assert "cable_hysteresis" in plantable(catalogue)


# --- a machine's name ------------------------------------------------------------------------


@pytest.mark.parametrize(
    "case",
    [
        Case((), 0.0, 3), Case(("a_b",), 2.5, 1 << 30, "bumps"),
        Case(("a", "b"), 5.0, 7, "plain", known=False),
    ],
    ids=str,
)  # fmt: skip
def test_the_name_of_a_machine_makes_it_again(case) -> None:
    assert parse_case(str(case), {"a", "a_b", "b"}, {"plain", "bumps"}) == case


@pytest.mark.parametrize("text", ["a", "a@5/plain", "c@5/plain/1", "a@5/dull/1", "a@5/plain/1/in"])
def test_a_name_that_is_none_is_one_line(text) -> None:
    with pytest.raises(InputError) as error:
        parse_case(text, {"a"}, {"plain"})
    assert text in str(error.value)
    assert "\n" not in str(error.value)
