"""Laws with memory follow the path of an axis, not the noise of its readings."""

import numpy as np
import pytest
from machines import CATALOGUE

from benchmarks.presliding import NOISE, drawn
from benchmarks.second_simulator.contacts import DAHL, Contact, log_of
from identify.dataset.noise_floor import floor_of
from identify.dataset.path import Path
from identify.dataset.preparation import datasets
from identify.estimation.fit import Outcome, finished
from identify.workflow import compare, fit
from twin.model.machine import AxisModel, Fitted, MachineModel

STIFFNESS, LEVEL, MASS, REACH = 2e6, 8.0, 5.0, 4e-6  # N/m, N, kg, m


def logged_by_steps(step, seed):
    """The same moves, read by an encoder with steps (m) and hardly any noise."""
    noisy = Contact(
        DAHL, MASS, LEVEL, LEVEL, STIFFNESS, 0.01, 0.0, 0.0, 0.02 * step, 90.0, 1000.0, (1.0,),
        (1.0,), step=step,
    )  # fmt: skip
    return {"run": log_of(noisy, np.random.default_rng(seed))}


def logged(noise, asymmetry=0.0, weight=0.0):
    """Moves with rests of a mass on a contact of 4 um, whose readings have noise, m rms.

    asymmetry: of the friction; weight: N, that the motor holds.
    """
    contact = Contact(
        DAHL, MASS, LEVEL, LEVEL, STIFFNESS, 0.01, 0.0, 0.0, noise, 90.0, 1000.0, (1.0,), (1.0,),
        asymmetry, weight,
    )  # fmt: skip
    return {"run": log_of(contact, np.random.default_rng(3))}


def dahl(stiffness, **beside):
    values = {"dahl": {"Fc": LEVEL, "sigma2": 0.0, "sigma0": stiffness}, **beside}
    own = tuple(Fitted.at_start(CATALOGUE[name], given) for name, given in values.items())
    return MachineModel("m", {"q": AxisModel(MASS, effects=own)}, 1000.0)


# Along the readings as they are 1.5, 3.6 and 3.3 N were left; the free run was 30 to 100 um off.
@pytest.mark.parametrize(("noise", "most"), [(0.0, 0.03), (1e-8, 0.35), (1e-7, 0.2), (5e-7, 0.2)])
def test_the_true_values_leave_little_whatever_the_noise_of_the_readings(noise, most):
    axis = compare(dahl(STIFFNESS), logged(noise), test_function=0.05).axes["q"]
    assert axis.total_error < most
    assert axis.position_error["run"] < 3e-5


# 0.21 to 0.44 N were left, and the contact was 10 to 21 % too soft: each turn of a step moved it.
@pytest.mark.parametrize(("step", "seed"), [(1e-7, 3), (2.5e-7, 4), (1e-6, 3)])
def test_the_steps_of_an_encoder_move_no_contact(step, seed):
    log = logged_by_steps(step, seed)
    assert compare(dahl(STIFFNESS), log, test_function=0.05).axes["q"].total_error < 0.12
    found = fit(dahl(STIFFNESS / 4.0), log).model.axes["q"]["dahl"].values
    assert found["sigma0"] == pytest.approx(STIFFNESS, rel=0.05)


def left(model, *logs):
    return compare(model, logged(*logs), test_function=0.05).axes["q"].total_error


# A motor that holds 500 N beside 8 N of friction had nothing balanced at rest: 0.80 N were left.
def test_a_weight_that_the_motor_holds_does_not_hide_what_the_contact_holds():
    heavy = dahl(STIFFNESS, constant_force={"F0": -500.0})
    assert left(heavy, 1e-7, 0.0, 500.0) == pytest.approx(left(dahl(STIFFNESS), 1e-7), rel=0.1)


# By the direction of each reading 0.33 and 0.67 N were left.
@pytest.mark.parametrize("noise", [1e-8, 1e-7])
def test_what_modifies_a_friction_follows_its_path(noise):
    asymmetric = dahl(STIFFNESS, asymmetric_friction={"coulomb": 0.3, "viscous": 0.0})
    assert left(asymmetric, noise, 0.3) < 1.3 * left(dahl(STIFFNESS), noise)


@pytest.mark.parametrize("noise", [0.0, 1e-8, 5e-7])
def test_what_the_true_values_leave_is_their_noise_floor_and_what_others_leave_is_not(noise):
    def of(stiffness):
        model = dahl(stiffness)
        (axis,), (dataset,) = model.axes.values(), datasets(model, logged(noise), {}, 0.05).values()
        return finished(axis, axis, dataset.training, Outcome.CONVERGED)

    assert of(STIFFNESS).at_floor
    assert of(0.01 * STIFFNESS).ratio > 100.0


@pytest.mark.slow
def test_the_floor_is_as_high_as_what_the_true_laws_of_drawn_contacts_leave():
    """By the path of every second reading alone the median was 0.6, and so much was hidden."""
    parts, still = [], 0
    for number, noise in enumerate(NOISE * 4):
        rng = np.random.default_rng([431, number])
        contact = drawn(DAHL, noise, rng)
        values = {"Fc": contact.coulomb, "sigma2": contact.viscous, "sigma0": contact.stiffness}
        law = Fitted.at_start(CATALOGUE["dahl"], values)
        model = MachineModel("m", {"q": AxisModel(contact.mass, effects=(law,))}, contact.rate)
        made = datasets(model, {"run": log_of(contact, rng)}, {}, 0.02)["q"]
        fit = finished(model.axes["q"], model.axes["q"], made.training, Outcome.CONVERGED)
        floor = floor_of(model.axes["q"], made.training)
        parts.append(fit.error / floor)
        still += fit.at_floor
    assert 0.7 < np.median(parts) < 1.25
    assert still >= 0.9 * len(parts)


def test_noise_does_not_soften_a_contact():
    found = fit(dahl(STIFFNESS / 4.0), logged(1e-7)).model.axes["q"]
    values = found["dahl"].values
    assert values["sigma0"] == pytest.approx(STIFFNESS, rel=0.05)
    assert values["Fc"] == pytest.approx(LEVEL, rel=0.01)
    assert found.mass == pytest.approx(MASS, rel=0.01)


def test_an_axis_that_stands_has_no_path_and_one_that_moves_all_of_it():
    noise, period, t = 1e-8, 1e-3, 1e-3 * np.arange(8001)
    rng = np.random.default_rng(1)
    still = Path(noise * rng.standard_normal(len(t)), 1, period, noise)
    travel = np.abs(still.velocity).sum() * period
    assert travel < 0.02 * np.abs(np.diff(still.readings)).sum()
    assert still.stands.mean() > 0.99
    swing = 100.0 * noise * np.sin(2.0 * np.pi * 60.0 * t)
    moving = Path(swing + still.readings, 1, period, noise)
    off = moving.velocity - np.diff(swing) / period
    assert np.abs(np.cumsum(off) * period).max() < 7.0 * noise
    assert not moving.stands.any()


def test_without_noise_the_path_is_that_of_the_readings():
    readings = np.cumsum(np.random.default_rng(2).standard_normal(1001)) * 1e-6
    path = Path(readings, 4, 1e-3, 0.0)
    np.testing.assert_allclose(path.velocity, np.diff(readings[::4]) / 4e-3, rtol=1e-9)
    assert not path.stands.any()
