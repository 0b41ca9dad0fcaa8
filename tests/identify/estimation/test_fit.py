"""Laws of a fit: its solver, scaling, priors and bounds, and the search of an effect's shape."""

from __future__ import annotations

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from built_fits import (
    PERIOD,
    PLAIN,
    axis_of,
    built_dataset,
    built_machine,
    built_motion,
    fitted,
    pushed,
)
from constructed import effect, fit_of, held, log_of, moved, waves, windowed
from machines import CATALOGUE
from scipy.optimize import least_squares

from identify.dataset.blocks import Blocks
from identify.dataset.dataset import Dataset
from identify.dataset.motion import motion_of
from identify.dataset.prepared_log import PreparedLog, moving
from identify.estimation.errors import error_on
from identify.estimation.fit import Fit, Outcome, at_bounds, finished, fit_axis, rms
from identify.estimation.force_balance import jacobian, residual
from identify.estimation.least_squares import minimise, orthonormal, unabsorbed
from identify.estimation.scaling import Scaling
from identify.estimation.variable_projection import (
    fit_multistart,
    fit_without,
    starts,
    tried_shapes,
    with_what_repeats,
)
from identify.rules import RULE
from twin.effect import Excitation
from twin.excitation import Repeating
from twin.model.machine import AxisModel, Fitted
from twin.model.parameters import ParameterReference, free_parameters, read

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


# Laws of the solver, the scaling and subspaces: SciPy's solutions, a bijection, a projection


WIDE = np.full(3, -1e9), np.full(3, 1e9)
TIGHT = {"xtol": 1e-15, "ftol": 1e-15, "gtol": 1e-15}


@pytest.mark.parametrize("seed", range(3))
def test_curved_problems_within_bounds_are_solved_as_scipy_solves_them(seed):
    rng = np.random.default_rng(seed)
    t = np.linspace(0.1, 2.0, 50)
    true = np.array([2.0, 1.3, 0.4]) * rng.uniform(0.8, 1.2, 3)
    noise = rng.normal(0.0, 0.01, 50)

    def curve(x):
        return x[0] * np.exp(-x[1] * t) + x[2] * t**2

    def left(x):
        return curve(x) - curve(true) - noise

    def slope(x):
        e = np.exp(-x[1] * t)
        return np.stack([e, -x[0] * t * e, t**2], axis=1)

    for high in (9.0, 0.8 * true[1]):  # free, and with the rate at its bound
        bounds = np.zeros(3), np.array([9.0, high, 9.0])
        start = np.array([1.0, 0.5 * high, 1.0])
        found = minimise(left, slope, start, bounds, tolerance=1e-14, most_evaluations=200)
        wanted = least_squares(left, start, slope, bounds, **TIGHT)
        assert found.converged
        np.testing.assert_allclose(found.x, wanted.x, rtol=2e-4)
        assert found.x[1] <= high


def test_a_search_leaves_a_jacobian_as_it_is_and_needs_the_last_one_alone():
    t, held, given = np.linspace(0.1, 2.0, 50), np.empty((50, 2)), []

    def left(x):
        return x[0] * np.exp(-x[1] * t) - 2.0 * np.exp(-1.3 * t)

    def slope(x):
        return np.stack([np.exp(-x[1] * t), -x[0] * t * np.exp(-x[1] * t)], axis=1)

    def in_one_place(x):
        if given:
            np.testing.assert_array_equal(held, given[-1])
        held[:] = slope(x)
        given.append(held.copy())
        return held

    found, wanted = (
        minimise(left, one, np.array([1.0, 0.5]), (np.zeros(2), np.full(2, 9.0)), tolerance=1e-14)
        for one in (in_one_place, slope)
    )
    assert len(given) > 1
    np.testing.assert_array_equal(found.x, wanted.x)


def test_a_solver_stops_where_it_was_told_and_says_so():
    def cost(x):
        return np.array([10.0 * (x[1] - x[0] ** 2), 1.0 - x[0], x[2]])

    def slope(x):
        return np.array([[-20.0 * x[0], 10.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])

    calls = []

    def counted(x):
        calls.append(x)
        return cost(x)

    start = np.array([-1.2, 1.0, 2.0])
    short = minimise(counted, slope, start, WIDE, tolerance=1e-12, most_evaluations=3)
    assert not short.converged
    assert len(calls) == 1 + 3
    assert np.sum(cost(short.x) ** 2) < np.sum(cost(start) ** 2)
    loose, full = (
        minimise(cost, slope, start, WIDE, tolerance=t, most_evaluations=300) for t in (0.9, 1e-12)
    )
    assert loose.converged
    assert np.sum(cost(loose.x) ** 2) > 1e-3
    np.testing.assert_allclose(full.x, [1.0, 1.0, 0.0], atol=1e-5)


def test_a_variable_that_does_nothing_and_one_pushed_outwards_stay():
    a = 1e-4 * np.array([[1.0, 0.0, 2.0], [2.0, 0.0, -1.0], [1.5, 0.0, 0.3], [0.2, 0.0, 1.0]])
    b = a @ [3.0, 0.0, -4.0]
    bounds = np.array([-9.0, -9.0, -1.0]), np.array([1.0, 9.0, 9.0])

    def solved(sign, start):
        return minimise(
            lambda x: a @ x + sign * b, lambda x: a, np.array(start), bounds,
            tolerance=1e-14, most_evaluations=99,
        )  # fmt: skip

    for start in ([1.0, 0.7, -1.0], [0.3, 0.7, 5.0], [-99.0, 0.7, 99.0]):
        found = solved(-1.0, start)
        np.testing.assert_allclose(found.x, [1.0, 0.7, -1.0])
        assert found.converged
    np.testing.assert_allclose(solved(1.0, [1.0, 0.7, -1.0]).x, [-3.0, 0.7, 4.0], rtol=1e-5)
    flat = minimise(
        lambda x: np.ones(4), lambda x: 0.0 * a, np.zeros(3), bounds,
        tolerance=1e-9, most_evaluations=5,
    )  # fmt: skip
    assert flat.converged
    np.testing.assert_array_equal(flat.x, np.zeros(3))


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


# What the tests of a search start from


@pytest.fixture(scope="module")
def dataset():
    return built_dataset("one", "two")


@pytest.fixture(scope="module")
def base(dataset):
    """The axis off its best values, with the residual and Jacobian that it has there."""
    off = replace(axis_of(fitted("constant_force", F0=0.2)), mass=5.6)
    return finished(off, PLAIN, dataset.training, Outcome.CONVERGED)


# The search of an effect's shape: which values are tried, and how many of them


# The rules as they were decided.
REFINED_STARTS, RESIDUAL_LINES, FEWEST_CYCLES = 2, 6, 2.5
SEEN = Excitation(-0.05, 0.07, 0.4, 0.3, 3.0, 1e-3)


def planted(effect: str, **values: float) -> Dataset:
    """Two logs, longer than their heads, of an axis with one effect more; without values none."""
    motions = [built_motion(name, 7.0, seed) for seed, name in enumerate(("one", "two"))]
    if values:
        motions = [pushed(m, fitted(effect, **values)) for m in motions]
    return replace(built_dataset(), training=tuple(PreparedLog.of(m, 0.04) for m in motions))


@pytest.mark.parametrize(
    ("effect", "values"),
    [
        ("periodic_disturbance", {"f": 11.0, "a": 0.1, "b": 0.05}),
        ("cogging", {"p": 0.0213, "a1": 0.1, "b2": 0.05}),
        ("end_stop", {"low": -0.0465, "high": 0.048, "stiffness": 500.0}),
    ],
)
def test_the_first_start_has_the_scanned_values_nearest_to_the_planted_ones(effect, values):
    dataset, effect = planted(effect, **values), CATALOGUE[effect]
    base = fit_axis(PLAIN, dataset.training)
    shapes = list(tried_shapes(effect, with_what_repeats(base, dataset)))
    found = starts(base, dataset, effect)
    assert len(found) == min(REFINED_STARTS, len(shapes))
    for name, value in found[0].shape.items():
        assert value == min((s[name] for s in shapes), key=lambda v: abs(v - values[name]))
    assert [s.squared_error for s in found] == sorted(s.squared_error for s in found)
    assert found[0].share(base) > 0.9


def test_where_nothing_gains_more_than_chance_one_start_is_enough():
    dataset = planted("end_stop")
    found = starts(fit_axis(PLAIN, dataset.training), dataset, CATALOGUE["end_stop"])
    assert len(found) == 1


def test_a_wave_longer_than_the_logs_can_show_is_no_start():
    dataset = planted("cogging", p=0.035, a1=0.3)  # m; the travel is 0.1 m
    base = fit_axis(PLAIN, dataset.training)
    position = np.concatenate([log.motion.position for log in dataset.training])
    longest = np.ptp(position) / FEWEST_CYCLES
    seen = with_what_repeats(base, dataset)
    assert any(s["p"] > 2.0 * longest for s in tried_shapes(CATALOGUE["cogging"], seen))
    assert all(s.shape["p"] <= longest for s in starts(base, dataset, CATALOGUE["cogging"]))


def test_a_tone_in_the_residual_is_among_the_first_lines_tried(dataset):
    base = finished(PLAIN, PLAIN, dataset.training, Outcome.CONVERGED)
    tone = np.concatenate([np.sin(2.0 * np.pi * 7.3 * w.time) for w in dataset.training])
    loud = replace(base, residual=tone[base.kept])
    known = replace(dataset, covered=lambda: replace(SEEN, repeats=Repeating((3.21, 4.56))))
    found = with_what_repeats(loud, known)
    assert found.lines[-2:] == (3.21, 4.56)
    assert abs(found.lines[0] - 7.3) < 0.5
    assert len(found.lines) <= RESIDUAL_LINES + 2
    assert replace(found, repeats=known.excitation.repeats) == known.excitation
    assert (found.pitches, found.thrust_pitches) == (loud.pitches, loud.thrust_pitches)


@pytest.mark.parametrize("name", ["axis_coupling", "cogging", "coulomb_viscous"])
def test_a_start_leaves_what_joint_least_squares_leave(dataset, base, name):
    """Of its strengths and the parameters of the base, without the friction that it replaces."""
    found = starts(base, dataset, CATALOGUE[name])[0]
    where = [ParameterReference(name, p) for p in found.fitted.effect.strengths]
    axis = base.axis.with_effect(found.fitted)
    stays = [not c.effect or c.effect in axis.without(name).names for c in base.scaling.where]
    own = jacobian(axis, dataset.training, where)[base.kept]
    both = np.hstack([own, base.jacobian[:, stays]])
    both = both / np.maximum(np.linalg.norm(both, axis=0), 1e-300)
    force = residual(axis, dataset.training)[base.kept]
    left = force - both @ np.linalg.lstsq(both, force, rcond=1e-9)[0]
    assert found.squared_error == pytest.approx(float(left @ left), rel=1e-3)
    np.testing.assert_allclose(found.force, force, atol=1e-6 * np.abs(force).max())


def test_a_strength_stops_at_its_bound():
    log = PreparedLog.of(pushed(built_motion("one", 3.0, 1), fitted("quadratic_drag", c=5.0)), 0.04)
    log = replace(log, command=log.command - 2.0 * residual(PLAIN, [log]))
    dataset = replace(built_dataset(), training=(log,))
    (found,) = starts(finished(PLAIN, PLAIN, dataset.training, Outcome.CONVERGED), dataset,
                      CATALOGUE["quadratic_drag"])  # fmt: skip
    assert found.fitted.values["c"] == 0.0


def test_without_an_effect_the_rest_stays_where_it_was(dataset, base):
    found = fit_without(base, dataset, "constant_force")
    assert found.axis == base.axis.without("constant_force")
    assert (found.begun, found.outcome) == (base.begun, base.outcome)
    np.testing.assert_allclose(
        found.residual, residual(base.axis, dataset.training)[found.kept] - 0.2, atol=1e-9
    )


def test_a_stop_that_only_a_late_move_reaches_is_the_first_start():
    """The heads, on which no strength of it makes a force, tell nothing of it."""
    plain = built_motion("late", 10.0)
    time = PERIOD * np.arange(len(plain.position))
    turn = 2.0 * np.pi * np.clip(time - 8.5, 0.0, 1.5) / 1.5
    x = plain.position + 0.04 * np.sin(turn) * (1.0 - np.cos(turn))
    v = np.gradient(x, PERIOD)
    u = plain.command + 5.3 * np.gradient(v - plain.velocity, PERIOD)
    motion = replace(plain, track=Blocks(np.stack([x, v, u]), np.stack([v, u])))
    low, high = (x.min() + 0.05 * np.ptp(x), x.max() - 0.05 * np.ptp(x))
    stopped = pushed(motion, fitted("end_stop", low=low, high=high, stiffness=2000.0))
    covered = replace(SEEN, position_low=float(x.min()), position_high=float(x.max()))
    dataset = replace(
        built_dataset(), training=(PreparedLog.of(stopped, 0.04),), covered=lambda: covered
    )
    (head,) = dataset.heads
    found = starts(fit_axis(PLAIN, dataset.training), dataset, CATALOGUE["end_stop"])
    first = found[0].shape
    assert first["low"] < head.motion.position.min()
    assert first["high"] > head.motion.position.max()
    assert not found[0].is_silent
    assert (first["low"], first["high"]) == pytest.approx((low, high), abs=0.03 * np.ptp(x))


def test_a_shape_is_sought_anew_where_error_is_left_and_nowhere_else():
    """From a wrong pitch a fit ends beside the right one; what is held stays held."""
    right = fitted("cogging", p=0.02, a1=0.4, b1=0.1)
    right = replace(right, fixed=right.fixed | {"b1"})
    dataset = built_machine(built_dataset("one", "two"), axis_of(right))
    begun = axis_of(replace(right, values={**right.values, "p": 0.031, "a1": 0.01}))
    stuck, found = fit_axis(begun, dataset.training), fit_multistart(begun, dataset)
    assert found.error < 0.1 * stuck.error
    values = found.axis["cogging"].values
    assert (values["p"], values["a1"]) == pytest.approx((0.02, 0.4), rel=0.01)
    assert (values["b1"], found.axis["cogging"].fixed) == (0.1, right.fixed)
    assert found.begun is begun
    quiet = fit_multistart(found.axis, dataset, begun=begun)
    assert quiet.error == pytest.approx(found.error, rel=1e-3)
    assert quiet.begun is begun
