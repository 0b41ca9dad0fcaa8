"""The curve through one direction of a velocity-friction map, and its intervals."""

from __future__ import annotations

from dataclasses import astuple, replace

import numpy as np
import pytest
from scipy.special import stdtrit  # scipy.stats takes half a second to load

from identify.analysis.friction_curve import (
    LINE,
    NAMES,
    StribeckCurve,
    curve_through,
    fit_stribeck,
    stribeck_through,
)
from twin.errors import InputError

CURVE = StribeckCurve(0.285, 0.335, 0.01, 0.018)
SPEEDS = np.array([0.001, 0.002, 0.004, 0.007, 0.01, 0.015, 0.03, 0.1, 0.2, 0.3])


def one_way(speeds, noise: float, seed: int, repeats: int = 3):
    rng = np.random.default_rng(seed)
    speed = np.repeat(speeds, repeats) * (1.0 + 1e-4 * rng.standard_normal(repeats * len(speeds)))
    friction = CURVE(speed) + noise * rng.standard_normal(len(speed))
    return speed, friction, np.full(len(speed), 100.0)


def test_the_intervals_of_a_curve_hold_the_truth_as_often_as_they_say() -> None:
    """90 % of them; 25 maps leave 79 to 99 % to chance at two standard errors."""
    true = {name: getattr(CURVE, name) for name in NAMES}
    held = []
    for seed in range(25):
        found = curve_through(*one_way(SPEEDS, 1e-3, seed))
        held += [abs(found.values[n] - true[n]) <= found.half[n] for n in NAMES]
    assert 0.79 <= np.mean(held) <= 0.99


def test_few_fast_speeds_are_a_line_and_plateaus_at_one_speed_count_once() -> None:
    fast = one_way(np.array([0.1, 0.2, 0.3]), 1e-4, 1)
    found = curve_through(*fast)
    assert tuple(found.half) == LINE
    assert found.values == pytest.approx({"Fc": 0.285, "sigma2": 0.018}, rel=0.05)
    with pytest.raises(InputError, match="3 plateaus at 1 speed in"):
        curve_through(*one_way(np.array([0.1]), 1e-4, 1))


def test_a_curve_has_the_intervals_of_least_squares() -> None:
    """By the scatter about the curve over its slopes; a plateau weighs by its samples."""
    scatter = 1e-5 * np.random.default_rng(4).standard_normal(len(SPEEDS))
    samples = np.linspace(50.0, 150.0, len(SPEEDS))
    found = stribeck_through(SPEEDS, CURVE(SPEEDS) + scatter, samples)
    assert list(found.values.values()) == pytest.approx(astuple(CURVE)[:4], rel=1e-2)
    columns, weight = found.curve.slopes(SPEEDS), np.diag(samples)
    left, freedom = found(SPEEDS) - CURVE(SPEEDS) - scatter, len(SPEEDS) - 4
    covariance = np.linalg.inv(columns.T @ weight @ columns) * (left @ weight @ left) / freedom
    expected = stdtrit(freedom, 0.95) * np.sqrt(np.diag(covariance))
    assert [found.half[n] for n in NAMES] == pytest.approx(expected, rel=1e-5)


def test_a_curve_without_noise_is_found_exactly() -> None:
    found = fit_stribeck(SPEEDS, CURVE(SPEEDS), None)
    assert astuple(found) == pytest.approx(astuple(CURVE), rel=1e-6)
    with pytest.raises(InputError, match="four parameters, the map 3 speeds"):
        fit_stribeck(SPEEDS[:3], CURVE(SPEEDS[:3]))


def test_the_slopes_are_those_of_the_curve() -> None:
    for i, name in enumerate(("Fc", "Fs", "v0", "sigma2")):
        step = 1e-6 * getattr(CURVE, name)
        moved = replace(CURVE, **{name: getattr(CURVE, name) + step})
        change = (moved(SPEEDS) - CURVE(SPEEDS)) / step
        assert CURVE.slopes(SPEEDS)[:, i] == pytest.approx(change, rel=1e-4, abs=1e-9)
