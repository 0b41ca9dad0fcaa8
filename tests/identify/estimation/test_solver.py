"""Laws of the solver: SciPy's solutions within bounds, and where it stops."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import least_squares

from identify.estimation.least_squares import minimise

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
