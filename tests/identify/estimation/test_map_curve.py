"""The curve through one direction of a map, and its intervals; the band of any curve of a fit."""

from __future__ import annotations

from dataclasses import astuple
from types import SimpleNamespace

import numpy as np
import pytest
from built_fits import PLAIN, built_fit
from scipy.stats import t as student

from identify.estimation.curve_band import with_band
from identify.estimation.intervals import half_widths_of
from identify.estimation.map_curve import (
    LINE,
    NAMES,
    curve_through,
    speeds_of,
    stribeck_through,
)
from identify.estimation.stribeck_curve import StribeckCurve
from identify.estimation.velocity_map import VelocityMap
from twin.errors import InputError
from twin.model.parameters import free_parameters, read

CURVE = StribeckCurve(0.285, 0.335, 0.01, 0.018)
SPEEDS = np.array([0.001, 0.002, 0.004, 0.007, 0.01, 0.015, 0.03, 0.1, 0.2, 0.3])


def one_way(speeds, noise: float, seed: int, repeats: int = 3) -> VelocityMap:
    rng = np.random.default_rng(seed)
    speed = np.repeat(speeds, repeats) * (1.0 + 1e-4 * rng.standard_normal(repeats * len(speeds)))
    friction = CURVE(speed) + noise * rng.standard_normal(len(speed))
    return VelocityMap(speed, friction, np.zeros_like(speed), np.full(len(speed), 100.0))


def test_the_intervals_of_a_curve_hold_the_truth_as_often_as_they_say() -> None:
    """90 % of them; 25 maps leave 79 to 99 % to chance at two standard errors."""
    true = {name: getattr(CURVE, name) for name in NAMES}
    held = []
    for seed in range(25):
        found = curve_through(one_way(SPEEDS, 1e-3, seed))
        held += [abs(found.values[n] - true[n]) <= found.half[n] for n in NAMES]
    assert 0.79 <= np.mean(held) <= 0.99


def test_few_fast_speeds_are_a_line_and_plateaus_at_one_speed_count_once() -> None:
    fast = one_way(np.array([0.1, 0.2, 0.3]), 1e-4, 1)
    assert [len(group) for group in speeds_of(fast)] == [3, 3, 3]
    found = curve_through(fast)
    assert tuple(found.half) == LINE
    assert found.values == pytest.approx({"Fc": 0.285, "sigma2": 0.018}, rel=0.05)
    with pytest.raises(InputError, match="3 plateaus at 1 speed in"):
        curve_through(one_way(np.array([0.1]), 1e-4, 1))


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_curve_through_a_map_has_the_intervals_of_least_squares(way: float) -> None:
    """By the scatter about the curve over its slopes; a plateau weighs by its samples."""
    scatter = 1e-5 * np.random.default_rng(4).standard_normal(len(SPEEDS))
    samples = np.linspace(50.0, 150.0, len(SPEEDS))
    found = stribeck_through(
        VelocityMap(way * SPEEDS, CURVE(SPEEDS) + scatter, 0.0 * SPEEDS, samples)
    )
    assert list(found.values.values()) == pytest.approx(astuple(CURVE)[:4], rel=1e-2)
    columns, weight = found.curve.slopes(SPEEDS), np.diag(samples)
    left, freedom = found(SPEEDS) - CURVE(SPEEDS) - scatter, len(SPEEDS) - 4
    covariance = np.linalg.inv(columns.T @ weight @ columns) * (left @ weight @ left) / freedom
    expected = student.ppf(0.95, freedom) * np.sqrt(np.diag(covariance))
    assert [found.half[n] for n in NAMES] == pytest.approx(expected, rel=1e-5)


def test_what_two_estimates_have_in_common_is_surer_than_either() -> None:
    """Two columns that are nearly one: their sum is known where neither of them is."""
    rng = np.random.default_rng(5)
    one = rng.standard_normal(600)
    columns = np.stack([one, one + 1e-3 * rng.standard_normal(600)], axis=1)
    fit = SimpleNamespace(jacobian=columns, residual=rng.standard_normal(600))
    alone, (both,) = half_widths_of(fit, np.eye(2)), half_widths_of(fit, np.ones((2, 1)))
    assert both < 0.01 * alone.min()
    assert both == pytest.approx(1.7 / np.sqrt(600), rel=0.5)


def test_the_band_of_a_curve_follows_from_what_each_parameter_does_to_it() -> None:
    """Of one that is linear in the parameters it is that of its slopes."""
    rng, where = np.random.default_rng(3), free_parameters(PLAIN)
    columns, slopes = rng.standard_normal((600, len(where))), rng.standard_normal((len(where), 4))
    fit = built_fit(0.1, residual=0.1 * rng.standard_normal(600), jacobian=columns)
    curve, half = with_band(fit, lambda axis: read(axis, where) @ slopes, where)
    np.testing.assert_allclose(curve, read(PLAIN, where) @ slopes)
    np.testing.assert_allclose(half, half_widths_of(fit, slopes), rtol=1e-6)
    _, one = with_band(fit, lambda axis: read(axis, where) @ slopes, where[:1])
    alone = np.where(np.arange(len(where))[:, None] == 0, slopes, 0.0)
    np.testing.assert_allclose(one, half_widths_of(fit, alone), rtol=1e-6)
