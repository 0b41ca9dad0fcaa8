"""A parameter at its bound is named, and no number is no convergence."""

from dataclasses import replace

import numpy as np
from constructed import effect, held, log_of, waves, windowed

from identify.dataset.motion import motion_of
from identify.estimation.fit import Fit, Outcome, fit_axis
from identify.estimation.least_squares import minimise
from twin.model.machine import AxisModel, Fitted

RATE = 2000.0  # Hz
PLACE = waves((0.03, 1.3, 0.4), (0.006, 5.1, 1.0))


def fitted_viscous(viscous: float, seed: int) -> Fit:
    """A fit of Coulomb and viscous friction to a motion with that viscous friction, N s/m."""
    t = np.arange(8000) / RATE
    s = t + 0.5 / RATE
    speed, acceleration = PLACE(s + 1e-4) - PLACE(s - 1e-4), PLACE(s + 1e-4) - 2.0 * PLACE(s)
    speed, acceleration = speed / 2e-4, (acceleration + PLACE(s - 1e-4)) / 1e-8
    force = 1.7 * acceleration + 0.4 * np.sign(speed) + viscous * speed
    force += np.random.default_rng(seed).normal(0.0, 0.02, len(t))
    log = windowed(motion_of(log_of(RATE, PLACE(t), force), "x", "log", ripples=()))
    axis = AxisModel(1.7, effects=(effect("coulomb_viscous", {"Fc": 0.3, "sigma2": 0.1}),))
    return fit_axis(axis, [log])


def test_a_parameter_that_the_data_push_beyond_its_bound_is_named():
    found = fitted_viscous(-0.5, 1)
    assert found.ended is Outcome.AT_BOUND
    assert found.at_bound == ("coulomb_viscous.sigma2",)
    assert found.axis["coulomb_viscous"].values["sigma2"] == 0.0


def test_a_strength_that_is_truly_zero_is_not_at_its_bound():
    for seed in range(3):
        found = fitted_viscous(0.0, seed)
        assert found.ended is Outcome.CONVERGED
        assert found.at_bound == ()


def test_a_bound_that_the_model_tightens_is_told_on_either_side():
    log = windowed(motion_of(log_of(RATE, *pushed_by(0.5)), "x", "log"))
    pull = effect("constant_force")
    for low, high, told in ((-1.0, 0.2, True), (-1.0, 0.6, False), (-2.0, -1.0, True)):
        p = replace(pull.effect.parameters[0], lower=low, upper=high, start=high, strength=False)
        bounded = replace(pull.effect, parameters=(p,))
        found = fit_axis(
            AxisModel(1.7, effects=(Fitted(bounded, {"F0": low}, frozenset()),)), [log]
        )
        assert found.at_bound == (("constant_force.F0",) if told else ()), (low, high)
        assert (found.ended is Outcome.AT_BOUND) == told


def pushed_by(constant: float) -> tuple[np.ndarray, np.ndarray]:
    """Positions and logged forces of a mass of 1.7 kg under a constant force beside them, N."""
    t = np.arange(4000) / RATE
    force = waves((3.0, 2.7, 0.3))(t)
    return held(force + constant, 1.7, 1.0 / RATE), force


def test_no_number_is_no_convergence():
    for start, residual_of in ((np.nan, lambda x: x), (1.0, lambda x: x + np.inf)):
        found = minimise(
            residual_of, lambda x: np.eye(1), np.array([start]), (-np.ones(1), np.ones(1)),
            tolerance=1e-9, most_evaluations=9,
        )  # fmt: skip
        assert not found.converged
