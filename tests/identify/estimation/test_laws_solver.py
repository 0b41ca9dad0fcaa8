"""Laws of the solver, the scaling and subspaces: SciPy's solutions, a bijection, a projection."""

import numpy as np
import pytest
from constructed import effect
from scipy.optimize import least_squares

from identify.estimation.least_squares import minimise, orthonormal, unabsorbed
from identify.estimation.scaling import Scaling
from twin.model.machine import AxisModel
from twin.model.parameters import free_parameters, read

WIDE = np.full(3, -1e9), np.full(3, 1e9)
TIGHT = {"xtol": 1e-15, "ftol": 1e-15, "gtol": 1e-15}


@pytest.mark.parametrize("seed", range(3))
def test_linear_problems_within_bounds_are_solved_as_scipy_solves_them(seed):
    rng = np.random.default_rng(seed)
    a = rng.normal(size=(40, 3)) * 10.0 ** rng.uniform(-4.0, 4.0, 3)
    b = rng.normal(size=40) + a @ (rng.normal(size=3) / np.linalg.norm(a, axis=0) * 6.0)
    free = np.linalg.lstsq(a, b, rcond=None)[0]
    size = np.abs(free)
    shift = size * rng.choice([-0.4, 0.0, 0.4], 3)  # the solution within its bounds or beyond one
    low, high = free + shift - 0.3 * size, free + shift + 0.35 * size
    start = rng.uniform(low, high)
    found = minimise(
        lambda x: a @ x - b, lambda x: a, start, (low, high), tolerance=1e-13, most_evaluations=99
    )
    wanted = least_squares(
        lambda x: a @ x - b, start, lambda x: a, (low, high), x_scale="jac", **TIGHT
    )
    assert found.converged
    assert ((low <= found.x) & (found.x <= high)).all()
    assert np.sum((a @ found.x - b) ** 2) <= 2.0 * wanted.cost * (1.0 + 1e-7)


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


ODD = AxisModel(
    1.7,
    effects=(
        effect("lugre", {"Fc": 0.31, "Fs": 0.47, "v0": 0.013, "sigma2": 1.9, "sigma0": 700.0}),
        effect("cable_slab", {"offset": -0.2, "k1": 1.3}),
        effect("cogging", {"p": 0.021, "a1": 0.06}),
    ),
)


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
