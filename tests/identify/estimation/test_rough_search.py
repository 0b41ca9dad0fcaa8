"""The search in a rough error: it leaves dents, keeps bounds, and never ends above its start."""

from __future__ import annotations

import numpy as np
import pytest

from identify.estimation.simulated_motion import rough_minimum

OPEN = np.full(2, -np.inf), np.full(2, np.inf)


def dented(x: np.ndarray) -> float:
    """A bowl around (1, -2) with dents half a unit apart, in which slopes point anywhere."""
    away = x - np.array([1.0, -2.0])
    return float(np.sum(away**2) + 0.3 * np.sum(1.0 - np.cos(4.0 * np.pi * away)))


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_the_least_of_many_dents_is_found(seed: int) -> None:
    rng = np.random.default_rng(seed)
    found = rough_minimum(dented, np.zeros(2), np.ones(2), OPEN, rng)
    np.testing.assert_allclose(found, [1.0, -2.0], atol=1e-3)


def test_bounds_are_kept_and_what_is_not_finite_is_not_taken() -> None:
    low, high = np.zeros(2), np.array([0.5, 3.0])
    found = rough_minimum(
        lambda x: np.nan if x[1] < 0.2 else dented(x), np.array([0.2, 1.0]), np.ones(2),
        (low, high), np.random.default_rng(1),
    )  # fmt: skip
    np.testing.assert_array_equal(found, np.clip(found, low, high))
    assert found[1] >= 0.2


def test_an_error_that_nothing_lowers_gives_the_start() -> None:
    start = np.array([1.0, -2.0])
    found = rough_minimum(dented, start, np.full(2, 0.1), OPEN, np.random.default_rng(0))
    assert dented(found) <= dented(start)
