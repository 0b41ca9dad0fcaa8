"""Laws of evidence and of intervals: each against its definition, written another way."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from built_fits import PLAIN, built_fit, known_floor
from constructed import effect, fit_of, moved, windowed
from linear_cases import coloured, cut, linear, without
from scipy.special import stdtrit
from scipy.stats import norm

from identify.estimation.evidence import (
    BLOCKS,
    by_chance,
    effective_samples,
    evidence,
    held_out_gain,
    left_out,
    noise_gain,
    students_t,
    taken_by_lag,
)
from identify.estimation.force_balance import residual
from identify.estimation.intervals import (
    INSEPARABLE,
    ModelWrong,
    estimates,
    half_widths,
    half_widths_of,
    inseparable,
    refusal,
    with_band,
)
from identify.estimation.least_squares import RIDGE
from identify.estimation.scaling import Scaling
from identify.output.words.fit import no_interval_in_words
from identify.rules import RULE
from twin.effect import Parameter
from twin.model.machine import AxisModel
from twin.model.parameters import ParameterReference, free_parameters, read

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


@pytest.mark.parametrize("pole", [0.0, 0.9])
@pytest.mark.parametrize("turns", [3.0, 150.0])
def test_columns_take_of_noise_what_it_holds_where_they_are(pole, turns):
    """Of slow noise a slow curve takes much, and a fast one next to nothing."""
    phase = 2.0 * np.pi * turns * np.arange(1000) / 1000.0
    columns = np.stack([f(k * phase) for f in (np.sin, np.cos) for k in (1.0, 1.1)], axis=1)
    basis, share = np.linalg.qr(columns)[0], []
    for seed in range(400):
        noise = coloured(1000, pole, seed)
        share.append(np.sum((basis.T @ noise) ** 2) / np.sum(noise**2))
    colour = pole ** np.arange(1000.0)[: 1 if pole == 0.0 else 200]
    told = by_chance(taken_by_lag(columns, np.zeros((4, 4))), colour)
    assert told == pytest.approx(np.mean(share), rel=0.15)
    assert told == pytest.approx(0.004, rel=1e-6) if pole == 0.0 else (told > 0.01) == (turns < 10)
    twice = taken_by_lag(
        np.hstack([columns, columns[:, 1:], np.zeros((1000, 1))]), np.zeros((8, 8))
    )
    assert by_chance(twice, colour) == pytest.approx(told, rel=1e-6)
    stiff = 1e9 * np.eye(4)
    assert by_chance(taken_by_lag(columns, stiff), colour) < 1e-3 * told


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


class Stub(SimpleNamespace):
    """What is asked of a fit, which is one thing with itself alone."""

    __hash__ = object.__hash__


def jackknife(columns, data, at) -> np.ndarray:
    """Half widths of 90 % by leaving one block out, by refitting."""
    moves = [without(columns, data, b) - at for b in cut(len(data), BLOCKS)]
    spread = np.sqrt((1.0 - 1.0 / BLOCKS) * np.sum(np.square(moves), axis=0))
    return students_t(0.05, BLOCKS - 1) * spread


def by_influence(columns, data, at) -> np.ndarray:
    """The same by groups of like influence: each left out of a regression on what is its own.

    That is what a column holds that no other column explains (R. Frisch, F. V. Waugh, 1933).
    """
    out = []
    for j, column in enumerate(columns.T):
        others = np.delete(columns, j, axis=1)
        own = column - others @ np.linalg.lstsq(others, column, rcond=None)[0]
        order = np.argsort(np.abs(own))
        told = own[order] ** 2 / (own @ own)  # a test function is where the middle of its share is
        ends = np.searchsorted(np.cumsum(told) - told / 2.0, np.arange(1, 10) / 10)
        left = (data - columns @ at)[order]
        parts = list(zip(np.split(own[order], ends), np.split(left, ends), strict=True))
        moved = [(o @ r) ** 2 / (1.0 - (o @ o) / (own @ own)) for o, r in parts]
        out.append(students_t(0.05, 9) * np.sqrt(np.sum(moved)) / (own @ own))
    return np.array(out)


def test_intervals_are_those_of_the_jackknife_over_time_or_influence():
    columns, data, at = linear(3)
    fit = Stub(jacobian=columns, residual=columns @ at - data)
    both = jackknife(columns, data, at), by_influence(columns, data, at)
    np.testing.assert_allclose(half_widths(fit), np.maximum(*both), rtol=1e-6)


def test_what_a_prior_or_bound_shifts_is_in_the_interval():
    """The residual of a fit held off its least squares by c is not orthogonal to the columns."""
    columns, data, at = linear(5)
    off = [0.1, -0.02, 30.0]
    fit = Stub(jacobian=columns, residual=columns @ (at + off) - data)
    moves = []
    for b in cut(len(data), BLOCKS):
        rest = columns.T @ columns - columns[b].T @ columns[b]
        moves.append(np.linalg.solve(rest, columns[b].T @ fit.residual[b]))
    spread = students_t(0.05, BLOCKS - 1) * np.sqrt(
        (1.0 - 1.0 / BLOCKS) * np.sum(np.square(moves), axis=0)
    )
    spread = np.maximum(spread, by_influence(columns, data, at + off))
    np.testing.assert_allclose(half_widths(fit), spread + np.abs(off), rtol=1e-5)


def test_what_a_fit_does_not_see_has_no_interval_and_twins_are_named():
    columns, data, at = linear(6)
    seen = half_widths(Stub(jacobian=columns, residual=columns @ at - data))
    wide = np.column_stack([columns[:, 0], np.zeros(len(data)), columns[:, 1:]])
    some = half_widths(Stub(jacobian=wide, residual=columns @ at - data))
    np.testing.assert_allclose(some[[0, 2, 3]], seen)
    assert np.isinf(some[1])
    none = Stub(jacobian=0.0 * wide, residual=data)
    assert np.isinf(half_widths(none)).all()
    p = Parameter("", "N", 0.0, -1.0, 1.0, "")
    where = [ParameterReference("e", replace(p, name=n)) for n in "abcde"]
    a, b, c = np.linalg.qr(np.random.default_rng(7).normal(size=(50, 3)))[0].T
    for correlation, told in ((INSEPARABLE + 3e-5, True), (INSEPARABLE - 1e-4, False)):
        near = -7.0 * (correlation * a + np.sqrt(1.0 - correlation**2) * b)
        jacobian = np.stack([c, 0.0 * a, a, near], axis=1)
        fit = Stub(jacobian=jacobian, scaling=Scaling(tuple(where[:4])))
        assert inseparable(fit) == ({"e.c": "e.d", "e.d": "e.c"} if told else {})


def test_a_wrong_model_has_no_intervals():
    axis = AxisModel(1.0)
    fit = Stub(residual=np.ones(3), ratio=RULE.at_floor, error=0.2, floor=0.1, axis=axis)
    assert refusal(fit) is None
    fit.ratio = 1.001 * RULE.at_floor
    assert "200 mN is 2.0 times the noise floor 100 mN" in no_interval_in_words(refusal(fit))
    fit.residual = np.zeros(0)
    assert "comes to rest within every test function" in no_interval_in_words(refusal(fit))


def test_estimates_are_the_values_with_their_intervals_within_the_bounds():
    friction = effect("coulomb_viscous", {"Fc": 0.41, "Fs": 0.41, "sigma2": 0.01})
    cable = effect("cable_slab", {"offset": -0.3, "k1": 4.0})
    cable = replace(cable, fixed=cable.fixed | {"k2", "k3"})
    axis = AxisModel(1.7, effects=(replace(friction, fixed=friction.fixed | {"Fs"}), cable))
    log = windowed(moved(np.random.default_rng(8), 3.0, 1000.0))
    noise = np.random.default_rng(9).normal(0.0, 0.3, len(log))
    log = replace(log, command=log.command - residual(axis, [log]) + noise)
    fit = fit_of(axis, log)
    fit.__dict__["noise"] = known_floor(fit.error)
    found = estimates(fit)
    half = half_widths(fit)
    free = [e for e in found if e.free]
    assert [e.label for e in free] == [c.label for c in free_parameters(axis)]
    np.testing.assert_array_equal([e.value for e in free], read(axis, free_parameters(axis)))
    for e, c, width in zip(free, free_parameters(axis), half, strict=True):
        assert e.unit == c.parameter.unit
        assert e.reason is None
        assert e.high == pytest.approx(min(e.value + width, c.parameter.upper))
        assert e.low == pytest.approx(max(e.value - width, c.parameter.lower))
    assert next(e for e in free if e.label == "coulomb_viscous.sigma2").low == 0.0
    held = {e.label: e.value for e in found if not e.free}
    assert held == {"coulomb_viscous.Fs": 0.41, "cable_slab.k2": 0.0, "cable_slab.k3": 0.0}
    fit.__dict__["noise"] = known_floor(fit.error / 3.01)
    assert all(isinstance(e.reason, ModelWrong) for e in estimates(fit) if e.free)
    assert all(e.low is None and e.high is None for e in estimates(fit))
    unmoved = fit_of(replace(axis, mass_fixed=True), log)
    assert next(e.label for e in estimates(unmoved) if not e.free) == "mass"


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
