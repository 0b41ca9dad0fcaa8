"""Laws of a fit: its solver, scaling, priors and bounds, and the search of an effect's shape."""

from __future__ import annotations

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from constructed import effect, fit_of, held, log_of, moved, waves, windowed

from identify.dataset.blocks import Blocks
from identify.dataset.motion import motion_of
from identify.dataset.prepared_log import moving
from identify.estimation.errors import error_on
from identify.estimation.fit import Fit, Outcome, at_bounds, finished, fit_axis, rms
from identify.estimation.force_balance import jacobian, residual
from identify.estimation.least_squares import minimise, orthonormal, unabsorbed
from identify.estimation.scaling import Scaling
from identify.rules import RULE
from twin.model.machine import AxisModel, Fitted
from twin.model.parameters import free_parameters, read

ODD = AxisModel(
    1.7,
    effects=(
        effect("lugre", {"Fc": 0.31, "Fs": 0.47, "v0": 0.013, "sigma2": 1.9, "sigma0": 700.0}),
        effect("cable_slab", {"offset": -0.2, "k1": 1.3}),
        effect("cogging", {"p": 0.021, "a1": 0.06}),
    ),
)


LOGS = [windowed(moved(np.random.default_rng(k), 1.5, 1000.0)) for k in (1, 2)]


@pytest.mark.slow
def test_a_fit_of_many_columns_holds_them_little_more_than_twice():
    """As they are and as its search follows them; with the rest that is 2.7 times."""
    logs = [windowed(moved(np.random.default_rng(k), 40.0, 1000.0)) for k in (1, 2)]
    friction = effect("coulomb_viscous", {"Fc": 0.41, "sigma2": 1.7})
    axis = AxisModel(1.7, effects=(friction, effect("empirical_map")))
    logs = [replace(log, command=log.command - residual(axis, [log])) for log in logs]
    fit_axis(axis, logs[:1])  # loads what is compiled
    tracemalloc.start()
    found = fit_axis(replace(axis, mass=1.9), logs)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 3.2 * found.jacobian.nbytes


def made_for(axis: AxisModel):
    logs = []
    for log in LOGS:
        found = residual(replace(axis), [log])
        logs.append(replace(log, command=log.command - found))
    return logs


def one_way(speed: float, seed: int):
    motion = moved(np.random.default_rng(seed), 1.5, 1000.0)
    signals = motion.signals.copy()
    signals[0] = speed * np.arange(signals.shape[1]) * motion.period
    signals[1] = speed
    return windowed(replace(motion, track=Blocks(signals, signals[1:])))


def test_what_the_data_cannot_separate_stays_small():
    """One way alone a constant force and an asymmetric friction are one force."""
    log = one_way(0.1, seed=4)
    pair = (effect("asymmetric_friction"), effect("constant_force"))
    axis = AxisModel(1.7, effects=(*ODD.effects[:1], *pair))
    log = replace(log, command=log.command - residual(axis, [log]) + 0.2)
    found = fit_axis(axis, [log]).axis
    friction = abs(found["lugre"].values["Fc"] - 0.31)
    assert abs(found["constant_force"].values["F0"]) + friction < 0.4
    assert abs(found["asymmetric_friction"].values["coulomb"]) < 1.0


def test_a_fit_finds_the_values_that_leave_nothing():
    """But for the shapes, which stay: a problem linear in what is free."""
    friction = effect("coulomb_viscous", {"Fc": 0.41, "Fs": 0.41, "sigma2": 1.7})
    cable = effect("cable_slab", {"offset": -0.3, "k1": 4.0, "k2": 20.0, "k3": 90.0})
    axis = AxisModel(1.7, effects=(replace(friction, fixed=friction.fixed | {"Fs"}), cable))
    logs = made_for(axis)
    off = replace(axis.effects[0], values={**friction.values, "Fc": 0.2, "sigma2": 0.4})
    begun = AxisModel(1.1, effects=(off, effect("cable_slab")))
    found = fit_axis(begun, logs)
    assert found.outcome is Outcome.CONVERGED
    where = free_parameters(axis)
    np.testing.assert_allclose(read(found.axis, where), read(axis, where), rtol=0.02)
    assert found.error < 1e-3
    assert found.begun is begun
    np.testing.assert_array_equal(found.kept, moving(logs, True))
    np.testing.assert_array_equal(found.residual, residual(found.axis, logs)[found.kept])
    np.testing.assert_array_equal(error_on(found.axis, logs), found.residual)
    assert fit_axis(begun, logs, 1).outcome is Outcome.NOT_CONVERGED
    nothing = fit_axis(AxisModel(1.7, mass_fixed=True), logs)
    assert nothing.outcome is Outcome.CONVERGED
    assert nothing.axis.mass == 1.7


def test_a_fit_is_at_its_floor_below_a_ratio():
    fit = fit_of(AxisModel(1.7), *LOGS)
    np.testing.assert_allclose(fit.jacobian, jacobian(fit.axis, LOGS, fit.scaling.where)[fit.kept])
    assert fit.error == pytest.approx(np.sqrt(np.mean(fit.residual**2)))
    for ratio, wanted in ((0.999, True), (1.001, False)):
        for sure in (1.0, 1.2):  # times that ratio, up to which this noise may reach
            most = RULE.at_floor * fit.floor * sure
            scaled = replace(fit, residual=fit.residual * ratio * most / fit.error)
            scaled.__dict__["noise"] = replace(fit.noise, most=most if sure > 1.0 else 0.0)
            assert scaled.at_floor is wanted
    assert np.isnan(rms(np.zeros(0)))
    assert fit.gain == 1.0
    assert finished(fit.axis, fit.axis, LOGS, Outcome.AT_BOUND).outcome is Outcome.AT_BOUND


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
    for low, high, told in (
        (-1.0, 0.2, True),
        (-1.0, 0.6, False),
        (-2.0, -1.0, True),
        (-1.0, 0.0, True),
    ):
        p = replace(pull.effect.parameters[0], lower=low, upper=high, start=high, strength=False)
        bounded = replace(pull.effect, parameters=(p,))
        found = fit_axis(
            AxisModel(1.7, effects=(Fitted(bounded, {"F0": low}, frozenset()),)), [log]
        )
        assert found.at_bound == (("constant_force.F0",) if told else ()), (low, high)
        assert (found.ended is Outcome.AT_BOUND) == told
        assert at_bounds(found, "constant_force") == (found.at_bound if high else ())  # absent
        assert at_bounds(found, "another") == ()


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

    # Laws of the scaling and of subspaces: a bijection, a projection


def test_inside_and_outside_undo_each_other():
    where = free_parameters(ODD)
    scaling = Scaling(where)
    inside = scaling.inside(ODD)
    np.testing.assert_allclose(read(scaling.outside(ODD, inside), where), read(ODD, where))
    value = dict(zip([c.label for c in where], inside, strict=True))
    assert value["mass"] == pytest.approx(np.log(1.7))
    assert value["lugre.Fs"] == pytest.approx(0.47 - 0.31)
    assert value["lugre.Fc"] == pytest.approx(0.31)
    assert value["cable_slab.offset"] == -0.2
    assert value["cogging.p"] == pytest.approx(np.log(0.021))
    rng = np.random.default_rng(3)
    low, high = scaling.bounds()
    assert (low <= inside).all()
    assert (inside <= high).all()
    for _ in range(20):
        drawn = np.clip(inside + rng.normal(0.0, 1.0, len(inside)), low, high)
        axis = scaling.outside(ODD, drawn)
        assert axis["lugre"].values["Fs"] >= axis["lugre"].values["Fc"]
        np.testing.assert_allclose(scaling.inside(axis), drawn, rtol=1e-9, atol=1e-9)
    for c, *ends, log in zip(where, low, high, scaling.is_logarithm(), strict=True):
        p = c.parameter
        bounds = [0.0, p.upper - p.lower] if p.name == "Fs" else [p.lower, p.upper]
        assert log == (p.lower > 0 and p.name != "Fs")
        np.testing.assert_allclose(ends, np.log(bounds) if log else bounds)


def test_the_chain_rule_is_the_difference_by_the_internal_variables():
    where = free_parameters(ODD)
    scaling = Scaling(where)
    inside = scaling.inside(ODD)
    a = np.random.default_rng(5).normal(size=(4, len(where)))

    def f(z):
        return a @ np.sin(read(scaling.outside(ODD, z), where))

    steps = 1e-6 * np.eye(len(where))
    wanted = np.stack([(f(inside + h) - f(inside - h)) / 2e-6 for h in steps], axis=1)
    columns = a * np.cos(read(ODD, where))
    kept = columns.copy()
    size = np.abs(wanted).max()
    np.testing.assert_allclose(scaling.chain(ODD, columns), wanted, atol=1e-4 * size)
    np.testing.assert_array_equal(columns, kept)


def test_variables_that_are_parameters_have_their_derivatives():
    where = free_parameters(ODD)
    scaling, labels = Scaling(where), np.array([c.label for c in where])
    itself = scaling.is_itself()
    assert {"cable_slab.offset", "cable_slab.k1", "cogging.a1"} <= set(labels[itself])
    assert not itself[np.isin(labels, ["mass", "lugre.Fc", "lugre.Fs", "cogging.p"])].any()
    columns = np.random.default_rng(6).normal(size=(5, len(where)))
    whole, rest = scaling.chain(ODD, columns), scaling.part(~itself)
    np.testing.assert_array_equal(whole[:, itself], columns[:, itself])
    np.testing.assert_array_equal(whole[:, ~itself], rest.chain(ODD, columns[:, ~itself]))


def test_what_columns_take_over_is_their_span_whatever_their_scale():
    rng = np.random.default_rng(8)
    a = rng.normal(size=(30, 4)) * [1e-9, 1.0, 1e6, 3.0]
    a = np.column_stack([a, a[:, 1] - 2.0 * a[:, 3], np.zeros(30)])
    basis = orthonormal(a)
    assert basis.shape == (30, 4)
    np.testing.assert_allclose(basis.T @ basis, np.eye(4), atol=1e-9)
    force = rng.normal(size=(30, 2))
    scaled = a[:, :4] / np.linalg.norm(a[:, :4], axis=0)
    wanted = force - scaled @ np.linalg.lstsq(scaled, force, rcond=None)[0]
    np.testing.assert_allclose(unabsorbed(force, basis), wanted, atol=1e-9)
    np.testing.assert_allclose(unabsorbed(force[:, 0], basis), wanted[:, 0], atol=1e-9)
    assert orthonormal(np.zeros((30, 0))).shape == (30, 0)
    np.testing.assert_array_equal(unabsorbed(force, np.zeros((30, 0))), force)
