"""Rates and smoothing are exact on the polynomials they are for, whatever the period."""

import numpy as np
import pytest

from twin.signals import (
    MANY,
    between,
    local_cubic,
    local_parabola,
    median,
    rate,
    sliding_products,
    usual_size,
)

PERIOD = 0.02
T = PERIOD * np.arange(-8, 9)


def test_between_samples_the_rate_is_that_of_the_middle():
    middle = 0.5 * (T[1:] + T[:-1])
    parabolas = np.stack([1.0 + 3.0 * T**2, -(T**2)])
    np.testing.assert_allclose(between(parabolas, PERIOD), [6.0 * middle, -2.0 * middle])


def test_at_the_samples_the_rate_of_a_parabola_is_exact_but_for_the_ends():
    np.testing.assert_allclose(rate(3.0 * T**2, PERIOD)[1:-1], 6.0 * T[1:-1], atol=1e-12)


@pytest.mark.parametrize("samples", [3, 7, 17])
def test_a_local_parabola_keeps_a_parabola_and_its_rate(samples):
    bent = 2.0 - T + 5.0 * T**2
    np.testing.assert_allclose(local_parabola(bent, samples), bent, atol=1e-12)
    found = local_parabola(np.stack([bent, T]), samples, derivative=1, period=PERIOD)
    np.testing.assert_allclose(found, [-1.0 + 10.0 * T, np.ones_like(T)], atol=1e-10)
    np.testing.assert_array_equal(local_parabola(bent, 1), bent)


def test_a_local_cubic_is_read_in_the_middle():
    both = np.stack([2.0 - T + 5.0 * T**2 - 7.0 * T**3, 4.0 * T], axis=1)
    value, first, second = local_cubic(both, PERIOD)
    np.testing.assert_allclose(value, [2.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(first, [-1.0, 4.0], atol=1e-10)
    np.testing.assert_allclose(second, [10.0, 0.0], atol=1e-8)


def test_the_usual_size_passes_outliers_by():
    noise = np.random.default_rng(4).normal(0.0, 3.0, 20_000)
    noise[::50] = 1e6
    assert usual_size(noise) == pytest.approx(3.0, rel=0.04)


def test_sliding_products_are_those_of_every_stretch():
    rng = np.random.default_rng(3)
    signal = rng.normal(size=37)
    for length in (1, 5, 36, 37):
        pattern = rng.normal(size=length)
        wanted = [pattern @ signal[k : k + length] for k in range(38 - length)]
        np.testing.assert_allclose(sliding_products(signal, pattern), wanted, atol=1e-12)


def test_the_median_of_many_is_exact():
    rng = np.random.default_rng(5)
    for count in (MANY - 1, MANY, 3 * MANY + 1):
        noise = np.abs(rng.normal(size=count))
        wave = np.sin(np.arange(count) * 2.0 * np.pi / (count // 1000))  # as often as the sample
        for values in (noise, np.sort(noise), np.round(noise, 1), wave, np.full(count, 2.0)):
            assert median(values) == np.median(values)
        noise[7] = np.nan
        assert np.isnan(median(noise))
