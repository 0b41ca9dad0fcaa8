"""Laws of evidence: each against its definition, written another way."""

import numpy as np
import pytest
from linear_cases import coloured, cut, linear, without
from scipy.special import stdtrit
from scipy.stats import norm

from identify.estimation.evidence import (
    BLOCKS,
    effective_samples,
    evidence,
    held_out_gain,
    left_out,
    noise_gain,
    students_t,
)
from identify.estimation.least_squares import RIDGE

RNG = np.random.default_rng(21)


@pytest.mark.parametrize("pole", [0.0, 0.6, 0.95, -0.5])
def test_effective_samples_are_those_of_geyers_pairs(pole):
    r = coloured(1801, pole, 3) + 5.0
    c = r - r.mean()
    rho = np.array([c[: len(c) - k] @ c[k:] for k in range(900)]) / (c @ c)
    total = 0.0
    for k in range(0, 900, 2):
        if rho[k] + rho[k + 1] <= 0.0:
            break
        total += rho[k] + rho[k + 1]
    assert effective_samples(r) == pytest.approx(1801 / max(2.0 * total - 1.0, 1.0), rel=1e-9)
    many = effective_samples(coloured(200_000, abs(pole), 4))
    assert many == pytest.approx(200_000 * (1.0 - abs(pole)) / (1.0 + abs(pole)), rel=0.1)


def test_effective_samples_of_little_are_its_number():
    assert effective_samples(np.zeros(0)) == 1.0
    assert effective_samples(np.array([1.0, 2.0, 5.0])) == 3.0
    assert effective_samples(np.full(50, 7.0)) == 50.0
    assert effective_samples(np.linspace(0.0, 1.0, 64)) >= 2.0
    assert effective_samples(np.array([1.0, 2.0, 5.0, 9.0])) < 4.0


def test_the_bic_is_that_of_its_definition():
    before, after = RNG.normal(size=300) * 1.7, RNG.normal(size=300)
    found = evidence(before, after, 3)
    assert found.parameters == 3
    assert found.samples == effective_samples(after)
    assert found.log_gain == pytest.approx(np.log(np.sum(before**2) / np.sum(after**2)))
    n = found.samples
    bic = [n * np.log(np.mean(r**2)) + k * np.log(n) for r, k in ((before, 0), (after, 3))]
    assert found.delta_bic == pytest.approx(bic[0] - bic[1])


def test_a_held_out_gain_is_a_t_test_over_blocks():
    n, floor = 480, 0.3
    before, after = RNG.normal(size=n) * 1.3, RNG.normal(size=n)
    gains = [
        np.log(np.sum(b**2 + floor**2) / np.sum(a**2 + floor**2))
        for b, a in zip(np.split(before, BLOCKS), np.split(after, BLOCKS), strict=True)
    ]
    found = held_out_gain(before, after, floor)
    wanted = np.mean(gains) / (np.std(gains, ddof=1) / np.sqrt(BLOCKS))
    assert found.t == pytest.approx(wanted)
    assert found.before == pytest.approx(np.sqrt(np.mean(before**2)))
    assert found.after == pytest.approx(np.sqrt(np.mean(after**2)))
    assert found.typical == pytest.approx(np.exp(-np.mean(gains)))
    assert held_out_gain(after, before, floor).t == pytest.approx(-wanted)
    assert held_out_gain(before, before, floor).t == 0.0
    assert held_out_gain(before[:1], after[:1], floor).t == 0.0
    short = held_out_gain(np.array([2.0, 3.0]), np.array([1.0, 1.0]), 0.0)
    two = np.log([4.0, 9.0])
    assert short.t == pytest.approx(two.mean() / (two.std(ddof=1) / np.sqrt(2.0)))
    none = held_out_gain(np.zeros(0), np.zeros(0), floor)
    assert none.t == 0.0
    assert np.isnan([none.before, none.after]).all()


@pytest.mark.parametrize("smoothed", [False, True])
def test_a_left_out_residual_is_that_of_a_fit_that_has_not_seen_it(smoothed):
    columns, data, _ = linear(1)
    weak = RIDGE * np.diag(np.linalg.norm(columns, axis=0))
    weight = np.diag([4.0, 200.0, 0.1]) * smoothed
    rows, wanted = np.vstack([columns, weak, weight]), np.concatenate([data, np.zeros(6)])
    at = np.linalg.lstsq(rows, wanted, rcond=None)[0]
    found = left_out(columns @ at - data, columns, weight**2)
    for block in cut(len(data), BLOCKS):
        again = without(rows, wanted, block)
        np.testing.assert_allclose(found[block], (columns @ again - data)[block], atol=1e-6)


@pytest.mark.parametrize("freedom", [8, 100])
def test_a_quantile_and_a_noise_gain_are_scipys(freedom):
    for chance in (0.05, 0.01):
        assert students_t(chance, freedom) == pytest.approx(
            stdtrit(freedom, 1.0 - chance), rel=1e-3
        )
    r = RNG.normal(size=200)
    both = [norm(0.0, s).logpdf(r).mean() for s in (0.7, 1.2)]
    assert noise_gain(r, 0.7, 1.2) == pytest.approx(2.0 * (both[1] - both[0]))
