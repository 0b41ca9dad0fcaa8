"""Which logs say something of an axis, by what else is known of it, and how much they must say."""

from __future__ import annotations

import logging
from dataclasses import replace

import numpy as np
import pytest
from constructed import log_of
from planted_logs import RATE, RUBS, SLIDE, Ride, few, having, logged

from identify import adding, workflow
from identify.dataset.preparation import datasets
from identify.dataset.prepared_log import moving
from identify.dataset.spectrum import fitted_levels
from identify.estimation.intervals import NotExcited
from identify.estimation.offered import RestsTooOften, not_tried, offered
from twin.errors import InputError
from twin.logs import ROTARY_UNITS, AxisLog, Log
from twin.logs.log import LINEAR_UNITS
from twin.model.machine import AxisModel, MachineModel
from twin.signals import white_noise

RUBBED = MachineModel("m", {"x": SLIDE}, RATE)
BARE = MachineModel("m", {"x": replace(SLIDE, effects=())}, RATE)
T = np.arange(4000) / RATE


def jogs(seconds: float, noise: float = 5e-3) -> Log:
    """Moves of so many seconds, of the slide, with a rest of 0.3 s after each; noise: N."""
    place = T % (seconds + 0.3)
    way = 1.0 - 2.0 * (T // (seconds + 0.3) % 2.0)
    speed = np.where(place < seconds, 0.1 * way * np.sin(np.pi * place / seconds) ** 2, 0.0)
    force = 5.3 * np.gradient(speed, T) + 0.31 * np.sign(speed) + 0.53 * speed
    rng = np.random.default_rng(1)
    return log_of(RATE, np.cumsum(speed) / RATE, force + noise * rng.standard_normal(len(T)))


def refused(call, *given, **options) -> str:
    with pytest.raises(InputError) as error:
        call(*given, **options)
    assert "\n" not in str(error.value)
    return str(error.value)


# How much logs must say


@pytest.mark.parametrize("power", [np.zeros(50), np.r_[np.zeros(40), np.ones(10)]])
def test_a_spectrum_without_power_has_noise_of_no_level(power):
    shapes = np.stack([np.ones(50), np.linspace(0.0, 1e9, 50)], axis=1)
    assert fitted_levels(shapes, power) == pytest.approx(np.zeros(2), abs=1e-12)


def test_a_signal_too_short_to_show_noise_shows_none():
    assert white_noise(np.array([1.0, 2.0])) == 0.0


@pytest.mark.parametrize("seconds", [0.35, 0.2])
def test_a_log_without_noise_has_the_floor_of_its_numbers(seconds):
    fit = workflow.fit(RUBBED, {"run": jogs(seconds, noise=0.0)}).fits["x"]
    assert 0.0 < fit.floor < 1e-4
    assert np.isfinite(fit.ratio)
    assert fit.axis.mass == pytest.approx(5.3, rel=0.01)


def test_logs_that_say_no_more_numbers_than_are_free_are_refused():
    """A fit would leave nothing of them, and give each value without any doubt."""
    few_rows = {"run": log_of(RATE, *(c[:900] for c in jogs(0.35).axes["x"].columns.values()))}
    told = refused(workflow.fit, RUBBED, few_rows, test_function=0.3)
    assert told.startswith("run: axis x moves throughout 1 of the test functions of 0.3 s")
    assert "too few for 3 free parameters; give a log in which it moves for longer" in told
    held = RUBBED.with_axis("x", replace(SLIDE, mass_fixed=True))
    assert "for 2 free parameters" in refused(workflow.fit, held, few_rows, test_function=0.3)
    assert workflow.fit(BARE, few_rows, test_function=0.3).fits["x"].error > 0.0
    assert workflow.compare(RUBBED, few_rows, test_function=0.3)  # to which nothing is fitted


def test_a_value_that_may_be_far_beyond_the_machine_has_no_interval():
    creeping = log_of(RATE, 0.01 * T, 0.3 + 5e-3 * np.random.default_rng(2).standard_normal(len(T)))
    found = {e.label: e for e in workflow.fit(RUBBED, {"run": creeping}).estimates["x"]}
    assert found["mass"].reason == NotExcited()


# What an axis that rests within every test function says


RESTING = {"rests": jogs(0.05)}
LENGTH = 0.1  # s, longer than a move of these


def test_a_friction_that_sticks_is_not_added_where_the_axis_always_rests():
    told = refused(adding.add, "coulomb_viscous", BARE, RESTING, test_function=LENGTH)
    assert told.startswith("rests: axis x comes to rest within every test function of 0.1 s")
    both = {"rests": RESTING["rests"], "run": logged(SLIDE, Ride(3, 4.0))}
    added = adding.add("coulomb_viscous", BARE, both, test_function=LENGTH)
    assert added.model.axes["x"]["coulomb_viscous"].values["Fc"] == pytest.approx(0.31, rel=0.05)


def test_nor_is_it_tried_and_the_answer_says_so():
    catalogue = few("coulomb_viscous", "quadratic_drag")
    found = workflow.diagnose(BARE, RESTING, catalogue=catalogue, test_function=LENGTH)
    assert found.not_tried == {"x": {"coulomb_viscous": RestsTooOften()}}
    (note,) = [line for line in str(found).splitlines() if "not tried" in line]
    assert "coulomb_viscous, as the axis comes to rest within nearly every test function" in note


@pytest.mark.parametrize("role", ["holdout", "test"])
def test_such_a_log_tests_no_friction(caplog, role):
    with caplog.at_level(logging.WARNING, "identify"):
        found = workflow.diagnose(
            BARE, {"run": logged(SLIDE, Ride(3, 4.0))}, **{role: RESTING},
            catalogue=few("coulomb_viscous", "quadratic_drag"), test_function=LENGTH,
        )  # fmt: skip
    assert found.leading.named == ("coulomb_viscous",)
    assert "rests is left out: axis x comes to rest within" in caplog.text
    assert "nan" not in str(found)


# What a motion without force says


def coasting() -> Log:
    """The slide, thrown and let go of: its friction alone brakes it."""
    x, v, position = 0.0, 0.4, []
    for _ in T[:3000]:
        position.append(x)
        v -= (0.31 + 0.53 * v) / SLIDE.mass / RATE
        x += v / RATE
    noise = 1e-9 * np.random.default_rng(4).standard_normal(len(position))
    return log_of(RATE, np.array(position) + noise, np.zeros(len(position)))


def test_without_force_a_mass_that_is_held_shows_the_friction_and_one_that_is_free_nothing():
    told = refused(workflow.fit, RUBBED, {"coasts": coasting()})
    assert "coasts: the force of axis x is 0 N throughout" in told
    assert told.endswith("or hold the mass (fixed) where the axis coasts")
    held = RUBBED.with_axis("x", replace(SLIDE, mass_fixed=True, effects=(RUBS,)))
    found = workflow.fit(held, {"coasts": coasting()}).model.axes["x"]["coulomb_viscous"].values
    assert found["Fc"] == pytest.approx(0.31, rel=0.05)
    assert found["sigma2"] == pytest.approx(0.53, rel=0.05)


@pytest.mark.parametrize("role", ["logs", "holdout", "test"])
def test_a_log_that_is_too_short_is_left_out_of_any_role(caplog, role):
    given = {"logs": {"run": logged(SLIDE, Ride(3, 2.0))}, "holdout": {}, "test": {}}
    short = jogs(0.35).part(0, 400)
    given[role] = {**given[role], "short": short}
    with caplog.at_level(logging.WARNING, "identify"):
        found = workflow.fit(RUBBED, *given.values())
    assert list(found.left_out["x"]) == ["short"]
    assert "short is left out: it lasts 0.4 s, and identification needs 0.5 s" in caplog.text


# Where a log that tests a fit must lie


def turned(rate: float, begun: float, units) -> Log:
    """An axis that goes ahead at a mean rate and swings about it, from a place on; with noise."""
    noise = np.random.default_rng(round(1e3 * begun)).standard_normal((2, len(T)))
    place = begun + rate * T + 0.4 * np.sin(5.0 * T) + 1e-6 * noise[0]
    force = np.sign(rate + 2.0 * np.cos(5.0 * T)) - 10.0 * np.sin(5.0 * T) + 1e-3 * noise[1]
    return Log(RATE, {"x": AxisLog({"position": place, "force": force}, units)})


@pytest.mark.parametrize(
    ("rate", "units", "outside"),
    [(6.0, ROTARY_UNITS, False), (0.0, ROTARY_UNITS, True), (6.0, LINEAR_UNITS, True)],
)
def test_after_a_whole_turn_a_shaft_that_turns_round_is_where_it_was(rate, units, outside):
    """And not one that swings, nor an axis that is no shaft."""
    axis = AxisModel(1.0, effects=(RUBS,), rotary=units is ROTARY_UNITS)
    held = {"near": turned(rate, 0.1, units), "far": turned(rate, 12.0 if rate else 0.7, units)}
    run = {"run": turned(rate, 0.0, units)}
    dataset = datasets(MachineModel("m", {"x": axis}, RATE), run, held)["x"]
    assert bool(dataset.beyond) is outside


@pytest.mark.parametrize("held", [False, True])
def test_mass_more_or_less_is_asked_for_where_the_mass_is_held(held: bool) -> None:
    """Else it is the mass, which is fitted; beside a body on a spring it would be part of that."""
    axis = replace(SLIDE, mass_fixed=held)
    model = MachineModel("m", {"x": axis}, RATE)
    dataset = datasets(model, {"run": logged(SLIDE, Ride(5, 4.0))}, {})["x"]
    known = few("payload_mass", "spring")
    assert set(offered(axis, dataset, known)) == (
        {"payload_mass", "spring"} if held else {"spring"}
    )
    assert not not_tried(model, dataset, known)


def test_what_acts_through_a_mass_is_not_tried_on_imposed_motion_and_the_answer_says_so():
    rig = MachineModel("rig", {"x": AxisModel(0.0, effects=(RUBS,))}, RATE)
    light = replace(SLIDE, mass=1e-9)
    runs = {"run": logged(having(light, "quadratic_drag", c=3.0), Ride(5, 4.0))}
    catalogue = few("coulomb_viscous", "load_dependent_friction", "payload_mass", "quadratic_drag")
    found = workflow.diagnose(rig, runs, catalogue=catalogue)
    assert set(found.not_tried["x"]) == {"load_dependent_friction", "payload_mass"}
    (note,) = [line for line in str(found).splitlines() if "not tried" in line]
    assert "load_dependent_friction, payload_mass, as each acts through the motor" in note
    assert "mass = 0 kg says that the motion is imposed" in note


@pytest.mark.parametrize(
    ("hertz", "rest", "least", "most"), [(30.0, 0.0, 0.7, 1.0), (3.0, 0.5, 0.0, 0.2)]
)
def test_an_axis_that_swings_does_not_stand_and_one_that_pauses_does(hertz, rest, least, most):
    """A swing comes back within each test function; a pause of 50 ms at each turn is in each."""
    rng = np.random.default_rng(1)
    height = 1.0 + 0.5 * np.sin(0.5 * T)
    swing = height * np.sin(2.0 * np.pi * hertz * T)
    place = 1e-3 * np.where(np.abs(swing) > rest, swing, 0.0)
    log = log_of(RATE, place + 1e-5 * rng.standard_normal(len(T)), rng.standard_normal(len(T)))
    (logged,) = datasets(BARE, {"log": log}, {})["x"].training
    assert least <= moving([logged], sticks=True).mean() <= most
